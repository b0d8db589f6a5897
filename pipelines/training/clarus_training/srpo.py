"""SRPO (Gu et al. 2022) as docs/pipelines.md, "SRPO", has it."""

import math

import numpy as np
import torch
from torch import nn
import torch.nn.functional as F

from . import losses, mlaa, operators
from .layers import convolutions, through

CLIPS = [1]
RATE = 1e-3
FEATURES = 16
SHOWN = 0.25  # from this share of the training on, the loss is that of what is shown
SOFTNESS = 0.025  # of the steps whose gradients stand for those of rounding


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
        x = through(layers, color)
        if self.folded:
            return F.pixel_shuffle(last(x), self.scale).to(color.dtype)
        x = F.interpolate(x, scale_factor=self.scale, mode="nearest")
        return last(x).to(color.dtype)

    @property
    def folded(self):
        """Whether the last layer has the sums of its taps that fall on one pixel, of each of the pixels that it makes,
        as files in whole numbers do."""
        return self.conv[-1].weight.shape[0] != 2

    def step(self, frame, state=None, ahead=None, inside=None):
        raw = self.offsets(frame.color)
        offsets = rounded(raw)
        projected = project(frame.color, offsets, self.scale)
        output, mask = fused(frame.color, offsets, projected, self.scale)
        if inside is not None:
            inside.update(raw=raw, offsets=offsets, projected=projected, mask=mask)
        return output, None


def load_model(tensors, metadata):
    """The network of a model file's content."""
    network = create(scale=int(metadata["scale"]))
    outputs, inputs, size, _ = tensors["conv.2.weight"].shape
    network.conv[-1] = nn.Conv2d(inputs, outputs, size, padding=size // 2)
    network.load_state_dict(tensors)
    return network


def rounded(offsets):
    """Half up."""
    return torch.floor(offsets + 0.5)


def softly_rounded(offsets):
    """Much like it, with gradients near where rounding jumps; far from there an offset has none, and stays."""
    low = offsets.detach().floor()
    step = torch.tanh((offsets - low - 0.5) / (2 * SOFTNESS)) / math.tanh(1 / (4 * SOFTNESS))
    return low + (step + 1) / 2


def project(color, offsets, scale):
    """O(X, Y) = colour at render pixel (⌊X/s⌋ + ox, ⌊Y/s⌋ + oy), bilinearly between pixels, clamped to the image."""
    height, width = offsets.shape[-2:]
    x = torch.arange(width, device=offsets.device) // scale
    y = torch.arange(height, device=offsets.device)[:, None] // scale
    return operators.bilinear(color, x + offsets[:, 0], y + offsets[:, 1])


def fused(color, offsets, projected, scale):
    """The moved colour where something is moved, the interpolated one elsewhere; and the mask."""
    mask = blur(offsets.abs().amax(dim=1, keepdim=True).clamp(max=1)).clamp(0, 1)
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

    After a quarter of the training, that of what is shown: moved by rounded offsets, fused and antialiased, as the
    reference then is. Its gradients are those with `softly_rounded` offsets, which the mask has then, too.
    """
    (frame,) = frames
    criterion = criterion or losses.ssim
    raw = network.offsets(frame.color)
    if progress <= SHOWN:
        return criterion(project(frame.color, raw, network.scale), reference[0])
    with torch.autocast(raw.device.type, enabled=False):
        color, raw = frame.color.float(), raw.float()
        hard, soft = (
            fused(color, offsets, project(color, offsets, network.scale), network.scale)[0]
            for offsets in (rounded(raw), softly_rounded(raw))
        )
        output = soft + (hard - soft).detach()
        return criterion(mlaa.antialiased(output), mlaa.antialiased(reference[0].float()))
