"""Losses of outputs and references [..., 3, H, W]."""

import functools

import torch
import torch.nn.functional as F

from . import frame, history, operators


def of_clip(network, frames, reference, criterion):
    """The criterion over all frames of a clip that starts with a reset; references [T, N, 3, H, W]."""
    return criterion(torch.stack(frame.run(network, frames)), reference)


l1 = F.l1_loss
l2 = F.mse_loss


def l1_steady(output, reference, weight=1):
    """L1 of consecutive frames [T, …], and as much again, times `weight`, for changes where the reference has none.

    Flicker of a picture that stands still is small against its error, and so hardly counts in L1 alone.
    """
    still = (reference[1:] == reference[:-1]).all(dim=-3, keepdim=True)
    return l1(output, reference) + weight * ((output[1:] - output[:-1]).abs() * still).sum() / output.numel()


l1_steadier = functools.partial(l1_steady, weight=4)


def l1_l2(output, reference):
    """L1, and as much again for an error of 0.1, more for a larger one: ghosts are few, large errors."""
    return l1(output, reference) + 10 * l2(output, reference)


UNCOVERED = 3  # times the weight of a pixel that has no history
STEADY = 1  # of changes along motion, beside the output's error
WITHIN = 0.3  # of what a network shows beyond the range that it is held in
EASIEST = 0.01  # error of a clip's bilinear upsampling below which it counts no more


class Followed:
    """What networks learn from, frame by frame; references [T, N, 3, H, W].

    L1, in which pixels whose checked history is missing count more: they are few, and are what is seen of a moving thing.
    To it the L1 of changes along checked motion where history is valid, which of pixels that stand still are flicker;
    without checked motion, of pixels whose reference stands still. And whatever a range cuts off the output, which
    otherwise had no gradient. `weight` [N]: of each clip.
    """

    def __init__(self, reference, weight=None):
        self.reference, self.t, self.output = reference, 0, None
        self.total, self.count = 0, 0
        self.weight = 1 if weight is None else weight[:, None, None, None]

    def add(self, output, place=None, excess=None):
        """`place`: the frame's history.Place, of a checked history. `excess`: what was cut off."""
        reference = self.reference[self.t]
        error = (output - reference).abs()
        if self.t and place is None:
            before = self.reference[self.t - 1]
            error = error + STEADY * (output - self.output).abs() * (reference == before).all(dim=1, keepdim=True)
        elif self.t:
            has_history = place.has_history()
            error = error * (UNCOVERED + (1 - UNCOVERED) * has_history)
            moved, expected = (operators.sample(each, place.grid) for each in (self.output, self.reference[self.t - 1]))
            error = error + STEADY * ((output - moved) - (reference - expected)).abs() * has_history
        if excess is not None:
            error = error + WITHIN * excess.abs()
        self.total = self.total + (self.weight * error).mean()
        self.output, self.t, self.count = output, self.t + 1, self.count + 1

    def cut(self):
        """The mean of the frames since the last cut; gradients of later ones do not reach across."""
        mean, self.total, self.count = self.total / self.count, 0, 0
        self.output = self.output.detach()
        return mean


def evenness(frames, reference):
    """A weight for each clip [N], so that hard clips and easy ones count alike: by the error of bilinear upsampling.

    Gains are measured in decibels. In plain L1 a few clips of leaves and wires outweigh all others.
    """
    errors = []
    for frame_, wanted in list(zip(frames, reference))[:: max(1, len(frames) // 4)]:
        upsampled = history.upsample(frame_.color, wanted.shape[-1] / frame_.color.shape[-1], frame_.jitter)
        errors.append((upsampled - wanted).abs().mean(dim=(1, 2, 3)))
    return 4 * EASIEST / (torch.stack(errors).mean(dim=0) + EASIEST)


def followed(network, frames, reference, window=None):
    """`Followed` of a clip: for every `window` frames one loss, the whole clip's unless told."""
    window = window or len(frames)
    loss, state = Followed(reference, evenness(frames, reference)), None
    for first in range(0, len(frames), window):
        some = frames[first : first + window]
        for frame_, ahead in zip(some, network.ahead(some)):
            inside = {}
            output, state = network.step(frame_, state, ahead, inside)
            loss.add(output, network.place(ahead), inside.get("excess"))
        yield loss.cut()
        state = detached(state)


def detached(state):
    return state.detach() if torch.is_tensor(state) else tuple(detached(each) for each in state)


def ssim_map(image, reference):
    """Wang et al. 2004: 11×11 Gaussian windows with σ = 1.5 that fit inside the image, per window and channel."""
    channels = image.shape[-3]
    distance = torch.arange(11, dtype=image.dtype, device=image.device) - 5
    window = torch.exp(-(distance**2) / (2 * 1.5**2))
    window = (window / window.sum()).expand(channels, 1, 1, 11)

    def mean(image):
        along_x = F.conv2d(image, window, groups=channels)
        return F.conv2d(along_x, window.transpose(2, 3), groups=channels)

    x, y = (each.flatten(0, -4) for each in (image, reference))
    mean_x, mean_y = mean(x), mean(y)
    variance_x, variance_y, covariance = mean(x * x) - mean_x**2, mean(y * y) - mean_y**2, mean(x * y) - mean_x * mean_y
    c1, c2 = 0.01**2, 0.03**2
    return ((2 * mean_x * mean_y + c1) * (2 * covariance + c2)) / (
        (mean_x**2 + mean_y**2 + c1) * (variance_x + variance_y + c2)
    )


def ssim(output, reference):
    """1 − SSIM, in single precision whatever computes the network."""
    with torch.autocast(output.device.type, enabled=False):
        return 1 - ssim_map(output.float(), reference.float()).mean()


def ssim_l1(output, reference):
    return ssim(output, reference) + l1(output, reference)


def ssim_steadier(output, reference):
    return ssim(output, reference) + l1_steadier(output, reference)


LOSSES = {
    "l1": l1,
    "l2": l2,
    "l1-steady": l1_steady,
    "l1-steadier": l1_steadier,
    "l1-l2": l1_l2,
    "ssim": ssim,
    "ssim-l1": ssim_l1,
    "ssim-steadier": ssim_steadier,
}
