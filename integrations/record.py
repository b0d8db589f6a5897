#!/usr/bin/env python3
"""Records the frames that a program shares as a sequence that every command of clarus reads: record.py NAME FOLDER"""

import argparse
import json
import math
import os

import numpy as np
import OpenImageIO as oiio
from clarus_share import COLOR, DEPTH, MOTION, Reader, ShareError

CHANNELS = {"color": (COLOR, 3), "depth": (DEPTH, 1), "motion": (MOTION, 2)}
FILE_TYPES = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}  # OpenImageIO's names


def write(path, pixels):
    height, width, channels = pixels.shape
    image = oiio.ImageOutput.create(path)
    if not image or not image.open(path, oiio.ImageSpec(width, height, channels, FILE_TYPES[str(pixels.dtype)])):
        raise SystemExit(f"record: cannot write {path}: {oiio.geterror()}")
    image.write_image(np.ascontiguousarray(pixels))
    image.close()


def sequence_of(description):
    """What holds for all frames. Motion is recorded in pixels, to the previous frame, y down."""
    color = description.resources[COLOR]
    shown = description.output_width / color.width if description.output_width else 2
    sequence = {
        "version": 1,
        "render_size": [color.width, color.height],
        "scale": description.scale or shown,
        "color_space": "linear" if description.linear_color else "srgb",
        "frames": [],
    }
    if description.output_width:
        sequence["output_size"] = [description.output_width, description.output_height]
    if description.resources[DEPTH].width:
        sequence["depth"] = {
            "encoding": "projective" if description.depth_projective else "linear",
            "reversed": bool(description.depth_reversed),
        }
    if description.resources[MOTION].width:
        sequence["motion"] = {
            "unit": "pixels",
            "direction": "to_previous",
            "y": "down",
            "jittered": bool(description.motion_jittered),
            "sampled_at": "jittered" if description.motion_sampled_at_jitter else "centre",
        }
    return sequence


def far_plane(frame):
    return frame.far_plane if math.isfinite(frame.far_plane) else None


def parameters_of(frame, sequence, follows):
    entry = {"jitter": [frame.jitter_x, frame.jitter_y], "reset": bool(frame.reset) or not follows}
    if sequence["color_space"] == "linear":
        entry["exposure"] = frame.exposure
    if [frame.width, frame.height] != sequence["render_size"]:
        entry["render_size"] = [frame.width, frame.height]
    if frame.has_matrices and frame.fov_y > 0 and frame.near_plane > 0:
        rows = lambda matrix: [list(matrix[4 * row : 4 * row + 4]) for row in range(4)]
        entry["camera"] = {"view": rows(frame.view), "projection": rows(frame.projection), "near": frame.near_plane,
                           "far": far_plane(frame), "fov_y": frame.fov_y}
    return entry


def pixels_of(frame, kind):
    index, channels = CHANNELS[kind]
    pixels = frame.images[index].array()[:, :, :channels]
    scale = (frame.motion_scale_x, frame.motion_scale_y)
    if kind == "motion" and scale != (1, 1):
        pixels = pixels.astype(np.float32) * np.array(scale, np.float32)
    return pixels


def record(reader, arguments, sequence):
    """Adds frames to the sequence, and writes their images."""
    kinds = [kind for kind, (index, _) in CHANNELS.items() if reader.description.resources[index].width]
    for kind in kinds:
        os.makedirs(os.path.join(arguments.folder, kind), exist_ok=True)
    number = None
    for index, frame in enumerate(reader):
        if index < arguments.skip:
            continue
        entry = parameters_of(frame, sequence, number is not None and frame.number == number + 1)
        number = frame.number
        if frame.frame_seconds > 0:
            sequence["frame_rate"] = 1 / frame.frame_seconds
        if reader.description.depth_projective:
            sequence["depth"].update(near=frame.near_plane, far=far_plane(frame))
        for kind in kinds:
            pixels = pixels_of(frame, kind)
            extension = "png" if pixels.dtype in (np.uint8, np.uint16) else "exr"
            entry[kind] = f"{kind}/{len(sequence['frames']):04}.{extension}"
            write(os.path.join(arguments.folder, entry[kind]), pixels)
        sequence["frames"].append(entry)
        if len(sequence["frames"]) == arguments.frames:
            return


def levels(text):
    value = float(text)
    if not -16 <= value <= 16:
        raise ValueError
    return value


def main():
    parser = argparse.ArgumentParser(description="Record the frames that a program shares as a sequence. Ctrl-C ends it.")
    parser.add_argument("name", help="of the program's stream, which may come later")
    parser.add_argument("folder", help="receives sequence.json, color, depth and motion")
    parser.add_argument("--frames", type=int, help="how many; by default all until the stream ends")
    parser.add_argument("--skip", type=int, default=0, help="frames that are let go before the first")
    parser.add_argument("--wait", type=int, default=60, help="seconds until the stream has to be there, 60 by default")
    parser.add_argument("--mip-bias", type=levels, metavar="LEVELS",
                        help="that the program draws its textures with, which its frames do not tell; best -log2 of the scale")
    arguments = parser.parse_args()
    try:
        with Reader(arguments.name, 1000 * arguments.wait) as reader:
            sequence = sequence_of(reader.description)
            if arguments.mip_bias is not None:
                sequence["mip_bias"] = arguments.mip_bias
            try:
                record(reader, arguments, sequence)
            except KeyboardInterrupt:  # what was recorded is whole
                pass
    except (ShareError, ValueError) as error:
        raise SystemExit(f"record: {error}")
    if not sequence["frames"]:
        raise SystemExit(f"record: {arguments.name} has ended before the first frame that was to be recorded")
    with open(os.path.join(arguments.folder, "sequence.json"), "w") as file:
        json.dump(sequence, file, indent=1)
    print(f"{len(sequence['frames'])} frames in {arguments.folder}")


if __name__ == "__main__":
    main()
