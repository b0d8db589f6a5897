"""MNSS (Yang et al. 2022) as docs/pipelines.md, "MNSS", has it."""

import torch
from torch import nn
import torch.nn.functional as F

from . import history, losses, model_file, operators
from .layers import convolutions, linear_at_last

CLIPS = [8]
RATE = 1e-3
ABLATIONS = ("history", "recurrence")  # table 6: every frame alone; the previous frame upsampled in place of the output
GUIDED = 0.1  # the share of training in which history is the reference


class Mnss(nn.Module):
    """The network, without what `without` names of ABLATIONS; `checked` and `held` are those of history.py.

    Its state is (S, E): the previous output and upsampled depth, [N, 3, H, W] and [N, 1, H, W].
    """

    pipeline = "mnss"

    def __init__(self, scale, without=(), checked=False, held=False):
        super().__init__()
        self.scale, self.without, self.checked, self.held = scale, without, checked, held
        self.inpaint = nn.Conv2d(4, 1, 3, padding=1)
        self.antialias = convolutions(6, 8, 3)
        self.reconstruct = convolutions(3, 16, 32, 32, 3)

    def ahead(self, frames):
        return history.places(frames, self.scale, self.checked)

    def place(self, ahead):
        return ahead

    def step(self, frame, state=None, ahead=None, inside=None):
        s, jitter, color = self.scale, frame.jitter, frame.color
        place = ahead or self.ahead([frame])[0]
        upsampled, depth = operators.upsample(torch.cat((color, frame.depth), dim=1), s, jitter).split((3, 1), dim=1)
        warped = upsampled
        if state is None or "history" in self.without:
            blended, weight = upsampled, None
        else:
            now = torch.cat((upsampled, depth), dim=1)
            warped, warped_depth = place.warp(torch.cat(state, dim=1), "clamp", now).split((3, 1), dim=1)
            before = operators.pick(torch.cat((warped, warped_depth), dim=1), s, jitter)
            difference = (torch.cat((color, frame.depth), dim=1) - before).abs()
            weight = operators.upsample(torch.sigmoid(self.inpaint(difference)).to(color.dtype), s, jitter)
            blended = operators.mix(warped, upsampled, weight)
        if inside is not None:
            inside.update(history=blended, **({} if weight is None else {"weight": weight}))
        seen = torch.cat((color, F.avg_pool2d(blended, s)), dim=1)
        antialiased = color + linear_at_last(self.antialias, seen).to(color.dtype)
        placed = operators.place(blended, antialiased, s, jitter)
        free = placed + linear_at_last(self.reconstruct, placed).to(color.dtype)
        output = history.hold(free, color, warped, s) if self.held else free.clamp(0, 1)
        if inside is not None:
            inside.update(antialiased=antialiased, excess=free - output)
        return output, (upsampled if "recurrence" in self.without else output, depth)


def shape(arguments):
    if arguments.scale not in (2, 3):
        raise SystemExit("an MNSS network is of --scale 2 or 3")
    return dict(
        scale=arguments.scale, without=tuple(arguments.without), checked=arguments.checked, held=arguments.held
    )


def create(scale, without=(), checked=False, held=False):
    """A network to be trained; it starts as history with the frame's samples in it."""
    network = Mnss(scale, without, checked, held)
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
    Networks with a checked history learn from what losses.Followed has, too.
    """
    outputs, antialiased, state, inside = [], 0, None, {}
    followed = losses.Followed(reference) if network.checked else None
    for t, (frame, ahead) in enumerate(zip(frames, network.ahead(frames))):
        output, state = network.step(frame, state, ahead, inside)
        outputs.append(output)
        if followed:
            followed.add(output, ahead, inside["excess"] if network.held else None)
        antialiased = antialiased + losses.l1(
            inside["antialiased"], operators.pick(reference[t], network.scale, frame.jitter)
        )
        if progress < GUIDED:
            state = (reference[t], state[1])
    total = (criterion or losses.ssim)(torch.stack(outputs), reference) + 5 * antialiased / len(frames)
    return total + followed.cut() if followed else total


def model_tensors(network, jitters=None, mlp=False, half=False):
    return model_file.plain_tensors(network, half, history.metadata_of(network))


def load_model(tensors, metadata):
    network = Mnss(int(metadata["scale"]), **history.options_of(metadata))
    network.load_state_dict(tensors)
    return network
