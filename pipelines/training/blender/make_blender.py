#!/usr/bin/env python3
"""Renders films with Blender's Python module: sequences OUTPUT/NAME, and OUTPUT/blender.json that evaluate.py reads."""

import argparse
import json
import math
import os
import sys
import time

import sampling

MOVING = 20  # frames; the rest stand still
SIZE = (480, 270)
FAR = 500.0
NAMES = ("workshop", "courtyard")
EXAMPLES = """examples:
  make_blender.py films
  make_blender.py films --scene workshop --scale 3 --frames 24 --samples 25
"""


def arguments_of(words):
    parser = argparse.ArgumentParser(description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output", help="the folder of sequences; frames that are there already are kept")
    parser.add_argument("--scene", choices=NAMES, help="one film, in place of all")
    parser.add_argument("--scale", type=int, default=2, help="2 (default), 3 or 4")
    parser.add_argument("--frames", type=int, default=32, help=f"32 by default; the first {MOVING} move")
    parser.add_argument("--samples", type=int, default=16, help="of a reference pixel, a square number (16)")
    parser.add_argument("--wrong-jitter", action="store_true", help="write jitter with its sign turned, to see that it matters")
    arguments = parser.parse_args(words)
    if arguments.scale not in (2, 3, 4):
        parser.error(f"--scale {arguments.scale}: should be 2, 3 or 4")
    if arguments.frames < 1:
        parser.error(f"--frames {arguments.frames}: should be 1 or more")
    if arguments.samples < 1 or math.isqrt(arguments.samples) ** 2 != arguments.samples:
        parser.error(f"--samples {arguments.samples}: should be a square number, as 16")
    return arguments


def segments_of(frames):
    spans = {"moving": [0, min(MOVING, frames)], "still": [MOVING, frames]}
    return [{"frames": span, "kind": kind} for kind, span in spans.items() if span[0] < span[1]]


def write_json(path, value):
    with open(f"{path}.part", "w") as file:
        json.dump(value, file, indent=1)
    os.replace(f"{path}.part", path)


def render_film(name, folder, arguments):
    from renderer import Renderer  # needs bpy

    scale, part = arguments.scale, f"{folder}.part"
    settings = {"scale": scale, "samples": arguments.samples}
    kept = os.path.join(part, "settings.json")
    os.makedirs(part, exist_ok=True)
    if os.path.exists(kept) and json.load(open(kept)) != settings:
        raise SystemExit(f"{part}: begun with other settings; remove it first")
    write_json(kept, settings)
    renderer, frames, start = Renderer(name, SIZE, FAR), [], time.monotonic()
    for t in range(arguments.frames):
        jitter = sampling.jitter_of(t)
        files = {key: f"{key}/{t:04}.exr" for key in ("color", "depth", "motion", "reference", "reference_depth", "reference_motion")}
        paths = {key: os.path.join(part, file) for key, file in files.items()}
        if not all(map(os.path.exists, paths.values())):
            renderer.frame(min(t, MOVING - 1), min(max(t - 1, 0), MOVING - 1), jitter, scale, math.isqrt(arguments.samples), paths)
        sign = -1 if arguments.wrong_jitter else 1
        frames.append({**files, "jitter": [sign * j for j in jitter], "reset": t == 0})
        print(f"{name}: {t + 1}/{arguments.frames} ({time.monotonic() - start:.0f} s)", file=sys.stderr, flush=True)
    motion = {"unit": "pixels", "direction": "to_previous", "y": "down", "jittered": False, "sampled_at": "jittered"}
    write_json(os.path.join(part, "sequence.json"), {
        "version": 1, "render_size": SIZE, "scale": scale, "color_space": "srgb",
        "depth": {"encoding": "linear", "reversed": False}, "motion": motion, "frames": frames})
    os.remove(kept)
    os.rename(part, folder)


def main():
    arguments = arguments_of(sys.argv[1:])
    try:
        import bpy  # noqa: F401
    except ImportError:
        raise SystemExit("bpy is missing: pip install 'bpy>=4,<5' OpenEXR, with Python 3.11") from None
    names = [arguments.scene] if arguments.scene else NAMES
    os.makedirs(arguments.output, exist_ok=True)
    listed = []
    for name in names:
        folder = os.path.join(arguments.output, name)
        if os.path.exists(folder):
            print(f"{name}: left alone", file=sys.stderr)
        else:
            render_film(name, folder, arguments)
    for name in NAMES:
        described = os.path.join(arguments.output, name, "sequence.json")
        if os.path.exists(described):
            count = len(json.load(open(described))["frames"])
            listed.append({"name": name, "scene": f"blender:{name}", "frames": count, "output_buffers": True, "thin": True,
                           "size": "x".join(map(str, SIZE)), "segments": segments_of(count)})
    write_json(os.path.join(arguments.output, "blender.json"), listed)


if __name__ == "__main__":
    main()
