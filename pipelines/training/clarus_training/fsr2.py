"""The filter `fsr2`, as docs/fsr2.md has it, on batches [N, C, H, W]: what a frame and the history before it come to.

A scale is any real one from 1. `jitter` is a pair of floats shared by the batch.
"""

import torch
import torch.nn.functional as F

from . import history, operators

MOST, MOST_MOVING = 12.0, 0.6  # weight of a history that stands still, and of one that moves by an output pixel or more
SHARP, SOFT, SHARE, DOUBTED_SHARE = 3.0, 5.0, 0.003, 0.1
LOOSE, TIGHT = 20.0, 1.0
EXCESS = 1e-3
NOISE = 8e-5
APART, APART_SHARE, APART_RANGE, APART_COST = 0.1, 0.2, 0.4, 0.8


def ycocg(image):
    red, green, blue = image.unbind(dim=1)
    return torch.stack(((red + blue) / 4 + green / 2, (red - blue) / 2, green / 2 - (red + blue) / 4), dim=1)


def from_ycocg(image):
    luma, orange, green = image.unbind(dim=1)
    return torch.stack((luma + orange - green, luma + green, luma - orange - green), dim=1)


def warp_sharply(image, motion, color, scale, jitter):
    """A history's colour and weight where motion leads; the upsampled colour, of no weight, where it is invalid."""
    valid = history.is_valid(motion)
    vectors = motion.masked_fill(~valid, 0)
    height, width = image.shape[-2:]
    x = torch.arange(width, device=image.device) + vectors[:, 0]
    y = torch.arange(height, device=image.device)[:, None] + vectors[:, 1]
    # Farther out every tap is of the border.
    x, y = x.clamp(-4, width + 3), y.clamp(-4, height + 3)
    first_x, first_y = x.floor(), y.floor()

    def cubic(f):
        squared, cubed = f * f, f * f * f
        return (-cubed + 2 * squared - f) / 2, (3 * cubed - 5 * squared + 2) / 2, (-3 * cubed + 4 * squared + f) / 2, (
            cubed - squared
        ) / 2

    along_x, along_y = cubic(x - first_x), cubic(y - first_y)
    columns = [(first_x.long() + i).clamp(0, width - 1) for i in range(-1, 3)]
    rows = [(first_y.long() + i).clamp(0, height - 1) * width for i in range(-1, 3)]
    flat = image[:, :3].flatten(2)
    total, sums = 0, 0
    for j in range(4):
        for i in range(4):
            if i in (0, 3) and j in (0, 3):
                continue
            weight = (along_x[i] * along_y[j])[:, None]
            index = (rows[j] + columns[i]).flatten(1)[:, None].expand(-1, 3, -1)
            sums = sums + weight * flat.gather(2, index).view(-1, 3, height, width)
            total = total + weight
    weight = operators.bilinear(image[:, 3:], x, y)
    fresh = torch.cat((history.upsample(color, scale, jitter), torch.zeros_like(weight)), dim=1)
    return torch.where(valid, torch.cat(((sums / total).clamp(0, 1), weight), dim=1), fresh)


def residual(color, past, jitter):
    """What the frame's samples say that the history around them does not, in YCoCg, at render resolution."""
    (height, width), size = color.shape[-2:], past.shape[-2:]
    u = (torch.arange(width).to(color) + 0.5 + jitter[0]) * (size[1] / width) - 0.5
    v = (torch.arange(height).to(color) + 0.5 + jitter[1]) * (size[0] / height) - 0.5
    shape = (len(color), height, width)
    return ycocg(color) - ycocg(operators.bilinear(past[:, :3], u.expand(shape), v[:, None].expand(shape)))


def windows(image, radius):
    """[N, (2 radius + 1)², C, h, w], border clamp."""
    height, width = image.shape[-2:]
    padded = F.pad(image, (radius,) * 4, mode="replicate")
    span = range(2 * radius + 1)
    return torch.stack([padded[..., j : j + height, i : i + width] for j in span for i in span], dim=1)


def doubt(difference, radius, tolerance):
    around = windows(difference, radius)
    mean = around.mean(dim=1)
    variance = ((around * around).mean(dim=1) - mean * mean).clamp(min=0).sum(dim=1, keepdim=True)
    count = around.shape[1]
    return (mean * mean).sum(dim=1, keepdim=True) / ((variance / count + NOISE) * tolerance**2)


def trust(difference, motion, scale):
    """How far the history around each sample is to be believed, from 0 to 1, by `residual` and checked motion."""
    valid = history.is_valid(motion)
    vectors = motion.masked_fill(~valid, 0)
    length = vectors.square().sum(dim=1, keepdim=True).sqrt()
    still = (1 - 4 * scale * length).clamp(min=0)
    z = (1 - still) * doubt(difference, 1, 3) + still * doubt(difference, 2, 5)
    most, least = F.max_pool2d(vectors, 3, 1, 1), -F.max_pool2d(-vectors, 3, 1, 1)
    span = (most - least).amax(dim=1, keepdim=True)
    apart = ((span - APART - APART_SHARE * length) / APART_RANGE).clamp(0, 1)
    apart = torch.where(-F.max_pool2d(-valid.to(apart), 3, 1, 1) > 0, apart, torch.ones_like(apart))
    return (1 - APART_COST * apart) / (1 + z**3)


def collect(color, past, believed, motion, scale, jitter):
    """The new history, [N, 4, H, W]: colour and weight."""
    size = past.shape[-2:]
    height, width = color.shape[-2:]
    u, v = history.output_coordinates(color, scale, size, jitter)
    u, v = u[0, 0, 0], v[0, 0, :, 0]
    columns, rows = history.nearest_index(u, width), history.nearest_index(v, height)

    def weights(nearest, place):
        offset = torch.arange(-1, 2, device=color.device)[:, None] + nearest - place
        squared = offset * offset
        return torch.exp2((-SHARP * scale * scale * squared).clamp(min=-60)), torch.exp2((-SOFT * squared).clamp(min=-60))

    (hard_x, soft_x), (hard_y, soft_y) = weights(columns, u), weights(rows, v)
    samples = windows(ycocg(color), 1)
    mean = samples.mean(dim=1)
    deviation = ((samples * samples).mean(dim=1) - mean * mean).clamp(min=0).sqrt()

    def spread(image):
        return image[..., rows, :][..., columns]

    believed, mean = spread(believed), spread(mean)
    share = SHARE + DOUBTED_SHARE * (1 - believed)
    weight, soft_weight, fresh, first = 0, 0, 0, 0
    for k in range(9):
        j, i = divmod(k, 3)
        soft = soft_y[j][:, None] * soft_x[i]
        both = hard_y[j][:, None] * hard_x[i] + share * soft
        sample = spread(samples[:, k])
        weight, soft_weight = weight + both, soft_weight + soft
        fresh, first = fresh + both * sample, first + soft * sample
    fresh, first = fresh / weight, first / soft_weight
    before, kept = ycocg(past[:, :3]), past[:, 3:]
    reach = (TIGHT + (LOOSE - TIGHT) * believed) * spread(deviation)
    confined = torch.minimum(torch.maximum(before, mean - reach), mean + reach)
    moved = (confined - before).square().sum(dim=1, keepdim=True)
    room = EXCESS + reach.square().sum(dim=1, keepdim=True)
    speed = motion.masked_fill(~history.is_valid(motion), 0).square().sum(dim=1, keepdim=True).sqrt().clamp(max=1)
    known = kept > 0
    kept = torch.minimum(believed * kept, MOST + (MOST_MOVING - MOST) * speed) * room / (room + moved)
    total = kept + weight
    shown = torch.where(known, confined + (fresh - confined) * (weight / total), first)
    total = torch.where(known, total.clamp(max=MOST), weight.expand_as(total))
    return torch.cat((from_ycocg(shown).clamp(0, 1), total), dim=1)


def step(frame, before, scale):
    """The history after a frame, and the trust [N, 1, h, w] that it was believed by; `before` is None at a reset."""
    motion, checked = history.followed(frame, scale)
    if before is None:
        motion, checked = torch.full_like(motion, float("nan")), torch.full_like(checked, float("nan"))
        before = motion.new_zeros(len(motion), 4, *motion.shape[-2:])
    past = warp_sharply(before, motion, frame.color, scale, frame.jitter)
    believed = trust(residual(frame.color, past, frame.jitter), checked, scale)
    return collect(frame.color, past, believed, motion, scale, frame.jitter), believed
