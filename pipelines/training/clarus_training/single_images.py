"""Sequences of images that have nothing to do with each other, for upscalers that look at one frame."""

import json
import os
import shutil
import tempfile

from .evaluate import run
from .sequence import read_pixels


def write_sequence(folder, images, size, scale):
    """`images` name the files of each, by their kinds; `size` is the render resolution, width and height."""
    frames = [{**image, "jitter": [0, 0], "reset": True} for image in images]
    facts = {"version": 1, "render_size": size, "scale": scale, "color_space": "srgb", "frames": frames}
    with open(os.path.join(folder, "sequence.json"), "w") as file:
        json.dump(facts, file, indent=1)


def antialias(clarus, files, output):
    """What morphological antialiasing makes of 8-bit images of one size, under their numbers in a folder."""
    height, width = read_pixels(files[0]).shape[:2]
    with tempfile.TemporaryDirectory() as work:
        os.mkdir(os.path.join(work, "color"))
        copies = [shutil.copy(file, os.path.join(work, "color")) for file in files]
        write_sequence(work, [{"color": os.path.relpath(copy, work)} for copy in copies], [width, height], 1)
        run([clarus, "upscale", work, "--model", "nearest", "--antialias", "mlaa", "--output", output])
