"""Recurrent clips of crops."""

import random

import numpy as np

from .operators import DILATE_BLOCK
from .sequence import to_images


class Clips:
    """Batches of clips, cut at random from sequences with references.

    The clips of a batch have the same jitters frame by frame, so that one set of predicted kernels serves them all. A
    clip's first frame is a reset, as in use.
    """

    def __init__(self, sequences, length, crop, seed):
        self.sequences, self.length, self.crop = sequences, length, crop
        self.random = random.Random(seed)
        self.starts = {}
        for sequence in sequences:
            for t in range(len(sequence) - length + 1):
                if not any(sequence.reset[t + 1 : t + length]):
                    jitters = tuple((round(x, 5), round(y, 5)) for x, y in sequence.jitter[t : t + length])
                    self.starts.setdefault(jitters, []).append((sequence, t))
        if not self.starts:
            raise SystemExit(f"no clip of {length} frames in the data")
        self.weights = [len(starts) for starts in self.starts.values()]

    def batch(self, count, device="cpu"):
        """(color, depth, motion, reference), each [T, N, C, h, w], and the T jitters."""
        (starts,) = self.random.choices(list(self.starts.values()), self.weights)
        chosen = [self.random.choice(starts) for _ in range(count)]
        cuts = [self._cut(*clip) for clip in chosen]
        sequence, t = chosen[0]
        images = [to_images(np.stack(parts, axis=1), device) for parts in zip(*cuts)]
        return images, sequence.jitter[t : t + self.length]

    def _cut(self, sequence, t):
        height, width = sequence.depth.shape[1:]
        crop_height, crop_width = min(self.crop, height), min(self.crop, width)
        # On multiples of a block, the dilated motion of the crop is that of the whole frame.
        y = self.random.randint(0, (height - crop_height) // DILATE_BLOCK) * DILATE_BLOCK
        x = self.random.randint(0, (width - crop_width) // DILATE_BLOCK) * DILATE_BLOCK
        s = sequence.scale
        low = (slice(t, t + self.length), slice(y, y + crop_height), slice(x, x + crop_width))
        high = (low[0], slice(s * y, s * (y + crop_height)), slice(s * x, s * (x + crop_width)))
        return sequence.color[low], sequence.depth[low][..., None], sequence.motion[low], sequence.reference[high]
