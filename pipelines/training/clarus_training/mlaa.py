"""Morphological antialiasing of images [N, 3, H, W], as `kernels/mlaa.cl` defines it; words and rules are said there.

Differentiable in the colours that it mixes. Their shares change with colours in steps alone, and have no gradient.
"""

import torch
import torch.nn.functional as F

THRESHOLD = 1 / 16  # from which two colours differ
REACH = 64  # pixels, in which a line's end is looked for


def antialiased(image):
    upright = image.transpose(-1, -2)
    return image + gain(image, lying=True) + gain(upright, lying=False).transpose(-1, -2)


def gain(image, lying):
    """What colours gain by the lines along x; `lying`: where along x and across are alike, those along x count."""
    with torch.no_grad():
        from_above, from_below = shares(image, lying)
    above, below = (F.pad(image, (0, 0, *pad), mode="replicate") for pad in ((1, -1), (-1, 1)))
    return from_above[:, None] * (above - image) + from_below[:, None] * (below - image)


def shares(image, lying):
    """The shares [N, H, W] that pixels take of the colours above and below them."""
    along = F.pad(differ(image[:, :, 1:], image[:, :, :-1]), (0, 0, 0, 1))  # between (x, y) and (x, y + 1)
    across = F.pad(differ(image[..., 1:], image[..., :-1]), (0, 1))  # between (x, y) and (x + 1, y)
    first, first_step = line_ends(along, across, -1)
    last, last_step = line_ends(along, across, 1)
    length = first + last + 1
    is_line = along & ((length > 1) | (lying & (first_step * last_step == -1)))

    def share(side):
        ends = (first, first_step), (last, last_step)
        areas = [torch.where(step == side, area(distance, length), 0) for distance, step in ends]
        return torch.where(is_line, sum(areas), 0)

    line_above = moved(along, 0, -1)
    from_above = torch.where(line_above & ~along, moved(share(1), 0, -1), 0)
    from_below = torch.where(along & ~line_above, share(-1), 0)
    return from_above, from_below


def differ(a, b):
    return ((a - b).abs() >= THRESHOLD).any(dim=1)


def moved(image, x, y):
    """[N, H, W] with the pixel at (+x, +y) in each place; 0 outside."""
    return F.pad(image, (-x, x, -y, y))


def line_ends(along, across, direction):
    """How far the end of each pixel's line is along x, and which way it goes on there: −1 up, 1 down, 0 neither."""
    across = moved(across, min(direction, 0), 0)
    up, down, above, below = (moved(across, 0, y) for y in (0, 1, -1, 2))
    turn = (down & ~up & ~below).float() - (up & ~down & ~above).float()
    stop = up | down | ~moved(along, direction, 0)
    distance, step = torch.zeros_like(turn), turn.clone()
    width = along.shape[-1]
    for x in range(width - 2, -1, -1) if direction > 0 else range(1, width):
        distance[..., x] = torch.where(stop[..., x], 0, distance[..., x + direction] + 1)
        step[..., x] = torch.where(stop[..., x], turn[..., x], step[..., x + direction])
    return distance.clamp(max=REACH), torch.where(distance < REACH, step, 0)


def area(distance, length):
    """What the true edge cuts off a pixel so far from its line's end."""
    last = torch.minimum(distance + 1, length / 2)
    return torch.where(last > distance, (last - distance) * (1 - (distance + last) / length) / 2, 0)
