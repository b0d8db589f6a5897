"""SRPO (Gu et al. 2022) as the specification's section "SRPO" has it."""

import math

import numpy as np
import torch
from torch import nn
import torch.nn.functional as F

from . import losses, operators
from .layers import convolutions, through

CLIPS = [1]
RATE = 1e-3
FEATURES = 16
ROUNDED = 0.75  # from this share of the training on, offsets are rounded


class Srpo(nn.Module):
    """The network. It looks at one frame, and has no state."""

    pipeline = "srpo"

    def __init__(self, scale):
        super().__init__()
        self.scale = scale
        self.conv = convolutions(3, FEATURES, FEATURES, 2, size=5)

    def ahead(self, frames):
        return [None] * len(frames)

    def offsets(self, color):
        """Raw offsets [N, 2, H, W] in render pixels."""
        *layers, last = self.conv
        x = F.interpolate(through(layers, color), scale_factor=self.scale, mode="nearest")
        return last(x).to(color.dtype)

    def step(self, frame, state=None, ahead=None, inside=None):
        raw = self.offsets(frame.color)
        offsets = rounded(raw)
        projected = project(frame.color, offsets, self.scale)
        output, mask = fused(frame.color, offsets, projected, self.scale)
        if inside is not None:
            inside.update(raw=raw, offsets=offsets, projected=projected, mask=mask)
        return output, None


def rounded(offsets):
    """Half up."""
    return torch.floor(offsets + 0.5)


def project(color, offsets, scale):
    """O(X, Y) = colour at render pixel (⌊X/s⌋ + ox, ⌊Y/s⌋ + oy), bilinearly between pixels, clamped to the image."""
    height, width = offsets.shape[-2:]
    x = torch.arange(width, device=offsets.device) // scale
    y = torch.arange(height, device=offsets.device)[:, None] // scale
    return operators.bilinear(color, x + offsets[:, 0], y + offsets[:, 1])


def fused(color, offsets, projected, scale):
    """The moved colour where something is moved, the interpolated one elsewhere; and the mask."""
    mask = blur((offsets != 0).any(dim=1, keepdim=True).to(color.dtype)).clamp(0, 1)
    images = lanczos_upsample(color, scale), projected, mask
    interpolated, moved, mask = (image.to(color.dtype) for image in images)  # convolutions may be in bfloat16
    return operators.mix(interpolated, moved, mask), mask


def lanczos_upsample(image, scale):
    """Lanczos-3 at (X+½)/s − ½, weights normalised, border clamp, the result clamped to [0, 1]."""

    def lanczos(distance):
        return np.where(np.abs(distance) < 3, np.sinc(distance) * np.sinc(distance / 3), 0)

    return operators.filter_upsample(image, scale, lanczos, 3).clamp(0, 1)


def blur(mask):
    """Gaussian, σ = 1, radius 3, normalised, border zero, of a mask [N, 1, H, W]."""
    weights = torch.tensor([math.exp(-(d * d) / 2) for d in range(-3, 4)], dtype=torch.float64)
    weights = (weights / weights.sum()).to(mask).view(1, 1, 1, 7)
    return F.conv2d(F.conv2d(mask, weights, padding=(0, 3)), weights.transpose(2, 3), padding=(3, 0))


def shape(arguments):
    return dict(scale=arguments.scale)


def create(scale):
    """A network to be trained; its offsets start near 0."""
    network = Srpo(scale)
    with torch.no_grad():
        network.conv[-1].weight.mul_(0.1)
        nn.init.zeros_(network.conv[-1].bias)
    return network


def parameter_groups(network, arguments):
    return [{"params": list(network.parameters())}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """The paper's: 1 − SSIM of the colour moved by the offsets, bilinearly between pixels, which is what teaches them.

    In the last quarter of the training the loss is that of the output, in which offsets are rounded, and half of that of
    the moved colour; gradients are still the bilinear ones.
    """
    (frame,) = frames
    criterion = criterion or losses.ssim
    raw = network.offsets(frame.color)
    projected = project(frame.color, raw, network.scale)
    if progress <= ROUNDED:
        return criterion(projected, reference[0])
    offsets = rounded(raw)
    projected = projected + (project(frame.color, offsets, network.scale) - projected).detach()
    output, _ = fused(frame.color, offsets, projected, network.scale)
    return criterion(output, reference[0]) + criterion(projected, reference[0]) / 2
