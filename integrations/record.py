#!/usr/bin/env python3
"""Records the frames that a program shares as a sequence that every command of clarus reads: record.py NAME FOLDER"""

import argparse
import json
import math
import os

import numpy as np
import OpenImageIO as oiio
from clarus_share import COLOR, DEPTH, MOTION, Reader


def write(path, pixels):
    height, width, channels = pixels.shape
    image = oiio.ImageOutput.create(path)
    if not image or not image.open(path, oiio.ImageSpec(width, height, channels, str(pixels.dtype))):
        raise SystemExit(f"record: cannot write {path}: {oiio.geterror()}")
    image.write_image(np.ascontiguousarray(pixels))
    image.close()


def sequence_of(description):
    size = description.resources[COLOR]
    scale = description.motion_scale_x, description.motion_scale_y
    if description.linear_color or scale not in [(1, 1), (-size.width, size.height)]:
        raise SystemExit("record: only display-encoded colour, and motion in pixels or uv, can be recorded")
    unit, direction, y = ("pixels", "to_previous", "down") if scale == (1, 1) else ("uv", "from_previous", "up")
    return {
        "version": 1,
        "render_size": [size.width, size.height],
        "scale": description.scale,
        "color_space": "srgb",
        "depth": {
            "encoding": "projective" if description.depth_projective else "linear",
            "reversed": bool(description.depth_reversed),
        },
        "motion": {
            "unit": unit,
            "direction": direction,
            "y": y,
            "jittered": bool(description.motion_jittered),
            "sampled_at": "jittered" if description.motion_sampled_at_jitter else "centre",
        },
        "frames": [],
    }


def main():
    parser = argparse.ArgumentParser(description="Record the frames that a program shares as a sequence.")
    parser.add_argument("name", help="of the program's stream, which may come later")
    parser.add_argument("folder", help="receives sequence.json, color, depth and motion")
    parser.add_argument("--frames", type=int, help="how many; all until the stream ends unless told")
    parser.add_argument("--skip", type=int, default=0, help="frames that are let go before the first")
    parser.add_argument("--wait", type=int, default=60, help="seconds until the stream has to be there, 60 unless told")
    arguments = parser.parse_args()
    kinds = {"color": (COLOR, 3, ".png"), "depth": (DEPTH, 1, ".exr"), "motion": (MOTION, 2, ".exr")}
    for kind in kinds:
        os.makedirs(os.path.join(arguments.folder, kind), exist_ok=True)
    with Reader(arguments.name, 1000 * arguments.wait) as reader:
        sequence = sequence_of(reader.description)
        number = None
        for index, frame in enumerate(reader):
            if index < arguments.skip:
                continue
            entry = {"jitter": [frame.jitter_x, frame.jitter_y]}
            entry["reset"] = bool(frame.reset) or number is None or frame.number != number + 1
            number = frame.number
            if reader.description.depth_projective:
                far = frame.far_plane if math.isfinite(frame.far_plane) else None
                sequence["depth"].update(near=frame.near_plane, far=far)
            for kind, (image, channels, extension) in kinds.items():
                entry[kind] = f"{kind}/{len(sequence['frames']):04}{extension}"
                path = os.path.join(arguments.folder, entry[kind])
                write(path, frame.images[image].array()[:, :, :channels])
            sequence["frames"].append(entry)
            if len(sequence["frames"]) == arguments.frames:
                break
    with open(os.path.join(arguments.folder, "sequence.json"), "w") as file:
        json.dump(sequence, file, indent=1)
    print(f"{len(sequence['frames'])} frames in {arguments.folder}")


if __name__ == "__main__":
    main()
