"""ENSS (Mercier et al. 2023) as the specification's section "ENSS" has it."""

import math

import torch
from torch import nn
import torch.nn.functional as F

from . import operators

SIZES = {"s": (16, 1), "m": (32, 3), "l": (64, 5)}  # name: (features f, middle layers m)
MLP_LAYERS = 7


class KernelTable(nn.Module):
    """A set of kernels for each of K jitters; the nearest entry serves."""

    def __init__(self, jitters, kernels):
        super().__init__()
        self.register_buffer("jitters", torch.as_tensor(jitters).clone())
        self.kernels = nn.Parameter(torch.as_tensor(kernels).clone())

    def forward(self, jitters):
        distance = (self.jitters - self.jitters.new_tensor(jitters)[:, None]).square().sum(dim=2)
        return self.kernels[distance.argmin(dim=1)]


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
        return self.layers[-1](self.hidden(self.layers[0].weight.new_tensor(jitters)))


class Enss(nn.Module):
    """The network. `kernels`, a KernelTable or a KernelMlp, makes a list of K jitters into kernels [K, kernel_count]."""

    def __init__(self, scale, features, middle, kernels):
        super().__init__()
        self.scale, self.features = scale, features
        self.body = nn.ModuleList(nn.Conv2d(features, features, 3, padding=1) for _ in range(middle))
        self.kernels = kernels

    def step(self, color, depth, motion, jitter, state=None, inside=None, kernels=None):
        """One frame, batched: colour [N, 3, h, w], canonical depth and motion; `state` None after a reset.

        Returns the new state, (output, feature) at output resolution. `inside`, a dict, receives warped, alpha and
        candidate. `kernels` are the jitter's, where the caller has them.
        """
        s = self.scale
        if state is None:
            warped = operators.upsample(color, s, jitter)
            warped = torch.cat((warped, torch.zeros_like(warped[:, :1])), dim=1)
        else:

            def fallback():
                upsampled = operators.upsample(color, s, jitter)
                return torch.cat((upsampled, torch.zeros_like(upsampled[:, :1])), dim=1)

            warped = operators.warp(torch.cat(state, dim=1), operators.dilate(motion, depth, s), fallback)
        planes = color.new_tensor(jitter)[None, :, None, None].expand(color.shape[0], 2, *color.shape[2:])
        x = torch.cat((color, depth, planes, operators.space_to_depth(warped, s)), dim=1)
        kernels = self.kernels([jitter])[0] if kernels is None else kernels
        weights = split_kernels(kernels, s, self.features)
        x = F.relu(F.conv2d(x, weights["first.weight"], weights["first.bias"], padding=1))
        for layer in self.body:
            x = F.relu(layer(x))
        x = operators.depth_to_space(F.conv2d(x, weights["last.weight"], weights["last.bias"], padding=1), s)
        alpha, candidate, feature = torch.sigmoid(x[:, :1]), x[:, 1:4], x[:, 4:]
        output = (alpha * candidate + (1 - alpha) * warped[:, :3]).clamp(0, 1)
        if inside is not None:
            inside.update(warped=warped, alpha=alpha, candidate=candidate)
        return output, feature


def kernel_shapes(scale, features):
    """Shapes of the jitter-conditioned kernels, in the order in which a predicted vector holds them."""
    return {
        "first.weight": (features, 6 + 4 * scale**2, 3, 3),
        "first.bias": (features,),
        "last.weight": (5 * scale**2, features, 3, 3),
        "last.bias": (5 * scale**2,),
    }


def kernel_count(scale, features):
    return sum(math.prod(shape) for shape in kernel_shapes(scale, features).values())


def split_kernels(vector, scale, features):
    """The kernels by name, of a vector or a batch [..., kernel_count]."""
    result, offset = {}, 0
    for name, shape in kernel_shapes(scale, features).items():
        size = math.prod(shape)
        result[name] = vector[..., offset : offset + size].reshape(*vector.shape[:-1], *shape)
        offset += size
    return result


def join_kernels(kernels):
    """The inverse of `split_kernels` for one set of kernels."""
    return torch.cat([tensor.flatten() for tensor in kernels.values()])


def create(scale, features, middle, hidden):
    """A network to be trained: the MLP of `hidden` units a layer starts as the kernels of `starting_kernels`."""
    mlp = KernelMlp(kernel_count(scale, features), hidden)
    network = Enss(scale, features, middle, mlp)
    with torch.no_grad():
        for layer in mlp.layers[:-1]:
            nn.init.kaiming_uniform_(layer.weight, nonlinearity="relu")
            nn.init.uniform_(layer.bias, -0.1, 0.1)
        # Jitters are small: a first layer with kinks all over [−½, ½]² tells them apart from the start.
        nn.init.uniform_(mlp.layers[0].weight, -2, 2)
        nn.init.uniform_(mlp.layers[0].bias, -1, 1)
        random = starting_noise(scale, features)
        axis = torch.linspace(-0.5, 0.5, 9)
        jitters = torch.cat((torch.tensor(operators.halton_jitter()), torch.cartesian_prod(axis, axis)))
        wanted = torch.stack([starting_kernels(scale, features, jitter, random) for jitter in jitters.tolist()])
        hidden_values = mlp.hidden(jitters).double()
        bias = wanted.mean(dim=0)
        ridge = 1e-3 * len(jitters) * torch.eye(hidden, dtype=torch.float64)
        centred = hidden_values - hidden_values.mean(dim=0)
        fit = torch.linalg.solve(centred.T @ centred + ridge, centred.T @ (wanted - bias).double())
        mlp.layers[-1].weight.copy_(fit.T)
        mlp.layers[-1].bias.copy_(bias - (hidden_values.mean(dim=0) @ fit).float())
        for layer in network.body:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
            nn.init.zeros_(layer.bias)
            layer.weight[:3] = 0
            for c in range(3):
                layer.weight[c, c, 1, 1] = 1
    return network


def starting_noise(scale, features):
    """Random kernels for everything that `starting_kernels` does not set."""
    kernels = {name: torch.zeros(shape) for name, shape in kernel_shapes(scale, features).items()}
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
