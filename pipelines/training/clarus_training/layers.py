"""What networks of plain convolutions share."""

from torch import nn
import torch.nn.functional as F

from . import model_file


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


def plain_model_tensors(network, half, facts=None):
    """A model file's content where tensors are called as in the network."""
    array = model_file.rounding(half)
    tensors = {name: array(tensor) for name, tensor in network.state_dict().items()}
    metadata = {"pipeline": network.pipeline, "scale": network.scale, **(facts or {})}
    return tensors, {key: str(value) for key, value in metadata.items()}
