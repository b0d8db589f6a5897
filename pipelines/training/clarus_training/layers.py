"""What networks of plain convolutions share."""

from torch import nn
import torch.nn.functional as F


def convolutions(inputs, *outputs, size=3):
    """Convolutions one after the other, each of as many outputs as told, that keep the image's size."""
    widths = (inputs, *outputs)
    return nn.ModuleList(nn.Conv2d(a, b, size, padding=size // 2) for a, b in zip(widths, widths[1:]))


def through(layers, x):
    """Convolutions, a ReLU after each."""
    for layer in layers:
        x = F.relu(layer(x))
    return x


def linear_at_last(layers, x):
    """The same, but for the last one's ReLU."""
    *layers, last = layers
    return last(through(layers, x))
