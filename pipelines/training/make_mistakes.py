#!/usr/bin/env python3
"""What wrong conventions look like, for docs/troubleshooting.md: make_mistakes.py CLARUS DIRECTORY MOVING.png STILL.png

One sequence is rendered, upscaled as it is, and with one thing of its JSON wrong at a time. MOVING is a frame while the
camera turns, STILL one ten frames after it has stopped. DIRECTORY receives the sequence and what is made of it, and
keeps both: what is there is not made again.
"""

import argparse
import json
import os

from clarus_training.evaluate import run

MODEL = "enss-m-x2"
SEQUENCE = ["--scene", "demo", "--path", "5", "--frames", "36", "--size", "480x270", "--scale", "2"]
MOVING, STILL = "0018", "0034"
CROPS = ["40,58,160,130", "370,237,160,110"]  # cables before the sky, a wheel that turns


def jitters(change):
    """A mistake in every frame's jitter."""

    def make(sequence):
        for frame in sequence["frames"]:
            frame["jitter"] = change(*frame["jitter"])

    return make


MISTAKES = {
    "right": lambda sequence: None,
    "motion from previous": lambda sequence: sequence["motion"].update(direction="from_previous"),
    "motion y up": lambda sequence: sequence["motion"].update(y="up"),
    "motion jittered": lambda sequence: sequence["motion"].update(jittered=True),
    "jitter x flipped": jitters(lambda x, y: [-x, y]),
    "no jitter": jitters(lambda x, y: [0, 0]),
    "depth reversed": lambda sequence: sequence["depth"].update(reversed=True),
}


def main():
    parser = argparse.ArgumentParser(description="Make the pictures of wrong conventions.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("directory")
    parser.add_argument("moving", help="a PNG file")
    parser.add_argument("still", help="a PNG file")
    given = parser.parse_args()
    clarus, directory, moving, still = map(os.path.abspath, (given.clarus, given.directory, given.moving, given.still))
    os.makedirs(directory, exist_ok=True)
    sequence = os.path.join(directory, "sequence")
    if not os.path.exists(sequence):
        run([clarus, "render", *SEQUENCE, "--output", sequence])
    with open(os.path.join(sequence, "sequence.json")) as file:
        right = file.read()
    folders = []
    for name, make in MISTAKES.items():
        folder = os.path.join(directory, name)
        folders.append(folder)
        if os.path.exists(folder):
            continue
        wrong = json.loads(right)
        make(wrong)
        described = os.path.join(sequence, f"{name}.json")
        with open(described, "w") as file:
            json.dump(wrong, file)
        run([clarus, "upscale", described, "--model", MODEL, "--no-check", "--output", f"{folder}.part"])
        os.rename(f"{folder}.part", folder)
        print(name, flush=True)
    crops = [word for crop in CROPS for word in ("--crop", crop)]
    for picture, frame in ((moving, MOVING), (still, STILL)):
        only = ["--frames", f"{int(frame)}:{int(frame) + 1}", "--sheet", picture, "--column-width", "320", "--sheet-columns", "4"]
        print(run([clarus, "compare", *folders, sequence, *only, *crops]), flush=True)


if __name__ == "__main__":
    main()
