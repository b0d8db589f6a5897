"""What networks of plain convolutions share."""

from torch import nn


def convolutions(inputs, *outputs, size=3):
    """Convolutions one after the other, each of as many outputs as told, that keep the image's size."""
    widths = (inputs, *outputs)
    return nn.ModuleList(nn.Conv2d(a, b, size, padding=size // 2) for a, b in zip(widths, widths[1:]))
