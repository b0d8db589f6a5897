"""ENSS (Mercier et al. 2023) as docs/pipelines.md, "ENSS", has it."""

import math
from typing import NamedTuple, Optional

import torch
from torch import nn
import torch.nn.functional as F

from . import history, losses, model_file, operators, quantized
from .layers import through

SIZES = {"s": (16, 1), "m": (32, 3), "l": (64, 5)}  # name: (features f, middle layers m)
CLIPS = [12, 24]
RATE = 2e-3
MLP_LAYERS = 7
ABLATIONS = ("jitter-kernels", "blending", "dilation", "warping")  # what the paper's ablations leave out

WINDOW = 8  # frames that a step learns from


class KernelTable(nn.Module):
    """A set of kernels for each of K jitters; the nearest entry serves."""

    def __init__(self, jitters, kernels):
        super().__init__()
        self.register_buffer("jitters", torch.as_tensor(jitters).clone())
        self.kernels = nn.Parameter(torch.as_tensor(kernels).clone())

    def nearest(self, jitters):
        """The entries' indices."""
        distance = (self.jitters - torch.as_tensor(jitters).to(self.jitters)[:, None]).square().sum(dim=2)
        return distance.argmin(dim=1)

    def forward(self, jitters):
        return self.kernels[self.nearest(jitters)]


class KernelMlp(nn.Module):
    """Kernels as a function of the jitter: dense layers, ReLU after all but the last."""

    def __init__(self, count, hidden, layers=MLP_LAYERS):
        super().__init__()
        widths = [2] + [hidden] * (layers - 1) + [count]
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in zip(widths, widths[1:]))

    def hidden(self, jitters):
        """What the last layer sees, for jitters [K, 2]."""
        x = jitters
        for layer in self.layers[:-1]:
            x = F.relu(layer(x))
        return x

    def forward(self, jitters):
        return self.layers[-1](self.hidden(torch.as_tensor(jitters).to(self.layers[0].weight)))

    @torch.no_grad()
    def fit(self, jitters, wanted, ridge):
        """Chooses the last layer so that jitters [K, 2] give about the kernels `wanted` [K, count]: ridge regression."""
        hidden, bias = self.hidden(jitters).double(), wanted.mean(dim=0)
        mean = hidden.mean(dim=0)
        centred = hidden - mean
        squares = centred.T @ centred + ridge * torch.eye(hidden.shape[1], dtype=hidden.dtype)
        weight = torch.linalg.solve(squares, centred.T @ (wanted - bias).double())
        self.layers[-1].weight.copy_(weight.T)
        self.layers[-1].bias.copy_(bias - (mean @ weight).float())


class Ahead(NamedTuple):
    """What of a frame does not depend on history: its kernels, and where its history is found."""

    kernels: dict
    patches: Optional[tuple] = None
    valid: Optional[torch.Tensor] = None  # per block [N, 1, rows, columns]; None where all motion is
    place: Optional[history.Place] = None  # in place of patches where history is checked


class Enss(nn.Module):
    """The network. `kernels`, a KernelTable or a KernelMlp, makes a list of K jitters into kernels [K, kernel_count].

    Channels of `operators.space_to_depth` hold what has s² values for a render pixel, but for the state. `without`, for
    experiments, names ABLATIONS; such a network is no model that the program knows. `checked` and `held` are those of
    history.py.
    """

    pipeline = "enss"
    tables = ("first", "last")

    def __init__(self, scale, features, middle, kernels, without=(), checked=False, held=False):
        super().__init__()
        self.scale, self.features, self.without, self.checked, self.held = scale, features, without, checked, held
        self.body = nn.ModuleList(nn.Conv2d(features, features, 3, padding=1) for _ in range(middle))
        self.kernels = kernels
        # Layers in whole numbers, with a table of their own (quantized.replace_all).
        self.first = self.last = None
        # Such layers in floating point (quantized.simulate): (scale, zero point) of what they read, tables of weight scales.
        self.quantized = {}

    def kernels_for(self, jitters):
        """By name, a batch of them. Of layers in whole numbers also which "entry" of a table serves; where these are
        simulated, their weight scales.
        """
        kernels = split_kernels(self.kernels(jitters), self.scale, self.features, self.checked)
        if self.first or self.last:
            kernels["entry"] = self.kernels.nearest(jitters)
        for name, (_, weight_scale) in self.quantized.items():
            kernels[f"{name}.weight_scale"] = torch.tensor(weight_scale)[self.kernels.nearest(jitters)]
        return kernels

    def ahead(self, frames):
        """For all of several frames of the same size at once."""
        s, count = self.scale, len(frames)
        jitters = [(0.0, 0.0) if "jitter-kernels" in self.without else frame.jitter for frame in frames]
        kernels = self.kernels_for(jitters)
        kernels = [{name: tensor[t] for name, tensor in kernels.items()} for t in range(count)]
        if self.checked:
            return [Ahead(each, place=place) for each, place in zip(kernels, history.places(frames, s))]
        motion, depth = (torch.cat([getattr(frame, name) for frame in frames]) for name in ("motion", "depth"))
        blocks = self.followed(operators.dilate_blocks(motion, depth, s))
        valid = torch.isfinite(blocks).all(dim=1, keepdim=True)
        patches = operators.block_patches(blocks.masked_fill(~valid, 0), (s * depth.shape[2], s * depth.shape[3]))
        return [
            Ahead(each, parts, None if mask.all() else mask)
            for each, parts, mask in zip(kernels, zip(*(part.chunk(count) for part in patches)), valid.chunk(count))
        ]

    def place(self, ahead):
        """Where history is, where it is checked."""
        return ahead.place

    def followed(self, motion):
        """Motion that history is warped by. Invalid vectors stay invalid."""
        if "warping" not in self.without:
            return motion
        return torch.where(torch.isfinite(motion), torch.zeros_like(motion), motion)

    def step(self, frame, state=None, ahead=None, inside=None):
        """One frame: the output and the new state, [N, 4, H, W] with the output and the feature. `state` None: a reset.

        `ahead` is the frame's, where the caller has it. `inside`, a dict, receives warped, alpha and candidate.
        """
        s = self.scale
        ahead = ahead or self.ahead([frame])[0]
        color, valid = frame.color, ahead.valid
        upsampled = None
        if state is None or self.checked or valid is not None:
            upsampled = F.pad(operators.upsample(color, s, frame.jitter), (0, 0, 0, 0, 0, 1))
        if state is None:
            warped = upsampled
        elif self.checked:
            warped = ahead.place.warp(state, "clamp", upsampled)
        elif "dilation" in self.without:
            motion = self.followed(operators.upsample_motion(frame.motion, s, frame.motion_jitter))
            warped = operators.warp(state, motion, "clamp", upsampled)
        else:
            warped = operators.WarpBlocks.apply(state, *ahead.patches)
            if valid is not None:
                mask = operators.expand_blocks(valid.to(state), state.shape[2:]) > 0
                warped = torch.where(mask, warped, upsampled)
        past = operators.space_to_depth(warped, s)
        validity = None
        if self.checked:
            validity = torch.zeros_like(frame.depth) if state is None else ahead.place.validity
        x = self.layers(self.network_input(frame, past, validity), ahead.kernels).to(color.dtype).contiguous()
        state, alpha, candidate = self.blend(past, x)
        if self.held:
            free, state = state, self.within_range(state, color, warped)
            if inside is not None:
                inside["excess"] = free[:, :3] - state[:, :3]
        if inside is not None:
            seen = dict(warped=past, alpha=alpha, candidate=candidate)
            inside.update({name: operators.depth_to_space(image, s) for name, image in seen.items()})
        return state[:, :3], state

    def within_range(self, state, color, warped):
        return torch.cat((history.hold(state[:, :3], color, warped[:, :3], self.scale), state[:, 3:]), dim=1)

    def network_input(self, frame, past, validity=None):
        color = frame.color
        planes = color.new_tensor(frame.jitter)[:, None, None].expand(color.shape[0], 2, *color.shape[2:])
        return torch.cat((color, frame.depth, planes, *([validity] if self.checked else []), past), dim=1)

    def layers(self, x, kernels):
        """The convolutions, the last without an activation."""
        x = x.contiguous(memory_format=torch.channels_last)
        x = F.relu(self.outer(x, kernels, "first"))
        x = through(self.body, x)
        return self.outer(x, kernels, "last")

    def outer(self, x, kernels, name):
        """The convolution whose kernels depend on the jitter."""
        whole = getattr(self, name)
        if whole is not None:
            return whole(x, int(kernels["entry"]))
        weight = kernels[f"{name}.weight"]
        if name in self.quantized:
            x, weight = quantized.simulated(x, weight, self.quantized[name][0], kernels[f"{name}.weight_scale"])
        return F.conv2d(x, weight, kernels[f"{name}.bias"], padding=1)

    def table(self, name):
        """All entries' weights [K, out, in, 3, 3] and biases [K, out] of the layer "first" or "last"."""
        kernels = split_kernels(self.kernels.kernels.detach(), self.scale, self.features, self.checked)
        return kernels[f"{name}.weight"].clone(), kernels[f"{name}.bias"].clone()

    def sequences(self):
        """Lists of layers, each of which alone reads what the one before it makes."""
        return [[self.first, *self.body, self.last]]

    def blend(self, past, x):
        """The new state of what `layers` returned, not held yet; and α and the candidate, as channels of render pixels."""
        s = self.scale
        alpha, candidate, feature = x.split((s * s, 3 * s * s, s * s), dim=1)
        alpha, warped = torch.sigmoid(alpha), past[:, : 3 * s * s]
        if "blending" in self.without:
            alpha = torch.ones_like(alpha)
        size = (x.shape[0], -1, s * s, *x.shape[2:])
        blended = operators.mix(*(image.reshape(size) for image in (warped, candidate, alpha)))
        output = blended.flatten(1, 2)
        if not self.held:
            output = output.clamp(0, 1)
        return operators.depth_to_space(torch.cat((output, feature), dim=1), s), alpha, candidate


def kernel_shapes(scale, features, checked=False):
    """Shapes of the jitter-conditioned kernels, in the order in which a predicted vector holds them."""
    return {
        "first.weight": (features, 6 + checked + 4 * scale**2, 3, 3),
        "first.bias": (features,),
        "last.weight": (5 * scale**2, features, 3, 3),
        "last.bias": (5 * scale**2,),
    }


def kernel_count(scale, features, checked=False):
    return sum(math.prod(shape) for shape in kernel_shapes(scale, features, checked).values())


def split_kernels(vector, scale, features, checked=False):
    """The kernels by name, of a vector or a batch [..., kernel_count]."""
    result, offset = {}, 0
    for name, shape in kernel_shapes(scale, features, checked).items():
        size = math.prod(shape)
        result[name] = vector[..., offset : offset + size].reshape(*vector.shape[:-1], *shape)
        offset += size
    return result


def join_kernels(kernels):
    """The inverse of `split_kernels` for one set of kernels."""
    return torch.cat([tensor.flatten() for tensor in kernels.values()])


def shape(arguments):
    if arguments.size not in SIZES:
        raise SystemExit("an ENSS network is of --size s, m or l")
    features, middle = SIZES[arguments.size]
    without = tuple(arguments.without)
    checks = dict(checked=arguments.checked, held=arguments.held)
    widths = dict(scale=arguments.scale, features=features, middle=middle, hidden=arguments.hidden)
    return dict(**widths, entries=arguments.entries, without=without, **checks)


def parameter_groups(network, arguments):
    """The MLP's weights apart: each moves a kernel by the sum of many of them, and so is to move less."""
    if isinstance(network.kernels, KernelTable):
        return [{"params": list(network.parameters())}]
    common = [*network.body.parameters(), network.kernels.layers[-1].bias]
    theirs = [p for p in network.kernels.parameters() if all(p is not other for other in common)]
    return [{"params": common, "share": 1.0}, {"params": theirs, "share": arguments.mlp_rate}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """The paper's L1, and with it what keeps still pictures still: losses.followed; or the criterion."""
    if criterion is None:
        return losses.followed(network, frames, reference, WINDOW)
    return losses.of_clip(network, frames, reference, criterion)


def create(scale, features, middle, hidden, without=(), checked=False, held=False, entries=None):
    """A network to be trained: the MLP of `hidden` units a layer starts as the kernels of `starting_kernels`. With
    `entries`, one that a file's weights are to be put into: kernels are a table of so many."""
    count = kernel_count(scale, features, checked)
    if entries is not None:
        table = KernelTable(torch.zeros(entries, 2), torch.zeros(entries, count))
        return Enss(scale, features, middle, table, without, checked, held)
    mlp = KernelMlp(count, hidden)
    network = Enss(scale, features, middle, mlp, without, checked, held)
    with torch.no_grad():
        start_hidden_layers(mlp)
        random = starting_noise(scale, features, checked)
        axis = torch.linspace(-0.5, 0.5, 9)
        jitters = torch.cat((torch.tensor(operators.halton_jitter()), torch.cartesian_prod(axis, axis)))
        wanted = torch.stack([starting_kernels(scale, features, jitter, random) for jitter in jitters.tolist()])
        mlp.fit(jitters, wanted, 1e-3 * len(jitters))
        for layer in network.body:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
            nn.init.zeros_(layer.bias)
            layer.weight[:3] = 0
            for c in range(3):
                layer.weight[c, c, 1, 1] = 1
    return network


def adopt(network, trained):
    """The weights of a model file's network, as a state of `network`: an MLP learns the file's table of kernels."""
    shapes = [(each.scale, each.features, len(each.body), each.checked) for each in (network, trained)]
    if shapes[0] != shapes[1]:
        raise SystemExit("--start: a network of another shape")
    network.body.load_state_dict(trained.body.state_dict())
    if isinstance(trained.kernels, KernelMlp):
        network.kernels.load_state_dict(trained.kernels.state_dict())
    else:
        network.kernels.fit(trained.kernels.jitters, trained.kernels.kernels, 1e-3)
    return network.state_dict()


def start_hidden_layers(mlp):
    """Weights of all layers but the last."""
    for layer in mlp.layers[:-1]:
        nn.init.kaiming_uniform_(layer.weight, nonlinearity="relu")
        nn.init.uniform_(layer.bias, -0.1, 0.1)
    # Jitters are small: a first layer with kinks all over [−½, ½]² tells them apart from the start.
    nn.init.uniform_(mlp.layers[0].weight, -2, 2)
    nn.init.uniform_(mlp.layers[0].bias, -1, 1)


def starting_noise(scale, features, checked=False):
    """Random kernels for everything that `starting_kernels` does not set."""
    kernels = {name: torch.zeros(shape) for name, shape in kernel_shapes(scale, features, checked).items()}
    nn.init.kaiming_normal_(kernels["first.weight"], nonlinearity="relu")
    nn.init.normal_(kernels["last.weight"], std=0.1 / math.sqrt(9 * features))
    return kernels


def starting_kernels(scale, features, jitter, noise):
    """Kernels whose candidate is nearly upsample(colour, s, J), with α highest where the frame's sample lies.

    The first three features carry the colour through; the rest are random. Training starts from a working temporal
    upsampler instead of from noise.
    """
    kernels = {name: tensor.clone() for name, tensor in noise.items()}
    squared = scale * scale
    kernels["first.weight"][:3] = 0
    for c in range(3):
        kernels["first.weight"][c, c, 1, 1] = 1
    for dy in range(scale):
        for dx in range(scale):
            u = (dx + 0.5) / scale - 0.5 - jitter[0]
            v = (dy + 0.5) / scale - 0.5 - jitter[1]
            for ky in range(3):
                for kx in range(3):
                    weight = max(0.0, 1 - abs(u - (kx - 1))) * max(0.0, 1 - abs(v - (ky - 1)))
                    for c in range(3):
                        kernels["last.weight"][(1 + c) * squared + dy * scale + dx, c, ky, kx] += weight
            kernels["last.bias"][dy * scale + dx] = 1 - 2 * scale * math.hypot(u, v)
    return join_kernels(kernels)


def model_tensors(network, jitters=None, mlp=False, half=False):
    """A table of kernels is baked for `jitters` where they are given; the network's own is written where it has one.

    The MLP is written where `mlp` asks for it, or nothing else would be there.
    """
    array = model_file.rounding(half)
    tensors = {}
    for i, layer in enumerate(network.body):
        tensors[f"body.{i}.weight"], tensors[f"body.{i}.bias"] = array(layer.weight), array(layer.bias)
    if isinstance(network.kernels, KernelTable):
        jitters = network.kernels.jitters.tolist()
    elif mlp or jitters is None:
        for i, layer in enumerate(network.kernels.layers):
            tensors[f"mlp.{i}.weight"], tensors[f"mlp.{i}.bias"] = array(layer.weight), array(layer.bias)
    if jitters is not None:
        table = network.kernels(jitters)
        if len(jitters) > 1:  # a single entry serves every jitter
            tensors["jitter"] = torch.tensor(jitters).numpy()
        for name, kernels in split_kernels(table, network.scale, network.features, network.checked).items():
            tensors[name] = array(kernels)
    whole, quantization = quantized.tensors_of(network)
    facts = {"pipeline": "enss", "scale": str(network.scale), "features": str(network.features)}
    return {**tensors, **whole}, {**facts, **history.metadata_of(network), **quantization}


def load_model(tensors, metadata):
    """The network of a model file's content; its table is used where it has one."""
    scale, features = int(metadata["scale"]), int(metadata["features"])
    checks = history.options_of(metadata)
    middle = sum(name.startswith("body.") for name in tensors) // 2
    if "first.weight" in tensors:
        names = kernel_shapes(scale, features, checks["checked"])
        kernels = KernelTable(
            tensors.get("jitter", torch.zeros(1, 2)), torch.cat([tensors[name].flatten(1) for name in names], dim=1)
        )
    else:
        kernels = KernelMlp(kernel_count(scale, features, checks["checked"]), tensors["mlp.0.weight"].shape[0])
        for i, layer in enumerate(kernels.layers):
            layer.load_state_dict({"weight": tensors[f"mlp.{i}.weight"], "bias": tensors[f"mlp.{i}.bias"]})
    network = Enss(scale, features, middle, kernels, **checks)
    for i, layer in enumerate(network.body):
        layer.load_state_dict({"weight": tensors[f"body.{i}.weight"], "bias": tensors[f"body.{i}.bias"]})
    return network
