"""How many sub-pixels five frames in a row sample under each pattern of jitter (MNSS, figures 10 and 11).

    python3 -m clarus_training.coverage SEQUENCE ... [--scale S] [-o coverage.svg]

The pixels of every fifth frame are followed back through four frames by the sequences' motion. In each frame one sample
lies in the pixel's square; which of its s x s sub-pixels it lies in depends on motion and jitter. Sequences bring motion;
the patterns' jitter takes the place of their own.
"""

import argparse

import numpy as np

from . import operators
from .sequence import Sequence

FRAMES = 5


def patterns(scale):
    """Name: a list of (x, y) that repeats, in render pixels."""
    chance = np.random.default_rng(0)
    some = (chance.integers(0, scale, (1024, 2)) + 0.5) / scale - 0.5
    return {
        "centre": [(0.0, 0.0)],
        "random": [tuple(jitter) for jitter in some],
        "Halton, 16": operators.halton_jitter(16),
        "MNSS": operators.mnss_jitter(scale),
    }


def followed(motion):
    """`motion` [T, h, w, 2] in render pixels to the previous frame. Where the last frame's pixel centres were in each
    frame before it, [FRAMES, h, w, 2], itself first; NaN from where a surface came into sight, or the image."""
    height, width = motion.shape[1:3]
    place = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), -1)
    places = [place]
    for back in range(FRAMES - 1):
        pixel = np.floor(np.nan_to_num(place, nan=-1.0)).astype(int)
        inside = np.all((pixel >= 0) & (pixel < (width, height)), -1)
        x, y = np.clip(pixel[..., 0], 0, width - 1), np.clip(pixel[..., 1], 0, height - 1)
        place = np.where(inside[..., None], place + motion[len(motion) - 1 - back][y, x], np.nan)
        places.append(place)
    return np.stack(places)


def sampled(places, jitters, scale):
    """`jitters`: of the frames of `places`. How many sub-pixels of each pixel have a sample, [h, w]."""
    seen = np.zeros((*places.shape[1:3], scale * scale), bool)
    for place, jitter in zip(places, jitters):
        valid = np.isfinite(place).all(-1)
        corner = np.where(valid[..., None], place, 0.5) - 0.5
        within = np.mod(0.5 + np.array(jitter) - corner, 1.0)
        column, row = np.minimum(np.floor(scale * within + 1e-3).astype(int), scale - 1).transpose(2, 0, 1)
        index = (row * scale + column)[..., None]
        np.put_along_axis(seen, index, np.take_along_axis(seen, index, -1) | valid[..., None], -1)
    return seen.sum(-1)


def shares(motions, scale):
    """Of pixels that have 1 ... FRAMES sub-pixels, by the pattern's name. `motions`: of sequences, [T, h, w, 2]."""
    counts = {name: np.zeros(FRAMES + 1) for name in patterns(scale)}
    for motion in motions:
        for last in range(FRAMES - 1, len(motion), FRAMES):
            places = followed(np.asarray(motion[last - FRAMES + 1 : last + 1], np.float64))
            for name, jitters in patterns(scale).items():
                of_frames = [jitters[(last - back) % len(jitters)] for back in range(FRAMES)]
                counts[name] += np.bincount(sampled(places, of_frames, scale).ravel(), minlength=FRAMES + 1)
    return {name: count[1:] / count.sum() for name, count in counts.items()}


def table(measured):
    lines = ["| pattern | " + " | ".join(str(n) for n in range(1, FRAMES + 1)) + " | mean |", "|---" + "|--:" * (FRAMES + 1) + "|"]
    for name, share in measured.items():
        mean = np.dot(share, np.arange(1, FRAMES + 1))
        lines.append(f"| {name} | " + " | ".join(f"{100 * part:.1f} %" for part in share) + f" | {mean:.2f} |")
    return "\n".join(lines)


def plot(measured, scale):
    """Stacked bars, as SVG."""
    colors = ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"]
    left, width, bar = 90, 480, 34
    height = 40 + bar * len(measured) + 30
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + width + 20} {height}" font-family="sans-serif" font-size="13">',
             f'<rect width="100%" height="100%" fill="#fff"/><text x="{left}" y="20">pixels by their sampled sub-pixels, of {scale * scale}, in {FRAMES} frames</text>']
    for row, (name, share) in enumerate(measured.items()):
        y, x = 32 + row * bar, float(left)
        parts.append(f'<text x="{left - 8}" y="{y + 19}" text-anchor="end">{name}</text>')
        for part, color in zip(share, colors):
            parts.append(f'<rect x="{x:.1f}" y="{y}" width="{width * part:.1f}" height="{bar - 8}" fill="{color}"/>')
            x += width * part
    for index, color in enumerate(colors):
        x, y = left + index * 60, height - 26
        parts.append(f'<rect x="{x}" y="{y}" width="14" height="14" fill="{color}"/><text x="{x + 20}" y="{y + 12}">{index + 1}</text>')
    return "\n".join([*parts, "</svg>", ""])


def main():
    parser = argparse.ArgumentParser(prog="clarus_training.coverage", description=__doc__.split("\n")[0])
    parser.add_argument("sequences", nargs="+", metavar="SEQUENCE", help="folders with motion; their scale does not count")
    parser.add_argument("--scale", type=int, choices=[2, 3], default=3, help="3 unless told, as in the paper")
    parser.add_argument("-o", "--output", help="also writes an SVG there")
    arguments = parser.parse_args()
    measured = shares((Sequence(folder).motion for folder in arguments.sequences), arguments.scale)
    print(table(measured))
    if arguments.output:
        with open(arguments.output, "w") as file:
            file.write(plot(measured, arguments.scale))


if __name__ == "__main__":
    main()
