"""History that is checked, and range that is held: docs/history.md, on batches [N, C, H, W].

`jitter` is a pair of floats shared by the batch, or a tensor [N, 2] with a pair for each image.
"""

from typing import NamedTuple, Optional

import torch
import torch.nn.functional as F

from . import operators

OPTIONS = {"history": ("plain", "checked"), "range": ("unit", "held")}
SPLAT = 0.1  # the least bilinear weight with which a pixel's depth reaches one of the previous frame
NEARER = 0.02  # of the depth: what is nearer by more has hidden a surface, also where it does not slope
DEPTH_STEP = 2.0**-16  # of a 16-bit depth
AREAS = 0.25, 4.0  # by which a surface's picture shrinks from this frame to the previous one, at the least and the most
SILHOUETTE_DEPTH = 0.1  # of the smallest depth
SILHOUETTE_MOTION = 0.25  # render pixels
NEAR = 2  # pixels around one that may be of its surface, where vectors draw it together
ALONG = 0.25  # render pixels by which vectors differ that still move along
ALLOWED = 2 / 255  # outside the range of what is around
COUNTED = 1e-3  # the least weight along an axis of a tap that counts


def options_of(metadata):
    """What a model file asks for, as keywords of a network: `checked`, `held`."""
    for key, values in OPTIONS.items():
        if metadata.get(key, values[0]) not in values:
            raise SystemExit(f"metadata {key} is {metadata[key]}; known: {', '.join(values)}")
    return dict(checked=metadata.get("history") == "checked", held=metadata.get("range") == "held")


def metadata_of(network):
    """The inverse: nothing for a network that is as published."""
    facts = {"history": "checked"} if network.checked else {}
    return {**facts, **({"range": "held"} if network.held else {})}


def coordinates(like, jitter):
    """Index coordinates [N or 1, 1, h, w] of the image's samples along x and y."""
    height, width = like.shape[-2:]
    shift = torch.as_tensor(jitter, dtype=like.dtype, device=like.device).reshape(-1, 2, 1, 1, 1)
    x = torch.arange(width, dtype=like.dtype, device=like.device) + shift[:, 0]
    y = torch.arange(height, dtype=like.dtype, device=like.device)[:, None] + shift[:, 1]
    return x.expand(-1, 1, height, width), y.expand(-1, 1, height, width)


def taps(x, y, size):
    """The four pixels around index coordinates in an image of that (height, width): index, weight, whether inside."""
    height, width = size
    # Far coordinates would not fit an integer; two pixels outside are as far out as any.
    x, y = x.clamp(-2, width + 1), y.clamp(-2, height + 1)
    first_x, first_y = x.floor(), y.floor()
    right, below = x - first_x, y - first_y
    first_x, first_y = first_x.long(), first_y.long()
    for row, weight_y in ((first_y, 1 - below), (first_y + 1, below)):
        for column, weight_x in ((first_x, 1 - right), (first_x + 1, right)):
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
            index = row.clamp(0, height - 1) * width + column.clamp(0, width - 1)
            yield index, weight_x * weight_y, inside


def is_valid(motion):
    return torch.isfinite(motion).all(dim=1, keepdim=True)


def previous_depth(motion, depth, jitter):
    """The depth of what this frame shows, where it was in the previous one [N, 1, h, w]; 1 where nothing was."""
    valid = is_valid(motion)
    moved = motion.masked_fill(~valid, 0)
    x, y = (place + moved[:, i : i + 1] for i, place in enumerate(coordinates(depth, jitter)))
    result = torch.ones_like(depth).flatten(1)
    for index, weight, inside in taps(x, y, depth.shape[-2:]):
        reached = valid & inside & (weight > SPLAT)
        source = torch.where(reached, depth, torch.ones_like(depth))
        result = result.scatter_reduce(1, index.flatten(1), source.flatten(1), "amin")
    return result.view_as(depth)


def steps(image, axis, size):
    """Differences along an axis to the neighbour before and to the one after; at the border to the one that there is."""
    if size == 1:
        return torch.zeros_like(image), torch.zeros_like(image)
    step = image.narrow(axis, 1, size - 1) - image.narrow(axis, 0, size - 1)
    return torch.cat((step.narrow(axis, 0, 1), step), dim=axis), torch.cat((step, step.narrow(axis, size - 2, 1)), dim=axis)


def depth_before(motion, depth):
    """What each pixel's surface had as its depth in the previous frame [N, 1, h, w], by how much it has grown since."""
    if 1 in depth.shape[-2:]:
        return depth.clamp(max=1)
    changes = []
    for axis in (3, 2):
        before, after = steps(motion, axis, depth.shape[axis])
        sizes = [each.abs().sum(dim=1, keepdim=True) for each in (before, after)]
        less = (sizes[1] < sizes[0]) | sizes[0].isnan()  # across an edge it is more
        changes.append(torch.where(less, after, before).chunk(2, dim=1))
    (xx, yx), (xy, yy) = changes
    area = (1 + xx) * (1 + yy) - xy * yx
    area = torch.where(torch.isfinite(area), area, torch.ones_like(area)).clamp(*AREAS)
    return (depth / area ** (1 / 3)).clamp(max=1)


def slopes(depth):
    """A surface's own slope along x and along y, added up: the smaller of the differences to both neighbours."""
    total = torch.zeros_like(depth)
    for axis in (2, 3):
        before, after = steps(depth, axis, depth.shape[axis])
        total = total + torch.minimum(before.abs(), after.abs())
    return total


def neighbors(image, radius):
    """The (2·radius + 1)² pixels around each, in raster order; NaN outside the image."""
    height, width = image.shape[-2:]
    padded, span = F.pad(image, (radius,) * 4, value=float("nan")), range(2 * radius + 1)
    return [padded[:, :, j : j + height, i : i + width] for j in span for i in span]


def companions(motion, depth):
    """Depths of each pixel's 3×3 neighbours that move along with it [N, 9, h, w]; −1 of the others."""
    around = neighbors(torch.cat((motion, depth), dim=1), 1)
    along = [((each[:, :2] - motion).abs() <= ALONG).all(dim=1, keepdim=True) for each in around]
    return torch.cat([torch.where(a, each[:, 2:], torch.full_like(depth, -1)) for a, each in zip(along, around)], dim=1)


def checked_motion(motion, depth, jitter, previous=None):
    """Motion with NaN where the previous frame did not show the surface; `depth` is that of `depth_before`."""
    previous = previous_depth(motion, depth, jitter) if previous is None else previous
    height, width = depth.shape[-2:]
    valid = is_valid(motion)
    x, y = (place + motion[:, i : i + 1] for i, place in enumerate(coordinates(depth, jitter)))
    on_screen = (x >= -0.5) & (x <= width - 0.5) & (y >= -0.5) & (y <= height - 0.5)
    least = depth - (NEARER * depth + 2 * slopes(depth) + DEPTH_STEP)
    seen, nearer = torch.zeros_like(depth), torch.zeros_like(depth)
    along = companions(motion, depth)
    around_x, around_y, around = (torch.cat(neighbors(each.expand_as(depth), NEAR), dim=1) for each in (x, y, depth))
    for index, weight, inside in taps(x, y, (height, width)):
        weight = weight * inside
        seen = seen + weight
        before = previous.flatten(1).gather(1, index.flatten(1)).view_as(depth)
        there = ((around_x - index % width).abs() < 1) & ((around_y - index // width).abs() < 1)
        near, companion = ((there & (around == before)).any(dim=1, keepdim=True), (along == before).any(dim=1, keepdim=True))
        nearer = nearer + weight * ((before < torch.where(near, least, depth)) & ~companion)
    return motion.masked_fill(~(valid & on_screen & (nearer <= 0.5 * seen)), float("nan"))


def checked(motion, depth, jitter):
    """`checked_motion` of a frame's motion and depth."""
    return checked_motion(motion, depth_before(motion, depth), jitter)


def validity(motion):
    return is_valid(motion).to(motion.dtype)


def output_coordinates(like, scale, size, jitter):
    """Index coordinates [N or 1, 1, H, W] in a render-resolution image of the pixels of an output of that size."""
    shift = torch.as_tensor(jitter, dtype=torch.float64, device=like.device).reshape(-1, 2, 1, 1, 1)
    along = [(torch.arange(n, dtype=torch.float64, device=like.device) + 0.5) / scale - 0.5 for n in size]
    shape = (shift.shape[0], 1, *size)
    return (along[1] - shift[:, 0]).expand(shape).to(like.dtype), (along[0][:, None] - shift[:, 1]).expand(shape).to(like.dtype)


def output_size(like, scale):
    return tuple(int(n * scale + 0.5) for n in like.shape[-2:])


def upsample(image, scale, jitter):
    """operators.upsample at any scale."""
    u, v = output_coordinates(image, scale, output_size(image, scale), jitter)
    count = image.shape[0]
    return operators.bilinear(image, u[:, 0].expand(count, -1, -1), v[:, 0].expand(count, -1, -1))


def reproject(motion, depth, scale, motion_jitter, size=None):
    """Motion of output pixels, in output pixels; NaN where there is no history."""
    batch, _, height, width = depth.shape
    size = size or output_size(depth, scale)
    u, v = output_coordinates(depth, scale, size, motion_jitter)
    x, y = u.clamp(0, width - 1), v.clamp(0, height - 1)
    first_x, first_y = x.floor(), y.floor()
    right, below = x - first_x, y - first_y
    columns = first_x.long(), (first_x.long() + 1).clamp(max=width - 1)
    rows = first_y.long(), (first_y.long() + 1).clamp(max=height - 1)
    packed = torch.cat((motion, depth), dim=1).flatten(2)
    # Running choices over the four taps, in raster order: the first of equals stays.
    mean = torch.zeros(batch, 2, *size, dtype=depth.dtype, device=depth.device)
    low, high = mean + float("inf"), mean - float("inf")
    farthest, all_valid = mean[:, :1] - 1, torch.ones_like(mean[:, :1], dtype=torch.bool)
    foremost_depth, foremost = mean[:, :1] + 2, mean
    most, largest = mean[:, :1] - 1, mean
    for row, weight_y in ((rows[0], 1 - below), (rows[1], below)):
        for column, weight_x in ((columns[0], 1 - right), (columns[1], right)):
            index = (row * width + column).flatten(2).expand(batch, 3, -1)
            tap = packed.gather(2, index).view(batch, 3, *size)
            vector, distance = tap[:, :2], tap[:, 2:]
            counts, weight = (weight_x > COUNTED) & (weight_y > COUNTED), weight_x * weight_y
            valid = is_valid(vector)
            known = counts & valid
            mean = mean + torch.where(known, weight * vector, torch.zeros_like(vector))
            low = torch.where(known, torch.minimum(low, vector), low)
            high = torch.where(known, torch.maximum(high, vector), high)
            all_valid = all_valid & (valid | ~counts)
            farthest = torch.where(counts, torch.maximum(farthest, distance), farthest)
            nearer = counts & (distance < foremost_depth)
            foremost_depth = torch.where(nearer, distance, foremost_depth)
            foremost = torch.where(nearer, vector, foremost)
            more = counts & (weight > most)
            most = torch.where(more, weight, most)
            largest = torch.where(more, vector, largest)
    apart = ((high - low) > SILHOUETTE_MOTION).any(dim=1, keepdim=True)
    silhouette = apart & (farthest - foremost_depth > SILHOUETTE_DEPTH * foremost_depth)
    return scale * torch.where(silhouette, foremost, torch.where(all_valid, mean, largest))


def extremes(color):
    """The least and the greatest of each pixel's 3×3 neighbourhood, without what is outside the image."""
    return -F.max_pool2d(-color, 3, 1, 1), F.max_pool2d(color, 3, 1, 1)


def nearest_index(u, size):
    """The sample at index coordinates u that is nearest: the later one of two as near, whatever the rounding."""
    return (u.clamp(0, size - 1) + 0.5 + 2**-12).floor().long().clamp(max=size - 1)


def believed(range_, history, scale):
    """Where most pixels around have a history inside their range, as numbers [N, 1, h, w]; a `range_` of `extremes`."""
    low, high = range_
    mean = F.avg_pool2d(history, scale)
    outside = ((mean < low - ALLOWED) | (mean > high + ALLOWED)).any(dim=1, keepdim=True).to(history)
    share = F.avg_pool2d(outside, 5, 1, 2, count_include_pad=False)
    return (share < 0.5 + 1e-3).to(history)  # of at most 25 pixels; the mean is rounded


def hold(image, color, history, scale, whole=None):
    """The image within what the frame's neighbourhood and a believed history show, channel by channel. Where the scale
    is not whole, `whole` is the history at one that is, and that one.
    """
    around = extremes(color)

    def spread(image):
        if not whole:
            return operators.tiles(image, scale)
        rows, columns = (
            ((torch.arange(made, dtype=torch.float64) + 0.5) / scale + 0.001).long().clamp(max=pixels - 1)
            for made, pixels in zip(history.shape[2:], color.shape[2:])
        )
        return image[:, :, rows][..., columns]

    trusted = spread(believed(around, *(whole or (history, scale)))) > 0
    low, high = (spread(each) for each in around)
    seen = torch.where(trusted, history, torch.minimum(torch.maximum(history, low), high))
    return torch.minimum(torch.maximum(image, torch.minimum(low, seen)), torch.maximum(high, seen))


class Place(NamedTuple):
    """Where a frame's history is found: `grid` as operators.sample takes it."""

    grid: torch.Tensor
    valid: Optional[torch.Tensor]  # output pixels that have one [N, 1, H, W]; None: all
    checked: Optional[torch.Tensor] = None  # where it is checked: motion of render pixels

    def warp(self, image, border, fallback):
        warped = operators.sample(image, self.grid, border)
        return warped if self.valid is None else torch.where(self.valid, warped, torch.as_tensor(fallback).to(warped))

    @property
    def validity(self):
        return validity(self.checked)

    def has_history(self):
        """As numbers, [N, 1, H, W]."""
        return torch.ones_like(self.grid[:, None, ..., 0]) if self.valid is None else self.valid.to(self.grid)


def places(frames, scale, checked=True):
    """Of every frame, all frames at once: by `reproject`, or by every pixel's own motion where it is not checked."""
    vectors = [None] * len(frames)
    if checked:
        motion, vectors = zip(*(followed(frame, scale) for frame in frames))
    else:
        motion = [operators.upsample_motion(frame.motion, scale, frame.motion_jitter) for frame in frames]
    grid, valid = operators.warp_grid(torch.cat(motion))
    valid = [None] * len(frames) if valid is None else valid.chunk(len(frames))
    return [Place(*parts) for parts in zip(grid.chunk(len(frames)), valid, vectors)]


def followed(frame, scale):
    """`reproject` and `checked_motion` of a frame."""
    if frame.followed is not None:
        return frame.followed, frame.checked
    seen = checked(frame.motion, frame.depth, frame.jitter)
    return reproject(seen, frame.depth, scale, frame.motion_jitter), seen
