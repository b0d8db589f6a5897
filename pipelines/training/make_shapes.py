#!/usr/bin/env python3
"""Random geometric shapes, as SRPO is trained on (Gu et al. 2022, section 3.1.3): make_shapes.py DIRECTORY [--scale S].

DIRECTORY becomes a sequence of single images, each a reset: triangles, discs, rings, lines and Bézier curves in colour
gradients, one sample in the middle of every pixel, at the render and at the output resolution. --varied images differ
in how small their shapes are, down to foliage and gravel, and how near each other and how gray their colours.
--antialias CLARUS makes both resolutions morphologically antialiased, for upscalers that want such input. The same
command gives the same bytes.
"""

import argparse
import dataclasses
import os
import shutil

import numpy as np
import OpenImageIO as oiio

from clarus_training import single_images

CURVE_STEPS = 24
GREATEST_DETAIL = 8  # shapes of varied images are up to so many times as small
CROWDING = 1.7  # where they are n times as small, there are n^CROWDING times as many; 2 would cover all that was there


@dataclasses.dataclass
class Style:
    """What an image's shapes have in common; a plain image's unless told."""

    detail: float = 1  # times as small as in a plain image
    middle: np.ndarray | float = 0  # colours are `spread` times as far from it
    spread: float = 1
    gray: float = 0  # how much of the way to gray they are

    @staticmethod
    def varied(chance):
        return Style(GREATEST_DETAIL ** chance.random(), chance.random(3), chance.uniform(0.1, 1), chance.random())

    def colors(self, colors):
        grayer = (1 - self.gray) * colors + self.gray * colors[:, :1]
        return (1 - self.spread) * self.middle + self.spread * grayer


class Gradient:
    """A colour that changes along a direction."""

    def __init__(self, chance, style):
        self.colors = style.colors(chance.random((2, 3)))
        angle = chance.uniform(0, 2 * np.pi)
        self.direction = np.array([np.cos(angle), np.sin(angle)])

    def at(self, points):
        share = np.clip((points - 0.5) @ self.direction + 0.5, 0, 1)[:, None]
        return self.colors[0] * (1 - share) + self.colors[1] * share


def distance_to_path(points, path):
    """Of points [n, 2] to the line through a path's corners [m, 2]."""
    nearest = np.full(len(points), np.inf)
    for a, b in zip(path[:-1], path[1:]):
        along = np.clip((points - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0, 1)[:, None]
        nearest = np.minimum(nearest, np.linalg.norm(points - a - along * (b - a), axis=1))
    return nearest


class Shape:
    """What it covers: `inside(points)`, within the box of corners `low` and `high`. Coordinates are in [0, 1]²."""

    def __init__(self, chance, style):
        kind, detail = chance.choice(["triangle", "disc", "ring", "line", "curve"]), style.detail
        center, radius = chance.random(2), (0.25 * chance.random() ** 1.5 + 0.01) / detail
        if kind == "triangle":
            corners = center + 2 * radius * chance.uniform(-1, 1, (3, 2))
            edges = np.roll(corners, -1, axis=0) - corners
            turn = np.sign(np.linalg.det(edges[:2]))
            normals = turn * np.stack([-edges[:, 1], edges[:, 0]], axis=1)
            self.inside = lambda points: ((points[:, None] - corners) * normals).sum(axis=2).min(axis=1) > 0
            self.low, self.high = corners.min(axis=0), corners.max(axis=0)
        elif kind in ("disc", "ring"):
            hole = radius * chance.uniform(0.3, 0.95) if kind == "ring" else -1
            distance = lambda points: np.linalg.norm(points - center, axis=1)
            self.inside = lambda points: (distance(points) < radius) & (distance(points) > hole)
            self.low, self.high = center - radius, center + radius
        else:
            corners = center * (1 - 1 / detail) + chance.random((2 if kind == "line" else 4, 2)) / detail
            t = np.linspace(0, 1, CURVE_STEPS + 1)[:, None]
            bezier = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]
            path = corners if kind == "line" else sum(weight * corner for weight, corner in zip(bezier, corners))
            half = 0.02 * chance.random() ** 2 / detail + 0.0015
            self.inside = lambda points: distance_to_path(points, path) < half
            self.low, self.high = path.min(axis=0) - half, path.max(axis=0) + half
        self.color = Gradient(chance, style)


def picture(seed, width, height, shapes, varied=False):
    """8-bit colours [height, width, 3], sampled in the pixels' middles; the smaller its shapes, the more of them."""
    chance = np.random.default_rng(seed)
    style = Style.varied(chance) if varied else Style()
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    points = np.stack([x, y], axis=2)
    colors = Gradient(chance, style).at(points.reshape(-1, 2)).reshape(height, width, 3)
    for _ in range(round(shapes * style.detail**CROWDING)):
        shape = Shape(chance, style)
        size = np.array([width, height])
        (left, top), (right, bottom) = np.clip([shape.low * size, shape.high * size + 1], 0, size).astype(int)
        window = np.s_[top:bottom, left:right]
        seen = points[window].reshape(-1, 2)
        inside = shape.inside(seen).reshape(bottom - top, right - left)
        colors[window][inside] = shape.color.at(seen[inside.ravel()])
    return np.round(255 * colors).astype(np.uint8)


def write_image(path, pixels):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    output = oiio.ImageOutput.create(path)
    if not output or not output.open(path, oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")):
        raise SystemExit(f"{path}: {oiio.geterror()}")
    output.write_image(pixels)
    output.close()


def main():
    parser = argparse.ArgumentParser(description="Draw random geometric shapes for SRPO's training.")
    parser.add_argument("directory")
    parser.add_argument("--scale", type=int, choices=range(2, 7), default=2)
    parser.add_argument("--count", type=int, default=300, help="of images")
    parser.add_argument("--size", type=int, default=160, help="width and height at render resolution")
    parser.add_argument("--shapes", type=int, default=60, help="in a plain image")
    parser.add_argument("--varied", action="store_true", help="smaller shapes, nearer and grayer colours")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--antialias", metavar="CLARUS", help="the clarus program, which antialiases")
    arguments = parser.parse_args()
    if os.path.exists(arguments.directory):
        raise SystemExit(f"{arguments.directory} is there already; remove it or name another folder")
    part, scale, size = f"{arguments.directory}.part", arguments.scale, arguments.size
    shutil.rmtree(part, ignore_errors=True)
    names = [f"{i:04}" for i in range(arguments.count)]
    for kind, edge in (("color", size), ("reference", scale * size)):
        for i, name in enumerate(names):
            seed = arguments.seed, i
            pixels = picture(seed, edge, edge, arguments.shapes, arguments.varied)
            write_image(os.path.join(part, kind, f"{name}.png"), pixels)
        if arguments.antialias:
            folder = os.path.join(part, kind)
            files = [os.path.join(folder, f"{name}.png") for name in names]
            single_images.antialias(arguments.antialias, files, folder)
    pairs = [{"color": f"color/{name}.png", "reference": f"reference/{name}.png"} for name in names]
    single_images.write_sequence(part, pairs, [size, size], scale)
    os.rename(part, arguments.directory)


if __name__ == "__main__":
    main()
