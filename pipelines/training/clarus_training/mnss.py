"""MNSS (Yang et al. 2022) as the specification's section "MNSS" has it."""

import torch
from torch import nn
import torch.nn.functional as F

from . import losses, operators
from .layers import convolutions, linear_at_last

CLIPS = [8]
RATE = 1e-3
ABLATIONS = ("history", "recurrence")  # table 6: every frame alone; the previous frame upsampled in place of the output
GUIDED = 0.1  # the share of training in which history is the reference


class Mnss(nn.Module):
    """The network, without what `without` names of ABLATIONS.

    Its state is (S, E): the previous output and upsampled depth, [N, 3, H, W] and [N, 1, H, W].
    """

    pipeline = "mnss"

    def __init__(self, scale, without=()):
        super().__init__()
        self.scale, self.without = scale, without
        self.inpaint = nn.Conv2d(4, 1, 3, padding=1)
        self.antialias = convolutions(6, 8, 3)
        self.reconstruct = convolutions(3, 16, 32, 32, 3)

    def ahead(self, frames):
        return [None] * len(frames)

    def step(self, frame, state=None, ahead=None, inside=None):
        s, jitter, color = self.scale, frame.jitter, frame.color
        upsampled, depth = operators.upsample(torch.cat((color, frame.depth), dim=1), s, jitter).split((3, 1), dim=1)
        if state is None or "history" in self.without:
            history, weight = upsampled, None
        else:
            motion = operators.upsample_motion(frame.motion, s, frame.motion_jitter)
            now = torch.cat((upsampled, depth), dim=1)
            warped, warped_depth = operators.warp(torch.cat(state, dim=1), motion, "clamp", now).split((3, 1), dim=1)
            before = operators.pick(torch.cat((warped, warped_depth), dim=1), s, jitter)
            difference = (torch.cat((color, frame.depth), dim=1) - before).abs()
            weight = operators.upsample(torch.sigmoid(self.inpaint(difference)).to(color.dtype), s, jitter)
            history = operators.mix(warped, upsampled, weight)
        seen = torch.cat((color, F.avg_pool2d(history, s)), dim=1)
        antialiased = color + linear_at_last(self.antialias, seen).to(color.dtype)
        blended = operators.place(history, antialiased, s, jitter)
        output = (blended + linear_at_last(self.reconstruct, blended).to(color.dtype)).clamp(0, 1)
        if inside is not None:
            inside.update(history=history, antialiased=antialiased, **({} if weight is None else {"weight": weight}))
        return output, (upsampled if "recurrence" in self.without else output, depth)


def shape(arguments):
    if arguments.scale not in (2, 3):
        raise SystemExit("an MNSS network is of --scale 2 or 3")
    return dict(scale=arguments.scale, without=tuple(arguments.without))


def create(scale, without=()):
    """A network to be trained; it starts as history with the frame's samples in it."""
    network = Mnss(scale, without)
    with torch.no_grad():
        for layer in (network.antialias[-1], network.reconstruct[-1]):
            layer.weight.mul_(0.1)
            nn.init.zeros_(layer.bias)
    return network


def parameter_groups(network, arguments):
    return [{"params": list(network.parameters())}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """The paper's 1 − SSIM and five times the antialiased samples' L1, over all frames, without its perceptual term.

    That one's weights are not part of this project. For the first tenth of the training the reference is the history.
    """
    outputs, antialiased, state, inside = [], 0, None, {}
    for t, frame in enumerate(frames):
        output, state = network.step(frame, state, inside=inside)
        outputs.append(output)
        antialiased = antialiased + losses.l1(
            inside["antialiased"], operators.pick(reference[t], network.scale, frame.jitter)
        )
        if progress < GUIDED:
            state = (reference[t], state[1])
    return (criterion or losses.ssim)(torch.stack(outputs), reference) + 5 * antialiased / len(frames)
