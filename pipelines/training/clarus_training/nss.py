"""Arm's Neural Super Sampling v1, quality `high`, as docs/nss.md has it."""

import math
import warnings
from fractions import Fraction

import numpy as np
import torch
from torch import nn
import torch.nn.functional as F

from . import losses, operators
from .model_file import rounding

warnings.filterwarnings("ignore", message="scatter_reduce")  # beta in PyTorch 1.13

CLIPS = [8]
RATE = 1e-3

LARGEST_SCALE = 3
LEAST = 1e-7
HALF_MAX = 65504.0
STILL = 0.1  # pixels: shorter vectors count as none
DISOCCLUDED = 0.01
HALF_FOV = math.tan(math.radians(30))  # of the camera, vertically: frames do not say
PADDED_TO = 8
WINDOW = range(-2, 4)  # HR pixels around one whose samples a kernel may weigh
TAPS = 9  # of them that it does weigh
PART_OF = (540, 960)  # the frames that training's crops are taken for parts of
PERCEPTUAL = 0.157  # the loss's weight of that term
# Pixels around one of which the nearest to the viewer gives its motion, (row, column): the first of equals.
AROUND = [(0, 0), (1, 0), (0, 1), (0, -1), (-1, 0), (-1, 1), (1, 1), (-1, -1), (1, -1), (-1, 2), (0, 2), (1, 2)]
AROUND += [(2, 2), (2, 1), (2, 0), (2, -1)]


class Layer(nn.Module):
    """A 3×3 convolution under the name that published files have for it."""

    def __init__(self, inputs, outputs, stride=1):
        super().__init__()
        self.conv2d = nn.Conv2d(inputs, outputs, 3, stride, 1)

    def forward(self, x):
        return self.conv2d(x)


class Autoencoder(nn.Module):
    """[N, 12, h, w], sides multiples of 8, to kernels [N, 36, h/4, w/4] and temporal parameters [N, 4, h, w]."""

    def __init__(self):
        super().__init__()
        widths = [(12, 32, 2), (32, 32), (32, 32, 2), (32, 32), (32, 64, 2), (64, 64), (64, 32)]
        widths += [(32, 16), (48, 32), (32, 16), (48, 16), (16, 16)]
        for i, width in enumerate(widths):
            setattr(self, f"conv2d_{i}", Layer(*width))
        self.kpn_params = Layer(32, len(WINDOW) ** 2)
        self.temporal_params_out_conv = Layer(16, 4)

    def forward(self, x):
        def layers(x, *indices):
            for i in indices:
                x = F.relu(getattr(self, f"conv2d_{i}")(x))
            return x

        half = layers(x, 0, 1)
        quarter = layers(half, 2, 3)
        x = layers(quarter, 4, 5, 6)
        x = layers(torch.cat((layers(operators.tiles(x, 2), 7), quarter), dim=1), 8)
        kernels = torch.sigmoid(self.kpn_params(x))
        x = layers(torch.cat((layers(operators.tiles(x, 2), 9), half), dim=1), 10, 11)
        return kernels, torch.sigmoid(self.temporal_params_out_conv(operators.tiles(x, 2)))


class Nss(nn.Module):
    """The network and what surrounds it.

    `scale` is any real number from 1 to 3; of a network for "any" it is whatever is asked of it next. `white` is the
    radiance of display white; infinite where colours are tone-mapped radiance, as in linear sequences. The state is (history, temporal, derivative): the previous output as
    radiance [N, 3, H, W], the network's temporal parameters [N, 4, h, w], padded, and what flicker is found by
    [N, 4, h, w].
    """

    pipeline = "nss"

    def __init__(self, scale, white=1.0):
        super().__init__()
        self.any_scale = scale == "any"
        self.scale, self.white = None if self.any_scale else scale, white
        self.part_of = None  # what depths are compared for: the frames' own size, unless they are crops
        self.autoencoder = Autoencoder()

    def ahead(self, frames):
        return [None] * len(frames)

    def output_size(self, height, width):
        return tuple(math.floor(side * self.scale + 0.5) for side in (height, width))

    def step(self, frame, state=None, ahead=None, inside=None):
        color = radiance(frame.color, self.white)
        size = self.output_size(*color.shape[-2:])
        motion = torch.full_like(frame.motion, float("nan")) if state is None else frame.motion
        state = state or empty_state(color, size)
        guide = Guide(frame.depth, motion, self.part_of)
        seen, derivative = preprocess(color, guide, frame.jitter, *state)
        kernels, temporal = (each.to(color.dtype) for each in self.autoencoder(seen))
        output, found = postprocess(color, state[0], kernels, temporal, guide.motion, frame.jitter, size)
        if inside is not None:
            height, width = color.shape[-2:]
            instability = seen[:, 11:, :height, :width]
            inside.update(found, disocclusion=guide.disocclusion, instability=instability, temporal=temporal)
        return display(output, self.white), (output, temporal, derivative)


def radiance(color, white):
    """Radiance of display-encoded colours."""
    linear = operators.srgb_decode(color)
    peak = linear.amax(dim=1, keepdim=True).clamp(max=HALF_MAX / (1 + HALF_MAX))
    return linear / (1 - (1 - 1 / white) * peak)


def display(color, white):
    """The inverse of `radiance`."""
    return operators.srgb_encode((color / (1 + (1 - 1 / white) * color.amax(dim=1, keepdim=True))).clamp(0, 1))


def karis(color):
    color = color.clamp(min=0)
    return (color / (1 + color.amax(dim=1, keepdim=True))).clamp(max=1)


def karis_inverse(color):
    color = color.clamp(0, min(1 - LEAST, HALF_MAX / (1 + HALF_MAX)))
    return color / (1 - color.amax(dim=1, keepdim=True))


def padded(side):
    return (side + PADDED_TO - 1) // PADDED_TO * PADDED_TO


def empty_state(color, size):
    batch, _, height, width = color.shape
    shapes = (3, *size), (4, padded(height), padded(width)), (4, height, width)
    return tuple(color.new_zeros(batch, *shape) for shape in shapes)


class Guide:
    """What a frame's depth and motion say: `motion` [N, 2, h, w], that of the nearest pixel around each, from the

    previous frame in pixels, with NaN where invalid, and the `disocclusion` of that pixel [N, 1, h, w]. `part_of` is the
    size of the frame of which a crop is given.
    """

    @torch.no_grad()
    def __init__(self, depth, motion, part_of=None):
        batch, _, height, width = depth.shape
        rows = torch.arange(height, device=depth.device)[:, None]
        columns = torch.arange(width, device=depth.device)
        around, places = [], []
        beyond = F.pad(depth, (1, 2, 1, 2), value=float("inf"))
        for row, column in AROUND:
            around.append(beyond[:, 0, 1 + row : 1 + row + height, 1 + column : 1 + column + width])
            places.append((rows + row) * width + columns + column)
        nearest = torch.stack(around).argmin(dim=0)
        place = torch.stack(places).view(len(AROUND), -1).gather(0, nearest.view(batch, -1))
        self.motion = -motion.flatten(2).gather(2, place[:, None].expand(-1, 2, -1)).view_as(motion)
        vectors, valid = moving(self.motion)
        self.vectors = vectors
        foremost = torch.stack(around).amin(dim=0)[:, None]
        clip = disocclusion(scatter_depth(depth, -motion), foremost, vectors, part_of or (height, width))
        self.disocclusion = torch.where(valid, clip, torch.ones_like(clip))


def moving(motion):
    """Vectors with those that are invalid or too short made 0, and which are valid [N, 1, h, w]."""
    valid = torch.isfinite(motion).all(dim=1, keepdim=True)
    vectors = motion.masked_fill(~valid, 0)
    return vectors * (vectors.square().sum(dim=1, keepdim=True) > STILL * STILL), valid


def corners(y, x, height, width):
    """Pixels around index coordinates [N, h, w]: place in the flattened image, weight, and whether it is inside."""
    top, left = y.floor(), x.floor()
    down, right = y - top, x - left
    for row, column, weight in (
        (top, left, (1 - down) * (1 - right)),
        (top + 1, left, down * (1 - right)),
        (top, left + 1, (1 - down) * right),
        (top + 1, left + 1, down * right),
    ):
        inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        place = row.clamp(0, height - 1).long() * width + column.clamp(0, width - 1).long()
        yield place, weight, inside


def scatter_depth(depth, motion):
    """Depth in the previous frame at half the resolution [N, 1, h/2, w/2], 1 where none lands."""
    batch, _, height, width = depth.shape
    rows, columns = max(1, height // 2), max(1, width // 2)

    def pair(count, side):
        first = ((2 * torch.arange(count, device=depth.device) + 1) * side - count) // (2 * count)
        return first.clamp(0, side - 1), (first + 1).clamp(0, side - 1)

    quad = [y[:, None] * width + x for y in pair(rows, height) for x in pair(columns, width)][::-1]
    quads = torch.stack(quad).view(4, -1)
    depths = depth.flatten(1)[:, quads]
    nearest = depths.argmin(dim=1)
    place = quads.gather(0, nearest)
    value = depth.flatten(1).gather(1, place)
    size = torch.tensor((columns / width, rows / height), dtype=depth.dtype, device=depth.device)[:, None]
    vectors, valid = moving((motion.flatten(2).gather(2, place[:, None].expand(-1, 2, -1)) * size)[..., None])
    vectors, valid = vectors[..., 0].view(batch, 2, rows, columns), valid.view(batch, -1)
    y = torch.arange(rows, dtype=depth.dtype, device=depth.device)[:, None] - vectors[:, 1]
    x = torch.arange(columns, dtype=depth.dtype, device=depth.device) - vectors[:, 0]
    found = torch.ones_like(value)
    for place, weight, inside in corners(y, x, rows, columns):
        lands = inside.flatten(1) & (weight.flatten(1) > 0.1) & valid
        found.scatter_reduce_(1, place.flatten(1), torch.where(lands, value, torch.ones_like(value)), "amin")
    return found.view(batch, 1, rows, columns)


def depth_tolerance(height, width):
    """Of view depth: how far apart, relative to the farther, surfaces of a neighbourhood may be; and the exponent."""
    tangents = HALF_FOV * width / height, HALF_FOV
    middle = [2 * (side // 2) / side - 1 for side in (height, width)]
    field = math.hypot(1, *tangents) / math.hypot(1, *(t * m for t, m in zip(tangents, middle)))
    diagonal = math.hypot(height, width)
    return 1.37e-5 * field * diagonal, 1 + 2 * min(1, diagonal / math.hypot(1080, 1920))


def disocclusion(before, depth, vectors, frame_size):
    """How far each pixel, at the nearest depth around it, was behind what stood there, from 0 to 1 [N, 1, h, w]."""
    height, width = depth.shape[-2:]
    rows, columns = before.shape[-2:]
    y = torch.arange(height, device=depth.device)[:, None] // 2 - vectors[:, 1] * (rows / height)
    x = torch.arange(width, device=depth.device) // 2 - vectors[:, 0] * (columns / width)
    tolerance, exponent = depth_tolerance(*frame_size)
    kept, weights = 0, 0
    for place, weight, inside in corners(y, x, rows, columns):
        then = before.flatten(1).gather(1, place.flatten(1)).view_as(weight)
        behind = depth[:, 0] - then
        counts = inside & (weight > 0.1) & (behind > 0)
        share = tolerance * torch.maximum(depth[:, 0], then) / torch.where(counts, behind, torch.ones_like(behind))
        kept = kept + torch.where(counts, share.clamp(0, 1) ** exponent * weight, torch.zeros_like(weight))
        weights = weights + torch.where(counts | ~inside, weight, torch.zeros_like(weight))
    mask = (1 - kept / weights.clamp(min=1e-30)).clamp(0, 1)
    return torch.where(weights > 0, mask, torch.zeros_like(mask))[:, None]


def grids(vectors, from_size, to_size, shift=(0.0, 0.0)):
    """Where pixels of `from_size`, less their vectors (in pixels), lie in an image of `to_size`, as `sample` has it."""
    rows, columns = (
        (torch.arange(side, dtype=vectors.dtype, device=vectors.device) + 0.5 - offset)
        for side, offset in zip(from_size, reversed(shift))
    )
    y = (rows[:, None] - vectors[:, 1]) * (to_size[0] / from_size[0]) - 0.5
    x = (columns - vectors[:, 0]) * (to_size[1] / from_size[1]) - 0.5
    return operators.grid_at(x, y, to_size)


def reflected(count, side, device):
    index = torch.arange(count, device=device)
    return torch.where(index < side, index, (2 * side - 1 - index).clamp(min=0))


def preprocess(color, guide, jitter, history, temporal, derivative):
    """The network's input [N, 12, h, w], padded; the next derivative state."""
    batch, _, *size = color.shape
    with torch.no_grad():
        valid = torch.isfinite(guide.motion).all(dim=1, keepdim=True)
        vectors = guide.vectors
        still = color.new_zeros(batch, 2, *size)
        current = karis(operators.sample(color, grids(still, size, size, jitter)))
        before = operators.sample(derivative, grids(vectors, size, size), "zero") * valid
        derivative, instability = flicker(color, before, guide.disocclusion)
        least, most = (math.hypot(n / size[0], n / size[1]) for n in (1, 200))
        length = torch.hypot(vectors[:, :1] / size[1], vectors[:, 1:] / size[0])
        moves = ((length.clamp(least, most) - least) / (most - least)).sqrt()
    warped = karis(operators.sample(history, grids(vectors, size, history.shape[-2:]), "zero") * valid)
    rows, columns = (reflected(padded(side), side, color.device) for side in size)

    def pad(image):
        return image[:, :, rows][:, :, :, columns]

    wide = temporal.shape[-2:]
    fed_back = operators.sample(temporal, grids(pad(vectors), wide, wide), "zero")
    fed_back = fed_back * pad(valid & (guide.disocclusion <= DISOCCLUDED))
    seen = torch.cat((pad(torch.cat((warped, current, moves), dim=1)), fed_back, pad(instability)), dim=1)
    return seen, derivative


def ramp(value, low, high):
    return ((value - low) / (high - low)).clamp(0, 1)


def flicker(color, before, disocclusion):
    """The derivative state [N, 4, h, w], and how unsteady pixels look to the network [N, 1, h, w].

    A state holds a colour in YCoCg and how unsteady it is; `before` is the reprojected one.
    """
    red, green, blue = color.clamp(min=0).sqrt().unbind(dim=1)
    orange = red - blue
    middle = blue + orange / 2
    ycocg = torch.stack((middle + (green - middle) / 2, orange, green - middle), dim=1)
    weight = color.new_tensor((1, 1.25, 1.25))[:, None, None]

    def distance(other):
        return ((ycocg - other) * weight).square().sum(dim=1, keepdim=True).sqrt()

    beside = F.pad(ycocg, (1, 1, 1, 1), mode="replicate")
    spatial = [distance(beside[:, :, 1 + y : 1 + y + color.shape[2], 1 + x : 1 + x + color.shape[3]])
               for y, x in ((-1, 0), (1, 0), (0, 1), (0, -1))]  # fmt: skip
    spatial = torch.stack(spatial)
    support = (spatial.sum(dim=0) - spatial.amax(dim=0)).clamp(min=0) / 3
    was = before[:, 3:]
    supported = 0.75 * torch.lerp(distance(before[:, :3]), support, 0.3)

    recall, mean = ramp(supported, 0.065, 0.42), ramp(supported, 0.07, 0.23)
    entry = recall.sqrt() * ramp((supported - was).clamp(min=0), 0.025, 0.16).sqrt() * mean
    heat = ramp(was, 0.11, 0.21)
    sustained = torch.lerp(was, supported, 0.3)
    low, high = 0.177 + heat * (0.157 - 0.177), 0.33 + heat * (0.305 - 0.33)
    sustain = ramp(sustained, low, high) ** 2
    carry = torch.maximum(sustain, 0.12 * ramp(was, 0.18, 0.28) ** 2)
    aim = torch.maximum(entry, 0.8 * was * carry)

    decay = torch.maximum(sustain, 0.5 * heat**2)
    rise, fall = 0.08 + (recall * mean).sqrt() * (0.22 - 0.08), 0.24 + decay * (0.05 - 0.24)
    filtered = was + (aim - was) * torch.where(aim > was, rise, fall)
    share = torch.where(filtered > was, torch.full_like(was, 0.75), torch.full_like(was, 0.8))
    visible = was + (filtered - was) * share
    known = (disocclusion <= DISOCCLUDED) & (before.abs().sum(dim=1, keepdim=True) >= 1e-4)
    return torch.cat((ycocg, filtered * known), dim=1), visible * known


def sample_cells(low, high, jitter):
    """For the HR pixels of a period along an axis: the LR pixel whose sample lies there, and whether there is one."""
    ratio = Fraction(low, high)
    samples, cells = ratio.numerator, ratio.denominator
    sample, known = np.zeros(cells, np.int64), np.zeros(cells, bool)
    scale = np.float32(high) / np.float32(low)
    for i in range(samples):
        cell = math.floor((np.float32(i) + np.float32(jitter) + np.float32(0.5)) * scale)
        if 0 <= cell < cells:
            sample[cell], known[cell] = i, True
    return sample, known, samples, cells


def kernel_taps(low, high, jitter, device="cpu"):
    """What HR pixels weigh: of TAPS samples the LR pixel, the kernel's channel, and whether there are so many,

    [TAPS, H, W] each; and the LR pixel that the frame shows there, with whether it does, [H, W] each. That is the
    sample in the HR pixel, where there is one; where there are fewer than TAPS around, the LR pixel under it.
    """
    (sample_y, known_y, count_y, cells_y), (sample_x, known_x, count_x, cells_x) = (
        sample_cells(*each) for each in zip(low, high, reversed(jitter))
    )
    offsets = np.array([(dy, dx) for dx in WINDOW for dy in WINDOW])  # numbered column by column
    order = np.lexsort((np.arange(len(offsets)), (offsets**2).sum(axis=1)))
    cell_y = np.arange(cells_y)[:, None] + offsets[order, 0]
    cell_x = np.arange(cells_x)[:, None] + offsets[order, 1]
    known = known_y[cell_y % cells_y][:, None] & known_x[cell_x % cells_x][None]
    first = np.argsort(~known, axis=-1, kind="stable")[:, :, :TAPS]
    known = np.take_along_axis(known, first, axis=-1)
    y, x = np.arange(high[0])[:, None], np.arange(high[1])
    phase = (y % cells_y, x % cells_x)
    channel, known = order[first][phase], known[phase]
    cell_y, cell_x = y[..., None] + offsets[channel, 0], x[..., None] + offsets[channel, 1]
    row = np.clip(cell_y // cells_y * count_y + sample_y[cell_y % cells_y], 0, low[0] - 1)
    column = np.clip(cell_x // cells_x * count_x + sample_x[cell_x % cells_x], 0, low[1] - 1)
    place = row * low[1] + column
    few = ~known[..., -1]
    under = (2 * y + 1) * low[0] // (2 * high[0]) * low[1] + (2 * x + 1) * low[1] // (2 * high[1])
    shown = np.where(few, under, place[..., 0])
    shows = few | (channel[..., 0] == order[0])
    taps = [np.moveaxis(each, -1, 0).copy() for each in (place, channel, known)]
    return [torch.from_numpy(each).to(device) for each in (*taps, shown, shows)]


def moments(color, kernels, taps):
    """Weighted mean and mean square of the samples around HR pixels, and what the frame shows at each."""
    place, channel, known, shown, _ = taps
    batch, _, _, width = color.shape
    coarse_height, coarse_width = kernels.shape[-2:]
    row = place.div(4 * width, rounding_mode="floor")
    column = (place % width).div(4, rounding_mode="floor")
    chosen = ((channel * coarse_height + row) * coarse_width + column).flatten()
    weights = kernels.flatten(1)[:, chosen].view(batch, 1, *place.shape).clamp(min=LEAST) * known
    total = weights.sum(dim=2).clamp(min=LEAST)
    flat = color.flatten(2)
    colors = flat[:, :, place.flatten()].view(batch, 3, *place.shape)
    mean = (weights * colors).sum(dim=2) / total
    return mean, (weights * colors * colors).sum(dim=2) / total, flat[:, :, shown.flatten()].view_as(mean)


def catmull_rom(image, y, x):
    """Five bilinear taps in place of a Catmull-Rom filter's sixteen pixels; no negative values of its ringing."""
    size = image.shape[-2:]

    def axis(u):
        first = u.floor()
        f = u - first
        squared = f * f
        cubed = squared * f
        w0, w3 = squared - (cubed + f) / 2, (cubed - squared) / 2
        w1 = 1.5 * cubed - 2.5 * squared + 1
        w2 = 1 - w0 - w1 - w3
        return (first - 1, first + w2 / (w1 + w2), first + 2), (w0, w1 + w2, w3)

    (top, middle, bottom), (up, across, down) = axis(y)
    (left, center, right), (before, along, after) = axis(x)
    taps = [
        (operators.sample(image, operators.grid_at(u, v, size)), weight[:, None])
        for u, v, weight in (
            (center, top, along * up),
            (left, middle, before * across),
            (center, middle, along * across),
            (right, middle, after * across),
            (center, bottom, along * down),
        )
    ]
    colors = torch.stack([color for color, _ in taps])
    result = sum(color * weight for color, weight in taps) / sum(weight for _, weight in taps)
    negative = (result < 0).any(dim=1, keepdim=True)
    return torch.where(negative, result.maximum(colors.amin(dim=0)).minimum(colors.amax(dim=0)), result)


def under(low, high):
    """The LR pixel whose vector each HR pixel along an axis takes, in single precision, which decides at their edges."""
    inverse = np.float32(1) / (np.float32(high) / np.float32(low))
    return np.minimum((np.arange(high, dtype=np.float32) * inverse).astype(np.int64), low - 1)


def postprocess(color, history, kernels, temporal, motion, jitter, size):
    """The frame's output as radiance, and what training looks at: `filtered`, `theta`, `hr_motion` as Frame's motion."""
    batch, _, height, width = color.shape
    taps = kernel_taps((height, width), size, jitter, color.device)
    mean, mean_square, shown = moments(color, kernels, taps)

    still = color.new_zeros(batch, 2, *size)
    grid = grids(still, size, (height, width))  # of the unpadded image
    scale = color.new_tensor((width / temporal.shape[3], height / temporal.shape[2]))
    parameters = operators.sample(temporal[:, :3], (grid + 1) * scale - 1)
    theta, alpha, gamma = parameters[:, :1], 0.05 + 0.35 * parameters[:, 1:2], 2 * parameters[:, 2:]
    squares = theta * theta, (1 - theta) * (1 - theta)
    theta = squares[0] / (squares[0] + squares[1]).clamp(min=1e-6)

    rows, columns = (
        torch.from_numpy(under(*each)).to(color.device) for each in zip((height, width), size)
    )
    stretch = color.new_tensor((size[1] / width, size[0] / height))[:, None, None]
    motion = motion[:, :, rows][:, :, :, columns] * stretch
    vectors, valid = moving(motion)
    y = torch.arange(size[0], dtype=color.dtype, device=color.device)[:, None] - vectors[:, 1]
    x = torch.arange(size[1], dtype=color.dtype, device=color.device) - vectors[:, 0]
    onscreen = (y >= -0.5) & (y <= size[0] - 0.5) & (x >= -0.5) & (x <= size[1] - 0.5)
    warped = catmull_rom(history, y, x).clamp(max=HALF_MAX)

    spread = gamma * (mean_square - mean * mean).abs().clamp(min=LEAST).sqrt()
    clamped = warped.maximum(mean - spread).minimum(mean + spread)
    rectified = torch.lerp(clamped, warped, theta * onscreen[:, None])
    alpha = alpha * taps[4]
    accumulated = torch.lerp(karis(torch.where(valid, rectified, mean)), karis(shown), alpha * valid)
    return karis_inverse(accumulated), dict(filtered=mean, theta=theta, hr_motion=-motion)


def serves(asked, scale):
    return scale <= LARGEST_SCALE if asked == "any" else scale == asked


def shape(arguments):
    return dict(scale=arguments.scale)


def create(scale, white=1.0):
    """A network to be trained; its kernels start as Gaussians of the distance."""
    network = Nss(scale, white)
    distance = torch.tensor([dy * dy + dx * dx for dx in WINDOW for dy in WINDOW], dtype=torch.float32)
    weights = torch.exp(-distance / 2).clamp(1e-3, 0.95)
    layer = network.autoencoder.kpn_params.conv2d
    with torch.no_grad():
        layer.weight.mul_(0.1)
        layer.bias.copy_(torch.logit(weights))
    return network


def parameter_groups(network, arguments):
    return [{"params": list(network.parameters())}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """The gym's, of display values, with 1 − SSIM in place of its perceptual term, whose weights are not part of this
    project; or a criterion of the outputs. To either is added a tenth of the error of the frames' own reconstructions.
    """
    if network.any_scale:
        network.scale = reference.shape[-1] / frames[0].color.shape[-1]
    outputs, inside, state = [], [], None
    network.part_of = PART_OF
    for frame in frames:
        inside.append({})
        output, state = network.step(frame, state, inside=inside[-1])
        outputs.append(output)
    network.part_of = None
    alone = [F.l1_loss(display(each["filtered"], network.white), r) for each, r in zip(inside, reference)]
    if criterion is not None or len(frames) == 1:
        total = (criterion or F.l1_loss)(torch.stack(outputs), reference)
    else:
        total = recurrent_loss(outputs, reference, inside) + 0.5 * alone[0]
    return total + 0.1 * sum(alone) / len(frames)


def recurrent_loss(outputs, reference, inside):
    """The mean of the frames after the first.

    The longer a clip has run, the more the error counts and the less what it changes by from frame to frame. What the
    reference keeps is to be kept, and the history to be believed wherever something was seen before.
    """
    total, last = 0, len(outputs) - 1
    for t in range(1, last + 1):
        output, wanted = outputs[t], reference[t]
        warped, wanted_warped = (
            operators.warp(image, inside[t]["hr_motion"], "zero", 0.0) for image in (outputs[t - 1], reference[t - 1])
        )
        change = ((output - warped) - (wanted - wanted_warped)).abs()
        share = 0.9 - 0.4 * (1 + math.cos(math.pi * t / last))
        error = F.l1_loss(output, wanted) + PERCEPTUAL * losses.ssim(output, wanted)
        total = total + share * error + (1 - share) * (torch.exp(4 * change).mean() - 1)
        kept = torch.exp(-(wanted - warped).abs() / 0.06).detach()
        total = total + 0.7 * ((kept * (output - warped)) ** 2 + 1e-6).sqrt().mean()
        known = (inside[t]["disocclusion"] <= DISOCCLUDED).to(output.dtype)
        believed = inside[t]["temporal"][:, :1, : known.shape[2], : known.shape[3]]
        total = total + 0.02 * ((believed - 1) ** 2 * known).sum() / known.sum().clamp(min=1)
    return total / last


def model_tensors(network, jitters=None, mlp=False, half=False):
    array = rounding(half)
    tensors = {name: array(tensor) for name, tensor in network.state_dict().items()}
    scale = "any" if network.any_scale else f"{network.scale:g}"
    return tensors, {"pipeline": "nss", "scale": scale, "white": f"{network.white:g}"}


def load_model(tensors, metadata):
    scale = metadata["scale"]
    network = Nss(scale if scale == "any" else float(scale), float(metadata.get("white", "inf")))
    network.load_state_dict(tensors)
    return network
