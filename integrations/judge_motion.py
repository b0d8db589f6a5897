#!/usr/bin/env python3
"""How well a sequence's motion fits its pictures: judge_motion.py SEQUENCE

The frame before is warped to each frame by its motion, and compared with it: PSNR beside that of the frame before as it
is. Once of all pixels that have a place in the frame before; once of those whose surface was in sight there, as depth
tells: what comes into sight no motion can show.
"""

import argparse
import json
import os

import numpy as np
import OpenImageIO as oiio


def read(folder, name):
    image = oiio.ImageInput.open(os.path.join(folder, name))
    if not image:
        raise SystemExit(f"judge_motion: cannot read {os.path.join(folder, name)}: {oiio.geterror()}")
    pixels = image.read_image(oiio.FLOAT)
    image.close()
    return pixels


def sample(image, x, y):
    """Bilinear, at index coordinates."""
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    right, bottom = np.minimum(left + 1, image.shape[1] - 1), np.minimum(top + 1, image.shape[0] - 1)
    across, down = (x - left)[..., None], (y - top)[..., None]
    above = image[top, left] * (1 - across) + image[top, right] * across
    below = image[bottom, left] * (1 - across) + image[bottom, right] * across
    return above * (1 - down) + below * down


def distances(sequence, depth):
    """Linear in the distance along the view, in any unit."""
    facts = sequence["depth"]
    if facts["encoding"] == "linear":
        return 1 - depth if facts.get("reversed", False) else depth
    near, far = facts["near"], facts["far"]
    value = 1 - depth if facts["reversed"] else depth
    return near / (1 - value * (1 if far is None else 1 - near / far))


def pixels_to_before(sequence, motion):
    facts = sequence["motion"]
    if facts["unit"] == "uv":
        motion = motion * np.float32(sequence["render_size"])
    if facts["direction"] == "from_previous":
        motion = -motion
    return motion * np.float32([1, -1 if facts["y"] == "up" else 1])


def psnr(difference):
    return -10 * np.log10(max(np.mean(np.square(difference)), 1e-10))


def compare(folder):
    """Of each frame that follows on one: its name, and of all pixels and of those that were in sight before their share
    of the picture, PSNR of the frame before as it is, and of it warped."""
    with open(os.path.join(folder, "sequence.json")) as file:
        sequence = json.load(file)
    width, height = sequence["render_size"]
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    before = None
    for entry in sequence["frames"]:
        color = read(folder, entry["color"])[:, :, :3]
        depth = distances(sequence, read(folder, entry["depth"])[:, :, 0])
        jitter = np.float64(entry["jitter"])
        if before and not entry["reset"]:
            motion = pixels_to_before(sequence, read(folder, entry["motion"])[:, :, :2])
            at_x = x + motion[:, :, 0] + jitter[0] - before["jitter"][0]
            at_y = y + motion[:, :, 1] + jitter[1] - before["jitter"][1]
            placed = (at_x >= 0) & (at_x <= width - 1) & (at_y >= 0) & (at_y <= height - 1)
            at_x, at_y = np.where(placed, at_x, 0), np.where(placed, at_y, 0)
            found = before["depth"][np.rint(at_y).astype(int), np.rint(at_x).astype(int)]
            in_sight = placed & (np.abs(found - depth) < 0.05 * depth)
            images = before["color"], sample(before["color"], at_x, at_y)
            if in_sight.any():
                yield entry["color"], *(
                    [mask.mean(), *(psnr((image - color)[mask]) for image in images)] for mask in (placed, in_sight)
                )
        before = {"color": color, "depth": depth, "jitter": jitter}


def main():
    parser = argparse.ArgumentParser(description="Tell how well a sequence's motion fits its pictures.")
    parser.add_argument("sequence", help="its folder")
    parser.add_argument("--frames", action="store_true", help="a line a frame, too: of pixels that were in sight")
    arguments = parser.parse_args()
    found = list(compare(arguments.sequence))
    if not found:
        raise SystemExit(f"judge_motion: no frame of {arguments.sequence} follows on another")
    if arguments.frames:
        for name, _, (share, still, warped) in found:
            print(f"{name}  {still:6.2f} -> {warped:6.2f} dB  {warped - still:+6.2f}  of {share:.0%} of the pixels")
    print(f"{len(found)} pairs of frames, PSNR of the frame before: as it is, warped, gain")
    for index, what in ((1, "all with a place in it"), (2, "surfaces in sight in it")):
        share, still, warped = np.mean([row[index] for row in found], axis=0)
        better = sum(row[index][2] > row[index][1] for row in found)
        print(
            f"{what:24} {still:6.2f} {warped:6.2f} {warped - still:+6.2f} dB, "
            f"better in {better}; {share:.0%} of the pixels"
        )


if __name__ == "__main__":
    main()
