"""The project's own network, as docs/clarus.md has it: what fsr2 has collected, and what a small network adds to it."""

import torch
from torch import nn
import torch.nn.functional as F

from . import fsr2, history, model_file, operators
from .layers import convolutions, linear_at_last

SIZES = {"s": (16, 1), "m": (32, 3)}  # name: (features, middle layers)
CLIPS = [2]
RATE = 1e-3
SMALL = 0.05  # of the learning rate, of the last layer: what it makes are small corrections
STEADY = 2  # of changes where the reference has none
WITHIN = 0.1  # of what the range cuts off
EASIEST = 5e-4  # squared error of fsr2 below which a frame counts no more


class Conditioned(nn.Conv2d):
    """A first layer that learns weights of `conditions` @ its input; `plain` are those of the input itself."""

    def __init__(self, conditions, outputs):
        super().__init__(len(conditions), outputs, 3, padding=1)
        self.register_buffer("conditions", conditions, persistent=False)

    @property
    def plain(self):
        return torch.einsum("oiyx,ij->ojyx", self.weight, self.conditions).contiguous()

    def set_plain(self, weight):
        self.weight.data = torch.einsum("ojyx,ji->oiyx", weight, torch.linalg.pinv(self.conditions))

    def forward(self, x):
        return F.conv2d(x, self.plain, self.bias, padding=1)


def conditions(scale):
    """Of colour, jitter, trust and the history's pixels: colours as differences from their mean, and that mean."""
    squared = scale * scale
    result = torch.eye(6 + 4 * squared)
    mean = torch.zeros(3, len(result))
    for c in range(3):
        pixels = slice(6 + c * squared, 6 + (c + 1) * squared)
        mean[c, pixels] = 1 / squared
        result[pixels] -= mean[c]
        result[c] -= mean[c]
    result[-squared:] /= fsr2.MOST
    return torch.cat((result, mean))


class Clarus(nn.Module):
    """Its state is fsr2's: what was sampled, and the weight of it. What the network adds is never sampled again."""

    pipeline = "clarus"
    collects = True  # its frames come with what fsr2 has made of them, where that is known

    def __init__(self, scale, features, middle, conditioned=False):
        super().__init__()
        self.scale, squared = scale, scale * scale
        self.layers = convolutions(6 + 4 * squared, *[features] * (1 + middle), 3 * squared)
        if conditioned:
            self.layers[0] = Conditioned(conditions(scale), features)

    def ahead(self, frames):
        return [None] * len(frames)

    def step(self, frame, state=None, ahead=None, inside=None):
        s, color = self.scale, frame.color
        if frame.collected is not None:
            collected, trust = frame.collected, frame.trust
        else:
            collected, trust = fsr2.step(frame, state, s)
        planes = color.new_tensor(frame.jitter)[:, None, None].expand(len(color), 2, *color.shape[2:])
        seen = torch.cat((color, planes, trust, operators.space_to_depth(collected, s)), dim=1)
        details = operators.depth_to_space(self.network(seen).to(color.dtype), s)
        free = collected[:, :3] + details
        output = history.hold(free, color, collected[:, :3], s)
        if inside is not None:
            inside.update(collected=collected, trust=trust, details=details, excess=free - output)
        return output, collected

    def network(self, seen):
        return linear_at_last(self.layers, seen)


def shape(arguments):
    if arguments.size not in SIZES:
        raise SystemExit("a network of pipeline clarus is of --size s or m")
    if arguments.events:
        raise SystemExit("--events: what fsr2 makes of sequences is computed once, without events")
    features, middle = SIZES[arguments.size]
    return dict(scale=arguments.scale, features=features, middle=middle)


def create(scale, features, middle):
    """A network to be trained; it starts as fsr2."""
    network = Clarus(scale, features, middle, conditioned=True)
    for layer in network.layers:
        nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
        nn.init.zeros_(layer.bias)
    nn.init.zeros_(network.layers[-1].weight)
    return network


def adopt(network, trained):
    """The weights of a model file's network, as a state of `network`."""
    if [each.bias.shape for each in network.layers] != [each.bias.shape for each in trained.layers]:
        raise SystemExit("--start: a network of another shape")
    network.layers[0].set_plain(trained.layers[0].weight)
    network.layers[0].bias.data = trained.layers[0].bias.data
    network.layers[1:].load_state_dict(trained.layers[1:].state_dict())
    return network.state_dict()


def parameter_groups(network, arguments):
    last = list(network.layers[-1].parameters())
    others = [p for layer in network.layers[:-1] for p in layer.parameters()]
    return [{"params": others}, {"params": last, "share": SMALL}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """Squared error, and change from frame to frame where the reference has none; of every frame alike, whatever fsr2's
    error in it is. Or the criterion's of the outputs.
    """
    inside = [{} for _ in frames]
    outputs = torch.stack([network.step(frame, inside=seen)[0] for frame, seen in zip(frames, inside)])
    if criterion is not None:
        return criterion(outputs, reference)
    collected, excess = (torch.stack([seen[name] for seen in inside]) for name in ("collected", "excess"))
    weight = 1 / ((collected[:, :, :3] - reference).square().mean(dim=(2, 3, 4), keepdim=True) + EASIEST)
    squared = (outputs - reference).square() + WITHIN * excess.square()
    still = (reference[1:] == reference[:-1]).all(dim=2, keepdim=True)
    change = (outputs[1:] - outputs[:-1]).square() * still
    return 4 * EASIEST * ((weight * squared).mean() + STEADY * (weight[1:] * change).mean() / len(frames))


def model_tensors(network, jitters=None, mlp=False, half=False):
    tensors, metadata = model_file.plain_tensors(network, half)
    if isinstance(network.layers[0], Conditioned):
        tensors["layers.0.weight"] = model_file.rounding(half)(network.layers[0].plain)
    return tensors, metadata


def load_model(tensors, metadata):
    middle = sum(name.endswith(".bias") for name in tensors) - 2
    network = Clarus(int(metadata["scale"]), len(tensors["layers.0.bias"]), middle)
    network.load_state_dict(tensors)
    return network
