"""The specification's operators on batches [N, C, H, W], differentiable in their images.

Coordinates follow the specification's image grid: index coordinate u = 3.0 is the centre of pixel 3. Motion is
[N, 2, h, w], x first; a vector with a component that is not finite is invalid. A jitter is a pair of floats, in render
pixels, shared by the batch.
"""

import torch
import torch.nn.functional as F

DILATE_BLOCK = 8


def bilinear(image, u, v):
    """The image around index coordinates u, v [N, H, W]; border `clamp`."""
    height, width = image.shape[-2:]
    grid = torch.stack(((2 * u + 1) / width - 1, (2 * v + 1) / height - 1), dim=-1)
    return F.grid_sample(image, grid, mode="bilinear", padding_mode="border", align_corners=False)


def upsample(image, scale, jitter=(0.0, 0.0)):
    """HR pixel (X, Y) = bilinear(image; (X+½)/s − ½ − jx, (Y+½)/s − ½ − jy; clamp)."""
    batch, _, height, width = image.shape
    u = (torch.arange(scale * width, dtype=image.dtype, device=image.device) + 0.5) / scale - 0.5 - jitter[0]
    v = (torch.arange(scale * height, dtype=image.dtype, device=image.device) + 0.5) / scale - 0.5 - jitter[1]
    shape = (batch, scale * height, scale * width)
    return bilinear(image, u.expand(shape), v[:, None].expand(shape))


def keys_upsample(image, scale, jitter=(0.0, 0.0)):
    """The `bicubic` filter: Keys a = −½, 4×4 taps, border clamp, jitter-aware, clamped to [0, 1]."""

    def along(image, axis, offset):
        size = image.shape[axis]
        u = (torch.arange(scale * size, dtype=torch.float64) + 0.5) / scale - 0.5 - offset
        base = torch.floor(u)
        result = 0
        for tap in range(-1, 3):
            x = (u - base - tap).abs()
            near = 1.5 * x**3 - 2.5 * x**2 + 1
            far = -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2
            weight = torch.where(x <= 1, near, far).to(image)
            taps = image.index_select(axis, (base + tap).long().clamp(0, size - 1).to(image.device))
            result = result + taps * (weight if axis == 3 else weight[:, None])
        return result

    return along(along(image, 3, jitter[0]), 2, jitter[1]).clamp(0, 1)


def mark_invalid(motion):
    """Canonical render-pixel motion with NaN for vectors that are not finite or longer than the image's diagonal."""
    height, width = motion.shape[-2:]
    squared = motion.double().square().sum(dim=1, keepdim=True)
    return torch.where(squared <= width * width + height * height, motion, torch.full_like(motion, float("nan")))


def dilate(motion, depth, scale):
    """HR motion in HR pixels, constant on 8×8 blocks: that of the block's nearest LR pixel, the first in raster order.

    A block's columns are ⌊8b/s⌋ … ⌊(8b+7)/s⌋, clipped to the image; its rows likewise. Invalid vectors stay invalid.
    """
    batch, _, height, width = depth.shape

    def candidates(size):
        # A block with fewer columns than the others repeats its last, which changes no minimum and no tie.
        block = torch.arange(-(-scale * size // DILATE_BLOCK), device=depth.device)[:, None]
        first = DILATE_BLOCK * block // scale
        last = ((DILATE_BLOCK * block + DILATE_BLOCK - 1) // scale).clamp(max=size - 1)
        most = (DILATE_BLOCK - 2) // scale + 2
        return torch.minimum(first + torch.arange(most, device=depth.device), last)

    rows, columns = candidates(height), candidates(width)
    pixel = (rows[:, None, :, None] * width + columns[None, :, None, :]).flatten(2)  # [block rows, block columns, n]
    nearest = depth.flatten(1)[:, pixel].argmin(dim=-1, keepdim=True)  # the first of equals
    chosen = pixel.expand(batch, *pixel.shape).gather(3, nearest).flatten(1)
    blocks = motion.flatten(2).gather(2, chosen[:, None].expand(-1, 2, -1)).view(batch, 2, *pixel.shape[:2])
    whole = blocks.repeat_interleave(DILATE_BLOCK, 2).repeat_interleave(DILATE_BLOCK, 3)
    return scale * whole[:, :, : scale * height, : scale * width]


def warp(image, motion, fallback):
    """out(X, Y) = bilinear(image; (X, Y) + motion(X, Y); clamp), and `fallback` where the motion is invalid.

    `fallback` is a number or an image; or a function without arguments that makes one, called when it is needed.
    """
    height, width = image.shape[-2:]
    x = torch.arange(width, dtype=image.dtype, device=image.device)
    y = torch.arange(height, dtype=image.dtype, device=image.device)[:, None]
    valid = torch.isfinite(motion).all(dim=1)
    if valid.all():
        return bilinear(image, x + motion[:, 0], y + motion[:, 1])
    motion = torch.where(valid[:, None], motion, torch.zeros_like(motion))
    warped = bilinear(image, x + motion[:, 0], y + motion[:, 1])
    fallback = fallback() if callable(fallback) else fallback
    return torch.where(valid[:, None], warped, torch.as_tensor(fallback, dtype=image.dtype, device=image.device))


def space_to_depth(image, scale):
    """Channel c·s² + dy·s + dx of LR (i, j) = channel c of HR (s·i+dx, s·j+dy)."""
    return F.pixel_unshuffle(image, scale)


def depth_to_space(image, scale):
    """The inverse of `space_to_depth`."""
    return F.pixel_shuffle(image, scale)


def halton_jitter(count=16):
    """The Halton (2, 3) jitters of one period, a list of (jx, jy)."""

    def radical_inverse(k, base):
        value, digit = 0.0, 1.0 / base
        while k:
            value += (k % base) * digit
            k, digit = k // base, digit / base
        return value

    return [(radical_inverse(k, 2) - 0.5, radical_inverse(k, 3) - 0.5) for k in range(1, count + 1)]
