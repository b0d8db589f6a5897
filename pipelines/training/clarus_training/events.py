"""What befalls clips besides what was rendered: cuts, fades, flat pictures, bars. All keep input and reference consistent.

Images are those of dataset.Images, changed in place, each of the batch's clips by itself. `chance` is a random.Random.
"""

import torch

CUT, FLAT, FADE, BARS = 0.25, 0.2, 0.15, 0.1  # shares of clips; of cuts, half are marked
FLAT_FADE = 0.5  # of flat clips: there nothing but the history's level says that it is old
LEVELS = (0.0, 0.0, 1.0)
STILL = {"depth": 1, "motion": 0, "followed": 0, "checked": 0}  # what has no surface


def happen(images, chance):
    length, count = images.color.shape[:2]
    for n in range(count):
        if chance.random() < CUT and count > 1 and length > 1:
            cut(images, n, chance)
    for n in range(count):
        is_flat = chance.random() < FLAT
        if is_flat:
            flatten(images, n, chance)
        if chance.random() < (FLAT_FADE if is_flat else FADE):
            fade(images, n, chance)
        if chance.random() < BARS:
            bars(images, n, chance)


def cut(images, n, chance):
    """From some frame on, the clip is another of the batch; half of the time no vector says that there is no history."""
    t = chance.randint(1, images.color.shape[0] - 1)
    other = chance.choice([i for i in range(images.color.shape[1]) if i != n])
    marked = chance.random() < 0.5
    for name, image, _ in images.of_scale(1):
        image[t:, n] = image[t:, other]
        if marked and name in STILL and name != "depth":
            image[t, n] = float("nan")


def flatten(images, n, chance):
    """One colour from some frame to the end, or from the start to some frame; nothing marks the change."""
    t = chance.randint(0, images.color.shape[0] - 1)
    span = slice(t, None) if chance.random() < 0.7 else slice(0, t)
    value = torch.full((3, 1, 1), chance.choice(LEVELS))
    if chance.random() < 0.3:
        value = torch.tensor([chance.random() for _ in range(3)])[:, None, None]
    for name, image, _ in images.of_scale(1):
        image[span, n] = STILL.get(name, value.to(image))


def fade(images, n, chance):
    """To or from black or white, or a part of the way, over the whole clip or some of its frames."""
    length = images.color.shape[0]
    first = chance.randint(0, length - 1)
    last = chance.randint(first, length - 1) + 1
    share = ((torch.arange(length) - first + 1) / (last - first)).clamp(0, 1)
    if chance.random() < 0.5:
        share = 1 - share
    target = chance.choice(LEVELS)
    share = share * chance.choice((1, 1, chance.random()))
    for image in (images.color, images.reference):
        weight = share[:, None, None, None].to(image)
        image[:, n] = image[:, n] * (1 - weight) + target * weight


def bars(images, n, chance):
    """A band of one level along an edge of the crop, as in letterboxed pictures; it stands still."""
    sides = images.color.shape[-2:]
    axis, far = chance.choice((-1, -2)), chance.random() < 0.5
    side, size = sides[axis], 2 * chance.randint(1, min(sides) // 6)
    level = chance.choice(LEVELS)
    for name, image, s in images.of_scale(images.reference.shape[-1] / sides[-1]):
        image[:, n].narrow(axis, int(s * (side - size)) if far else 0, int(s * size)).fill_(STILL.get(name, level))
