#!/usr/bin/env python3
"""What `clarus upscale --frame-rate x2` gains over blending: judge_interpolation.py CLARUS MANIFEST DIRECTORY WORK

Every second frame of each of the manifest's sequences is rendered, with the motion between those; upscaled with pictures
in between; and these compared with the references of the frames left out, which are the truth. So they are of the blend
of both upscaled neighbours. Only frames whose neighbours differ count. DIRECTORY holds the sequences with references, as
make_data.py makes them; WORK receives what is rendered and upscaled, and keeps it.
"""

import argparse
import os

import numpy as np
from clarus_training import manifest
from clarus_training.evaluate import run
from clarus_training.sequence import display, read_pixels

LEAST_CHANGE = 2 / 255  # of a picture that moves


def psnr(image, truth):
    return -10 * np.log10(max(float(np.mean((np.clip(image, 0, 1) - truth) ** 2)), 1e-10))


def every_second(clarus, entry, scale, folder):
    """The sequence of every second frame, rendered unless it is there."""
    if not os.path.exists(os.path.join(folder, "sequence.json")):
        taken = entry._replace(frames=(entry.frames + 1) // 2, output_buffers=False)
        command = taken.render_command(clarus, scale, folder)
        run([*command, "--frame-step", "2", "--no-reference"])
    return folder


def judge(clarus, entry, arguments):
    """PSNR of pictures in between and of blends, a row for each that moves."""
    sequence = every_second(clarus, entry, arguments.scale, os.path.join(arguments.work, "sequences", entry.name))
    upscaled = os.path.join(arguments.work, arguments.model, entry.name)
    command = [clarus, "upscale", sequence, "--model", arguments.model, "--output", upscaled, "--frame-rate", "x2"]
    run([*command, "--device", arguments.device])
    extension = ".exr" if entry.hdr else ".png"

    def shown(folder, name):
        pixels = display(read_pixels(os.path.join(folder, name + extension)), entry.hdr)
        return pixels / np.float32(255) if pixels.dtype == np.uint8 else pixels.astype(np.float32)

    rows = []
    reference = os.path.join(arguments.directory, entry.name, "reference")
    for i in range(1, (entry.frames + 1) // 2):
        before, truth, after = (shown(reference, f"{2 * i - 2 + step:04}") for step in range(3))
        if np.abs(after - before).max() <= LEAST_CHANGE:
            continue
        blend = (shown(upscaled, f"{i - 1:04}") + shown(upscaled, f"{i:04}")) / 2
        rows.append((psnr(shown(upscaled, f"{i:04}-before"), truth), psnr(blend, truth)))
    return np.array(rows)


def main():
    parser = argparse.ArgumentParser(description="Compare pictures in between with blends, by the frames left out.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("manifest")
    parser.add_argument("directory", help="the sequences with references")
    parser.add_argument("work")
    parser.add_argument("--model", default="enss-m-x2")
    parser.add_argument("--scale", default="2")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--only", nargs="+", help="names of sequences, in place of all")
    arguments = parser.parse_args()
    entries = [entry for entry in manifest.read(arguments.manifest) if entry.name in (arguments.only or [entry.name])]
    print(f"| PSNR in between, {arguments.model} | frames | interpolated | blended | gain |\n|---|--:|--:|--:|--:|")
    means = []
    for entry in entries:
        rows = judge(arguments.clarus, entry, arguments)
        if len(rows) == 0:
            continue
        means.append(rows.mean(axis=0))
        ours, blend = means[-1]
        print(f"| {entry.name} | {len(rows)} | {ours:.2f} | {blend:.2f} | {ours - blend:+.2f} |", flush=True)
    ours, blend = np.mean(means, axis=0)
    print(f"| mean | | {ours:.2f} | {blend:.2f} | {ours - blend:+.2f} |")


if __name__ == "__main__":
    main()
