#!/usr/bin/env python3
"""Every shipped model and filter on one held-out frame, beside each other: make_sheet.py CLARUS DIRECTORY SHEET.png

Networks in int8, which look like those in floating point, are left out.

DIRECTORY receives the sequence that each of them wants, its outputs, and keeps both: what is there is not made again.
"""

import argparse
import json
import os
import subprocess
import sys

from clarus_training.evaluate import run
from judge import RENDERED

HERE = os.path.dirname(os.path.abspath(__file__))
SCENE, FRAME = "brondehach", 28
JITTERS = {"mnss": ["--jitter", "mnss"], "srpo": ["--jitter", "none"], "stack": ["--jitter", "none"]}
OPTIONS = {"srpo": ["--antialias", "mlaa"], "stack": ["--antialias-input", "mlaa"]}
CROPS = ["405,140,160,90", "90,240,160,90"]  # a car behind wire mesh, a crash barrier


def models(clarus):
    """Name, pipeline and scale of each: those that are of no one scale at ×2, and first, then by scale."""
    known = [each for each in json.loads(run([clarus, "models", "--json"])) if not each["name"].endswith("-int8")]
    of_any_scale = [each for each in known if each["smallest_scale"] != each["largest_scale"]]
    of_one = sorted((each for each in known if each not in of_any_scale), key=lambda each: each["smallest_scale"])
    scales = ["2"] * len(of_any_scale) + [f"{each['smallest_scale']:g}" for each in of_one]
    return [(each["name"], each["pipeline"], scale) for each, scale in zip(of_any_scale + of_one, scales)]


def sequence_for(clarus, directory, pipeline, scale):
    """The folder of the scene as a pipeline wants it, rendered unless it is there."""
    jitter = JITTERS.get(pipeline, [])
    folder = os.path.join(directory, "-".join(["sequences", f"x{scale}", *jitter[1:]]))
    if not os.path.exists(os.path.join(folder, SCENE)):
        make = [sys.executable, "make_data.py", clarus, "held_out.json", folder, "--only", SCENE]
        subprocess.run([*make, *RENDERED[f"x{scale}"], *jitter], cwd=HERE, check=True)
    return os.path.join(folder, SCENE)


def main():
    parser = argparse.ArgumentParser(description="Make the contact sheet of all models and filters.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("directory")
    parser.add_argument("sheet", help="a PNG file")
    arguments = parser.parse_args()
    clarus, directory, sheet = map(os.path.abspath, (arguments.clarus, arguments.directory, arguments.sheet))
    names = []
    for name, pipeline, scale in models(clarus):
        sequence, output = sequence_for(clarus, directory, pipeline, scale), os.path.join(directory, name)
        if not os.path.exists(output):
            frames = ["--frames", f"0:{FRAME + 1}", *OPTIONS.get(pipeline, [])]
            run([clarus, "upscale", sequence, "--model", name, *frames, "--output", f"{output}.part"])
            os.rename(f"{output}.part", output)
        names.append(name)
        print(name, flush=True)
    reference = sequence_for(clarus, directory, "enss", "2")
    compare = [clarus, "compare", *names, reference, "--frames", f"{FRAME}:{FRAME + 1}"]
    crops = [word for crop in CROPS for word in ("--crop", crop)]
    picture = ["--sheet", sheet, "--sheet-columns", "6", "--column-width", "330", *crops]
    subprocess.run([*compare, *picture], cwd=directory, check=True)


if __name__ == "__main__":
    main()
