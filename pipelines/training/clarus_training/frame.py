"""What a network sees of a frame."""

from typing import NamedTuple, Optional

import torch


class Frame(NamedTuple):
    """A batch of N frames with one jitter, canonical as docs/conventions.md has it.

    `color` [N, 3, h, w], `depth` [N, 1, h, w], `motion` [N, 2, h, w] with NaN in invalid vectors. A frame whose vectors
    are all invalid has no history, and so is as good as a reset: that is how one frame of a batch resets and another
    does not. `jitter` is (jx, jy), `motion_jitter` where in their pixels the vectors were sampled (J_m). `followed`
    [N, 2, H, W] and `checked` [N, 2, h, w] are what history.py makes of motion and depth, `collected` [N, 4, H, W] and
    `trust` [N, 1, h, w] what fsr2.py makes of all frames so far, where that is known already.
    """

    color: torch.Tensor
    depth: torch.Tensor
    motion: torch.Tensor
    jitter: tuple
    motion_jitter: tuple = (0.0, 0.0)
    followed: Optional[torch.Tensor] = None
    checked: Optional[torch.Tensor] = None
    collected: Optional[torch.Tensor] = None
    trust: Optional[torch.Tensor] = None


def run(network, frames):
    """The outputs for consecutive frames of which the first is a reset: one [N, 3, H, W] a frame."""
    outputs, state = [], None
    for frame, ahead in zip(frames, network.ahead(frames)):
        output, state = network.step(frame, state, ahead)
        outputs.append(output)
    return outputs
