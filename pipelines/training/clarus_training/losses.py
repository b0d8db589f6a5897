"""Losses of a clip: outputs and references [T, N, 3, H, W]."""

import torch.nn.functional as F

LOSSES = {"l1": F.l1_loss, "l2": F.mse_loss}
