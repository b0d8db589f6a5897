"""Losses of a clip: outputs and references [T, N, 3, H, W]."""

import torch.nn.functional as F


def l1_l2(output, reference):
    """L1, and as much again for an error of 0.1, more for a larger one: ghosts are few, large errors."""
    return F.l1_loss(output, reference) + 10 * F.mse_loss(output, reference)


LOSSES = {"l1": F.l1_loss, "l1-l2": l1_l2}
