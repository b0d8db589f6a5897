"""Where samples lie and how points move: what needs no Blender."""

import numpy as np


def radical_inverse(index, base):
    result, digit = 0.0, 1.0 / base
    while index:
        index, remainder = divmod(index, base)
        result, digit = result + remainder * digit, digit / base
    return result


def jitter_of(frame, period=16):
    """In render pixels, x to the right and y down: Halton (2, 3) about the pixel's centre."""
    index = frame % period + 1
    return radical_inverse(index, 2) - 0.5, radical_inverse(index, 3) - 0.5


def project(points, world_from_camera, focal, size):
    """Pixel coordinates, [n, 2] with y down, and depths along the axis of view, [n], of world points [n, 3].
    `focal` is the focal length in pixels, `size` the image's (width, height)."""
    homogeneous = np.concatenate([points, np.ones((len(points), 1))], 1)
    x, y, z = (homogeneous @ np.linalg.inv(world_from_camera).T)[:, :3].T
    depth = -z
    return np.stack([size[0] / 2 + focal * x / depth, size[1] / 2 - focal * y / depth], 1), depth


def motion_and_depth(points, indices, now, before, focal, size, far):
    """Of an image of world positions [h, w, 3] and object indices [h, w]: where each was in the frame before, less where
    it is, in pixels of `size`, [h, w, 2] with y down; and depth [h, w]. `now` and `before` map an index to the object's
    matrix, 0 to the camera's. Where there is no object, depth is `far` and motion 0."""
    flat, ids = points.reshape(-1, 3).astype(np.float64), np.rint(indices).astype(int).ravel()
    motion, depth = np.zeros((len(flat), 2)), np.full(len(flat), float(far))
    for index in np.unique(ids):
        if index == 0:
            continue
        chosen = ids == index
        here = flat[chosen]
        moved = before[index] @ np.linalg.inv(now[index])
        there = here @ moved[:3, :3].T + moved[:3, 3]
        pixel, depth[chosen] = project(here, now[0], focal, size)
        motion[chosen] = project(there, before[0], focal, size)[0] - pixel
    shape = points.shape[:2]
    return motion.reshape(*shape, 2).astype(np.float32), depth.reshape(shape).astype(np.float32)


def encoded(linear):
    """sRGB of linear colour, cut to [0, 1]."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055).astype(np.float32)


def box_mean(image, n):
    """Means of n x n pixels."""
    height, width, channels = image.shape
    return image.reshape(height // n, n, width // n, n, channels).mean((1, 3))
