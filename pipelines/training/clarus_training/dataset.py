"""Recurrent clips of crops."""

from typing import NamedTuple, Optional

import numpy as np
import torch

from . import events
from .frame import Frame
from .operators import DILATE_BLOCK
from .sequence import to_images


VECTORS = ("motion", "followed", "checked")


class Images(NamedTuple):
    """A batch's images [T, N, …]: what a Frame has, and references."""

    color: torch.Tensor
    depth: torch.Tensor
    motion: torch.Tensor
    reference: torch.Tensor
    followed: Optional[torch.Tensor] = None
    checked: Optional[torch.Tensor] = None
    collected: Optional[torch.Tensor] = None
    trust: Optional[torch.Tensor] = None

    def of_scale(self, s):
        """Each image, and how many of its pixels there are to a render pixel."""
        sizes = (1, 1, 1, s, s, 1, s, 1)
        return [(name, image, size) for name, image, size in zip(self._fields, self, sizes) if image is not None]

    def turned(self, flip, swap):
        """Mirrored along x, along y, and then transposed, as asked for."""

        def turn(name, image):
            image = turned(image, flip, swap)
            return turned_vectors(image, flip, swap, axis=2) if name in VECTORS else image

        return Images(**{name: turn(name, image) for name, image, _ in self.of_scale(1)})


class Clips:
    """Batches of clips, cut at random from sequences with references, augmented in ways that keep the physics right.

    The clips of a batch have the same jitters frame by frame, so that one set of predicted kernels serves them all:
    they are of any sequences that agree in them. A clip's first frame is a reset, as in use; where a later one is a
    reset, its vectors are all invalid, which is the same.

    `turn` mirrors and transposes a batch's images, motion and jitters. `tint` gives every clip, input and reference
    alike, another brightness, contrast and colour. `eventful` clips have cuts, fades, flat pictures and bars (events.py).
    `checked` frames come with what history.py makes of them, `collected` ones with what fsr2.py makes of the whole
    sequence up to them: a clip's first frame is no reset then.
    """

    def __init__(self, sequences, length, crop, turn=True, tint=True, eventful=False, checked=False, collected=False):
        self.length, self.crop, self.turn, self.tint, self.eventful = length, crop, turn, tint, eventful
        self.checked, self.collected = checked, collected
        groups = {}
        for sequence in sequences:
            if min(sequence.depth.shape[1:]) < crop:
                raise SystemExit(f"{sequence.directory}: frames are smaller than a crop of {crop}")
            if checked:
                sequence.follow()
            if collected:
                sequence.collect()
            for t in range(len(sequence) - length + 1):
                jitters = np.round((sequence.jitter[t : t + length], sequence.motion_jitter[t : t + length]), 5)
                key = (jitters.tobytes(), sequence.scale, sequence.color.dtype, sequence.reference.dtype)
                groups.setdefault(key, []).append((sequence, t))
        if not groups:
            raise SystemExit(f"no clip of {length} frames in the data")
        self.groups = list(groups.values())
        self.weights = [len(group) for group in self.groups]

    def batch(self, count, chance, device="cpu"):
        """`count` clips as a list of Frames, and their references [T, N, 3, H, W]. `chance` is a random.Random."""
        (group,) = chance.choices(self.groups, self.weights)
        chosen = [chance.choice(group) for _ in range(count)]
        cuts = [self._cut(*clip, chance) for clip in chosen]
        images = {name: np.stack([cut[name] for cut in cuts], axis=1) for name in cuts[0]}
        images = Images(**{name: to_images(image, device) for name, image in images.items()})
        sequence, t = chosen[0]
        jitters = [sequence.jitter[t : t + self.length], sequence.motion_jitter[t : t + self.length]]
        if self.turn:
            flip = [chance.random() < 0.5, chance.random() < 0.5]
            swap = chance.random() < 0.5
            images = images.turned(flip, swap)
            jitters = turned_vectors(torch.tensor(jitters), flip, swap, axis=2).tolist()
        if self.eventful:
            events.happen(images, chance)
        if self.tint:
            gain, offset = tints(count, chance, device)
            collected = () if images.collected is None else (images.collected[:, :, :3],)
            for each in (images.color, images.reference, *collected):
                each.mul_(gain).add_(offset)
        jitters = (map(tuple, each) for each in jitters)
        known = {name: image for name, image in images._asdict().items() if name in Frame._fields and image is not None}
        known.update(zip(("jitter", "motion_jitter"), jitters))
        return [Frame(**dict(zip(known, parts))) for parts in zip(*known.values())], images.reference

    def _cut(self, sequence, t, chance):
        height, width = sequence.depth.shape[1:]
        # On multiples of a block, the dilated motion of the crop is that of the whole frame.
        y = chance.randint(0, (height - self.crop) // DILATE_BLOCK) * DILATE_BLOCK
        x = chance.randint(0, (width - self.crop) // DILATE_BLOCK) * DILATE_BLOCK
        s = sequence.scale
        if s * y != int(s * y) or s * x != int(s * x):
            raise SystemExit(f"{sequence.directory}: a crop at a scale of {s} is not of whole pixels")
        low = (slice(t, t + self.length), slice(y, y + self.crop), slice(x, x + self.crop))
        high = (low[0], *(slice(int(s * at), int(s * (at + self.crop))) for at in (y, x)))
        motion = np.array(sequence.motion[low])
        reset = np.array(sequence.reset[low[0]])
        motion[reset] = np.nan
        images = dict(color=sequence.color[low], depth=sequence.depth[low][..., None], motion=motion)
        images["reference"] = sequence.reference[high]
        if self.checked:
            images.update(followed=np.array(sequence.followed[high]), checked=np.array(sequence.checked[low]))
            images["followed"][reset], images["checked"][reset] = np.nan, np.nan
        if self.collected:
            images.update(collected=sequence.collected[high], trust=sequence.trust[low])
        return images


def turned(images, flip, swap):
    """Mirrored along x, along y, and then transposed, as asked for: images [..., h, w]."""
    axes = [axis for axis, asked in zip((-1, -2), flip) if asked]
    images = images.flip(axes) if axes else images
    return images.transpose(-1, -2) if swap else images


def turned_vectors(vectors, flip, swap, axis):
    """What becomes of (x, y) vectors, or jitters, along `axis` when `turned` is done to the images."""
    sign = vectors.new_tensor([-1.0 if asked else 1.0 for asked in flip])
    vectors = vectors * sign.view([-1] + [1] * (vectors.ndim - 1 - axis))
    return vectors.flip(axis) if swap else vectors


def tints(count, chance, device="cpu"):
    """For every clip a gain and an offset [N, 3, 1, 1] that leave [0, 1] in [0, 1]; half of the clips stay as they are.

    Being linear, they do to the mean of a reference pixel's samples what they do to a sample.
    """
    gain, offset = torch.ones(count, 3), torch.zeros(count, 3)
    for n in range(count):
        if chance.random() < 0.5:
            common = chance.uniform(0.5, 1)
            gain[n] = torch.tensor([common * chance.uniform(0.8, 1) for _ in range(3)])
            offset[n] = chance.random() ** 2 * (1 - common)
    return tuple(each[:, :, None, None].to(device) for each in (gain, offset))
