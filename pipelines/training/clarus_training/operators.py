"""The operators of docs/pipelines.md on batches [N, C, H, W], differentiable in their images.

Coordinates follow docs/conventions.md, "Image grid": index coordinate u = 3.0 is the centre of pixel 3. Motion is
[N, 2, h, w], x first; a vector with a component that is not finite is invalid. A jitter is a pair of floats, in render
pixels, shared by the batch.
"""

import math

import numpy as np
import torch
import torch.nn.functional as F

DILATE_BLOCK = 8


def bilinear(image, u, v, border="clamp"):
    """The image around index coordinates u, v [N, H, W]; border `clamp` or `zero`."""
    return sample(image, grid_at(u, v, image.shape[-2:]), border)


def grid_at(u, v, size):
    """Index coordinates of an image of that (height, width) as `sample` takes them."""
    return torch.stack(((2 * u + 1) / size[1] - 1, (2 * v + 1) / size[0] - 1), dim=-1)


def sample(image, grid, border="clamp"):
    padding = {"clamp": "border", "zero": "zeros"}[border]
    return F.grid_sample(image, grid, mode="bilinear", padding_mode=padding, align_corners=False)


def mnss_jitter(scale):
    """MNSS's pattern for the scales 2 and 3 until it repeats: centres of sub-pixels."""
    if scale == 2:
        order = [((t + 1) // 2 % 2, (t - t // 3) % 2) for t in range(12)]
    else:
        order = [(0, 0), (1, 1), (2, 1), (0, 2), (2, 0), (2, 2), (0, 1), (1, 2), (1, 0)]
    return [((a + 0.5) / scale - 0.5, (b + 0.5) / scale - 0.5) for a, b in order]


def upsample(image, scale, jitter=(0.0, 0.0)):
    """HR pixel (X, Y) = bilinear(image; (X+½)/s − ½ − jx, (Y+½)/s − ½ − jy; clamp)."""
    if tuple(jitter) == (0, 0):
        return F.interpolate(image, scale_factor=scale, mode="bilinear", align_corners=False)
    batch, _, height, width = image.shape
    u = (torch.arange(scale * width, dtype=image.dtype, device=image.device) + 0.5) / scale - 0.5 - jitter[0]
    v = (torch.arange(scale * height, dtype=image.dtype, device=image.device) + 0.5) / scale - 0.5 - jitter[1]
    shape = (batch, scale * height, scale * width)
    return bilinear(image, u.expand(shape), v[:, None].expand(shape))


def upsample_motion(motion, scale, jitter):
    """HR motion in HR pixels, s · upsample(m, s, J_m): invalid where a tap of a weight over 10⁻³ along both axes is."""
    invalid = ~torch.isfinite(motion).all(dim=1)
    if not invalid.any():
        return scale * upsample(motion, scale, jitter)
    upsampled = scale * upsample(motion.masked_fill(invalid[:, None], 0), scale, jitter)

    def taps(size, offset):
        u = (torch.arange(scale * size, dtype=torch.float64, device=motion.device) + 0.5) / scale - 0.5 - offset
        u = u.clamp(0, size - 1)
        first = u.floor().long()
        weight = u - first
        return [(first, 1 - weight > 1e-3), ((first + 1).clamp(max=size - 1), weight > 1e-3)]

    bad = torch.zeros_like(upsampled[:, 0], dtype=torch.bool)
    for row, row_counts in taps(motion.shape[2], jitter[1]):
        for column, column_counts in taps(motion.shape[3], jitter[0]):
            bad |= invalid[:, row][:, :, column] & row_counts[:, None] & column_counts
    return upsampled.masked_fill(bad[:, None], float("nan"))


def keys_upsample(image, scale, jitter=(0.0, 0.0)):
    """The `bicubic` filter: Keys a = −½, 4×4 taps, border clamp, jitter-aware, clamped to [0, 1]."""

    return filter_upsample(image, scale, keys, 2, jitter).clamp(0, 1)


def keys(distance):
    x = np.abs(distance)
    near = 1.5 * x**3 - 2.5 * x**2 + 1
    far = -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2
    return np.where(x <= 1, near, np.where(x < 2, far, 0))


def keys_resample(image, scale, size, jitter=(0.0, 0.0)):
    """An image at `size` (height, width), by Keys' cubic around (X+½)/scale − ½ − jx, likewise along y, a scale from 0;
    border clamp. Below 1 nothing is averaged.
    """

    def weights(pixels, made, offset):
        place = (np.arange(made) + 0.5) / scale - 0.5 - offset
        taps = np.floor(place).astype(int)[:, None] + np.arange(-1, 3)
        matrix = np.zeros((made, pixels))
        np.add.at(matrix, (np.arange(made)[:, None], taps.clip(0, pixels - 1)), keys(place[:, None] - taps))
        return torch.from_numpy(matrix).to(image)

    along_y, along_x = map(weights, image.shape[2:], size, reversed(jitter))
    with torch.autocast(image.device.type, enabled=False):
        return along_y @ image @ along_x.T


def filter_upsample(image, scale, kernel, radius, jitter=(0.0, 0.0)):
    """The pixels around (X+½)/s − ½ − jx, (Y+½)/s − ½ − jy, weighted along each axis by `kernel` of their distances,

    which is 0 from `radius` on; normalised; border clamp. Output pixels at the same place in their s×s tiles have the
    same weights: all of it is one dense convolution, which every framework is fast at.
    """
    phase = (np.arange(scale) + 0.5) / scale - 0.5
    reach = radius + max(math.ceil(abs(j)) for j in jitter)
    tap = np.arange(-reach, reach + 1)
    along_x, along_y = (kernel((phase - j)[:, None] - tap) for j in jitter)
    weights = np.einsum("yv,xu->yxvu", *(w / w.sum(axis=1, keepdims=True) for w in (along_y, along_x)))
    channels = image.shape[1]
    weights = np.einsum("oi,yxvu->oyxivu", np.eye(channels), weights).reshape(-1, channels, len(tap), len(tap))
    padded = F.pad(image, (reach,) * 4, mode="replicate")
    with torch.autocast(image.device.type, enabled=False):
        return depth_to_space(F.conv2d(padded, torch.from_numpy(weights).to(image)), scale)


def mix(a, b, weight):
    """(1 − weight) · a + weight · b."""
    # Exported, torch.lerp is two such sums, and a choice between them by the weight.
    return a + weight * (b - a) if torch.onnx.is_in_onnx_export() else torch.lerp(a, b, weight)


def mark_invalid(motion):
    """Canonical render-pixel motion with NaN for vectors that are not finite or longer than the image's diagonal."""
    height, width = motion.shape[-2:]
    squared = motion.double().square().sum(dim=1, keepdim=True)
    return torch.where(squared <= width * width + height * height, motion, torch.full_like(motion, float("nan")))


def dilate_blocks(motion, depth, scale):
    """Motion in HR pixels for 8×8 blocks of HR pixels: that of the block's nearest LR pixel, the first in raster order.

    A block's columns are ⌊8b/s⌋ … ⌊(8b+7)/s⌋, clipped to the image; its rows likewise. Invalid vectors stay invalid.
    """
    batch, _, height, width = depth.shape

    def candidates(size):
        # A block with fewer columns than the others repeats its last, which changes no minimum and no tie.
        # Rounded up without negative numbers: divided, those are rounded otherwise in an exported graph.
        block = torch.arange((scale * size + DILATE_BLOCK - 1) // DILATE_BLOCK, device=depth.device)[:, None]
        first = DILATE_BLOCK * block // scale
        last = ((DILATE_BLOCK * block + DILATE_BLOCK - 1) // scale).clamp(max=size - 1)
        most = (DILATE_BLOCK - 2) // scale + 2
        return torch.minimum(first + torch.arange(most, device=depth.device), last)

    rows, columns = candidates(height), candidates(width)
    pixel = (rows[:, None, :, None] * width + columns[None, :, None, :]).flatten(2)  # [block rows, block columns, n]
    nearest = depth.flatten(1)[:, pixel].argmin(dim=-1, keepdim=True)  # the first of equals
    chosen = pixel.expand(batch, *pixel.shape).gather(3, nearest).flatten(1)
    return scale * motion.flatten(2).gather(2, chosen[:, None].expand(-1, 2, -1)).view(batch, 2, *pixel.shape[:2])


def expand_blocks(blocks, size):
    """Values of blocks [N, C, rows, columns] for every pixel of an HR image of that (height, width)."""
    return tiles(blocks, DILATE_BLOCK)[:, :, : size[0], : size[1]]


def tiles(image, size):
    """Every pixel as a tile of size×size pixels."""
    return F.interpolate(image, scale_factor=size, mode="nearest")


def dilate(motion, depth, scale):
    """HR motion in HR pixels, constant on the blocks of `dilate_blocks`."""
    height, width = depth.shape[-2:]
    return expand_blocks(dilate_blocks(motion, depth, scale), (scale * height, scale * width))


def warp_grid(motion):
    """Where HR motion takes each pixel, as `sample` has it; and which vectors are valid [N, 1, H, W], None if all."""
    height, width = motion.shape[-2:]
    x = torch.arange(width, dtype=motion.dtype, device=motion.device)
    y = torch.arange(height, dtype=motion.dtype, device=motion.device)[:, None]
    valid = torch.isfinite(motion).all(dim=1, keepdim=True)
    if valid.all():
        valid = None
    else:
        motion = motion.masked_fill(~valid, 0)
    return grid_at(x + motion[:, 0], y + motion[:, 1], (height, width)), valid


def warp(image, motion, border, fallback):
    """out(X, Y) = bilinear(image; (X, Y) + motion(X, Y); border), or `fallback`, a number or an image, if invalid."""
    grid, valid = warp_grid(motion)
    warped = sample(image, grid, border)
    return warped if valid is None else torch.where(valid, warped, torch.as_tensor(fallback).to(warped))


class WarpBlocks(torch.autograd.Function):
    """`warp` with border `clamp` by valid motion that is constant on blocks: see `block_patches`.

    All pixels of a block have the same bilinear weights, so that a block is a patch of 9×9 pixels, blended along each
    axis. Training spends much of its time here, and this is several times faster than sampling each pixel.
    """

    @staticmethod
    def forward(ctx, image, index, x, y):
        batch, channels, height, width = image.shape
        rows, columns = x.shape[-2:]
        ctx.save_for_backward(index, x, y)
        ctx.size = (height, width)
        patches = image.flatten(2).gather(2, index.expand(-1, channels, -1))
        patches = patches.view(batch, channels, DILATE_BLOCK + 1, DILATE_BLOCK + 1, rows, columns)
        patches = torch.lerp(patches[:, :, :, :-1], patches[:, :, :, 1:], x)
        patches = torch.lerp(patches[:, :, :-1], patches[:, :, 1:], y)
        whole = patches.permute(0, 1, 4, 2, 5, 3).reshape(batch, channels, DILATE_BLOCK * rows, DILATE_BLOCK * columns)
        return whole[:, :, :height, :width].contiguous()

    @staticmethod
    def backward(ctx, gradient):
        index, x, y = ctx.saved_tensors
        batch, channels, height, width = gradient.shape
        rows, columns = x.shape[-2:]
        gradient = F.pad(gradient, (0, DILATE_BLOCK * columns - width, 0, DILATE_BLOCK * rows - height))
        gradient = gradient.view(batch, channels, rows, DILATE_BLOCK, columns, DILATE_BLOCK)
        patches = gradient.permute(0, 1, 3, 5, 2, 4).contiguous()
        for axis, weight in ((2, y), (3, x)):  # each pixel gives a share to its own tap and a share to the next
            share = patches * weight
            shape = list(patches.shape)
            shape[axis] += 1
            both = patches.new_zeros(shape)
            torch.sub(patches, share, out=both.narrow(axis, 0, DILATE_BLOCK))
            both.narrow(axis, 1, DILATE_BLOCK).add_(share)
            patches = both
        result = gradient.new_zeros(batch, channels, ctx.size[0] * ctx.size[1])
        result.scatter_add_(2, index.expand(-1, channels, -1), patches.flatten(2))
        return result.view(batch, channels, *ctx.size), None, None, None


def block_patches(blocks, size):
    """What `WarpBlocks` takes beside an image of that (height, width), for its blocks' motion [N, 2, rows, columns]:

    where each block's patch is found, [N, 1, 81 · rows · columns], and the weights of its second taps along x and y.
    """
    first = blocks.floor()
    weight = (blocks - first)[:, :, None, None, None]
    tap = torch.arange(DILATE_BLOCK + 1, device=blocks.device)

    def taps(axis, extent):
        start = DILATE_BLOCK * torch.arange(blocks.shape[3 - axis], device=blocks.device)
        start = (start[:, None] if axis else start) + first[:, axis].clamp(-3 * extent, 3 * extent).long()
        return (start[:, None] + tap[:, None, None]).clamp(0, extent - 1)

    index = taps(1, size[0])[:, :, None] * size[1] + taps(0, size[1])[:, None]
    return index.flatten(1)[:, None], weight[:, 0], weight[:, 1]


def space_to_depth(image, scale):
    """Channel c·s² + dy·s + dx of LR (i, j) = channel c of HR (s·i+dx, s·j+dy)."""
    return F.pixel_unshuffle(image, scale)


def depth_to_space(image, scale):
    """The inverse of `space_to_depth`."""
    return F.pixel_shuffle(image, scale)


def sample_position(scale, jitter):
    """q: where in its s×s tile of HR pixels a sample lies."""
    return tuple(min(max(math.floor(scale * (0.5 + j) + 0.001), 0), scale - 1) for j in jitter)


def zero_upsample(image, scale, jitter):
    """HR pixel (s·i + q_x, s·j + q_y) = image(i, j), every other HR pixel 0."""
    batch, channels, height, width = image.shape
    qx, qy = sample_position(scale, jitter)
    apart = F.pad(image[:, :, :, None, :, None], (qx, scale - 1 - qx, 0, 0, qy, scale - 1 - qy))
    return apart.reshape(batch, channels, scale * height, scale * width)


def pick(image, scale, jitter):
    """LR (i, j) = image(s·i + q_x, s·j + q_y)."""
    qx, qy = sample_position(scale, jitter)
    return image[:, :, qy::scale, qx::scale]


def place(image, samples, scale, jitter):
    """A copy of the HR image with the pixels of `pick` replaced by the LR samples."""
    height, width = image.shape[-2:]
    qx, qy = sample_position(scale, jitter)
    column = torch.arange(width, device=image.device) % scale == qx
    row = torch.arange(height, device=image.device) % scale == qy
    return torch.where(row[:, None] & column, tiles(samples, scale), image)


def srgb_decode(image):
    """Linear light of display-encoded values, clamped to [0, 1]."""
    image = image.clamp(0, 1)
    return torch.where(image <= 0.04045, image / 12.92, ((image + 0.055) / 1.055) ** 2.4)


def srgb_encode(image):
    """The inverse of `srgb_decode`."""
    curve = 1.055 * image.clamp(min=0.0031308) ** (1 / 2.4) - 0.055
    return torch.where(image < 0.0031308, 12.92 * image, curve)


def ycbcr(image):
    """Full range, BT.601 luma."""
    red, green, blue = image.unbind(dim=1)
    luma = 0.299 * red + 0.587 * green + 0.114 * blue
    return torch.stack((luma, 0.5 + (blue - luma) / 1.772, 0.5 + (red - luma) / 1.402), dim=1)


def rgb(image):
    """The exact inverse of `ycbcr`."""
    luma, cb, cr = image.unbind(dim=1)
    red, blue = luma + 1.402 * (cr - 0.5), luma + 1.772 * (cb - 0.5)
    return torch.stack((red, (luma - 0.299 * red - 0.114 * blue) / 0.587, blue), dim=1)


def halton_jitter(count=16):
    """The Halton (2, 3) jitters of one period, a list of (jx, jy)."""

    def radical_inverse(k, base):
        value, digit = 0.0, 1.0 / base
        while k:
            value += (k % base) * digit
            k, digit = k // base, digit / base
        return value

    return [(radical_inverse(k, 2) - 0.5, radical_inverse(k, 3) - 0.5) for k in range(1, count + 1)]
