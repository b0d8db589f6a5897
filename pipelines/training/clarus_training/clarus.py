"""The project's own network, as docs/clarus.md has it: what fsr2 has collected, and what a small network adds to it."""

import torch
from torch import nn
import torch.nn.functional as F

from . import fsr2, history, model_file, operators
from .layers import convolutions, linear_at_last

GRIDS = [2, 3, 4]  # the least that reaches a scale, or nearly, for sizes are rounded, is the one of its network
REACH = 1.01
SIZES = {"s": (16, 1), "m": (32, 3)}  # name: (features, middle layers)
CLIPS = [2]
ABLATIONS = ("differences", "color", "jitter", "trust", "weights")  # the last four: 0 in their place
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


def conditions(grid):
    """Of colour, jitter, trust and the history's pixels: colours as differences from their mean, and that mean."""
    squared = grid * grid
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
    """Its state is fsr2's: what was sampled, and the weight of it. What the network adds is never sampled again.

    `shapes` are (features, middle layers) by the grid that a network is for. `scale` may be any real one up to the
    largest grid; of a network for "any" it is whatever is asked of it next.
    """

    pipeline = "clarus"
    collects = True  # its frames come with what fsr2 has made of them, where that is known

    def __init__(self, scale, shapes, conditioned=False, without=()):
        super().__init__()
        self.without = tuple(without)
        self.any_scale = scale == "any"
        self.scale, self.grids = min(shapes) if self.any_scale else scale, sorted(shapes)
        for grid, (features, middle) in shapes.items():
            layers = convolutions(6 + 4 * grid * grid, *[features] * (1 + middle), 3 * grid * grid)
            if conditioned:
                layers[0] = Conditioned(conditions(grid), features)
            self.add_module(f"x{grid}", layers)

    @property
    def grid(self):
        """That of the network for `scale`."""
        return next(grid for grid in self.grids if REACH * grid >= self.scale)

    @property
    def layers(self):
        return getattr(self, f"x{self.grid}")

    def ahead(self, frames):
        return [None] * len(frames)

    def step(self, frame, state=None, ahead=None, inside=None):
        s, grid, color = self.scale, self.grid, frame.color
        if frame.collected is not None:
            collected, trust = frame.collected, frame.trust
        else:
            collected, trust = fsr2.step(frame, state, s)
        planes = color.new_tensor(frame.jitter)[:, None, None].expand(len(color), 2, *color.shape[2:])
        on_grid, whole = collected, None
        if s != grid:
            on_grid = operators.keys_resample(collected, grid / s, [grid * side for side in color.shape[2:]])
            whole = on_grid[:, :3], grid
        parts = dict(color=color, jitter=planes, trust=trust, history=on_grid[:, :3], weights=on_grid[:, 3:])
        parts.update((name, torch.zeros_like(parts[name])) for name in self.without if name in parts)
        on_grid = torch.cat((parts["history"], parts["weights"]), dim=1)
        frame_and_trust = (parts["color"], parts["jitter"], parts["trust"])
        seen = torch.cat((*frame_and_trust, operators.space_to_depth(on_grid, grid)), dim=1)
        details = operators.depth_to_space(self.network(seen).to(color.dtype), grid)
        if s != grid:
            details = operators.keys_resample(details, s / grid, collected.shape[2:])
        free = collected[:, :3] + details
        output = history.hold(free, color, collected[:, :3], s if whole else grid, whole)
        if inside is not None:
            inside.update(collected=collected, trust=trust, details=details, excess=free - output)
        return output, collected

    def network(self, seen):
        return linear_at_last(self.layers, seen)


def serves(asked, scale):
    """A network learns at the scales that it is used for."""
    return asked - 1 < scale <= asked


def shape(arguments):
    if arguments.size not in SIZES:
        raise SystemExit("a network of pipeline clarus is of --size s or m")
    if arguments.events:
        raise SystemExit("--events: what fsr2 makes of sequences is computed once, without events")
    features, middle = SIZES[arguments.size]
    return dict(scale=arguments.scale, features=features, middle=middle, without=arguments.without)


def create(scale, features, middle, without=()):
    """A network to be trained; it starts as fsr2."""
    network = Clarus(scale, {scale: (features, middle)}, "differences" not in without, without)
    for layer in network.layers:
        nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
        nn.init.zeros_(layer.bias)
    nn.init.zeros_(network.layers[-1].weight)
    return network


def joined(networks):
    """One for any scale, of those of every grid. One of several grids has what no other has."""
    chosen = {}
    for each in sorted(networks, key=lambda each: len(each.grids)):
        for grid in each.grids:
            if grid in chosen and len(each.grids) == 1:
                raise SystemExit(f"--join: two networks of scale {grid}")
            chosen.setdefault(grid, each)
    if sorted(chosen) != GRIDS:
        raise SystemExit(f"--join: a network of each of the scales {GRIDS} makes one of any, not of {sorted(chosen)}")
    parts = {grid: getattr(each, f"x{grid}") for grid, each in chosen.items()}
    result = Clarus("any", {grid: (len(layers[0].bias), len(layers) - 2) for grid, layers in parts.items()})
    for grid, layers in parts.items():
        ours = getattr(result, f"x{grid}")
        first = layers[0].plain if isinstance(layers[0], Conditioned) else layers[0].weight
        ours[0].load_state_dict({"weight": first, "bias": layers[0].bias})
        ours[1:].load_state_dict(layers[1:].state_dict())
    return result


def adopt(network, trained):
    """The weights of a model file's network for the same grid, as a state of `network`."""
    trained.scale = network.scale
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
    network.scale = reference.shape[-1] / frames[0].color.shape[-1]
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
    scale = {"scale": "any"} if network.any_scale else {}
    tensors, metadata = model_file.plain_tensors(network, half, scale)
    for grid in network.grids:
        first = getattr(network, f"x{grid}")[0]
        if isinstance(first, Conditioned):
            tensors[f"x{grid}.0.weight"] = model_file.rounding(half)(first.plain)
    return tensors, metadata


def load_model(tensors, metadata):
    shapes = {}
    for grid in GRIDS:
        biases = [tensors[name] for name in tensors if name.startswith(f"x{grid}.") and name.endswith(".bias")]
        if biases:
            shapes[grid] = (len(tensors[f"x{grid}.0.bias"]), len(biases) - 2)
    network = Clarus(metadata["scale"] if metadata["scale"] == "any" else float(metadata["scale"]), shapes)
    network.load_state_dict(tensors)
    return network
