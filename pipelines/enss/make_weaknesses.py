#!/usr/bin/env python3
"""Where ENSS at ×2 is bad: details of held-out frames by bicubic, S, M and L beside the reference, at twice their size.

make_weaknesses.py CLARUS DATA DIRECTORY PICTURE.jpg

DATA holds the held-out scenes at ×2, as ../training/judge.py renders them (DATA/held_out-x2). DIRECTORY receives what
is upscaled, and keeps it: what is there is not made again.
"""

import argparse
import os

import numpy as np

from make_film import beside, column, make, write

MODELS = ["bicubic", "enss-s-x2", "enss-m-x2", "enss-l-x2"]
# Scene, frame, part: around the blocks of 48×48 that lose most against bicubic's with M.
PLACES = [
    ("cages", 22, (72, 204, 128, 100)),
    ("cages", 18, (640, 204, 128, 100)),
    ("gears", 15, (248, 152, 128, 100)),
    ("ladders", 7, (296, 164, 128, 100)),
]


def main():
    parser = argparse.ArgumentParser(description="Make the picture of what ENSS is bad at.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("data")
    parser.add_argument("directory")
    parser.add_argument("picture", help="a JPEG file")
    given = parser.parse_args()
    rows = []
    for scene, frame, crop in PLACES:
        sequence = os.path.join(given.data, "held_out-x2", scene)
        folders = {model: os.path.join(given.directory, model, scene) for model in MODELS}
        for model, folder in folders.items():
            make(folder, given.clarus, "upscale", sequence, "--model", model)
        folders[f"{scene}, frame {frame}: reference"] = os.path.join(sequence, "reference")
        name = f"{frame:04}.png"
        rows.append(beside([column(os.path.join(folder, name), [crop], label) for label, folder in folders.items()]))
    write(given.picture, np.concatenate(rows), "jpeg:85")


if __name__ == "__main__":
    main()
