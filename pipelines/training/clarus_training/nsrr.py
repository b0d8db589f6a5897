"""NSRR (Xiao et al. 2020) as the specification's section "NSRR" has it."""

import torch
from torch import nn
import torch.nn.functional as F

from . import losses, operators
from .layers import convolutions, linear_at_last, plain_model_tensors, through

SIZES = {"full": 32, "fast": 16}  # name: width of the U-Net's outermost layers
FEATURES = (32, 32, 8)
REWEIGHTING = 32
CLIPS = [5]
RATE = 1e-4


class UNet(nn.Module):
    def __init__(self, inputs, width):
        super().__init__()
        w = width
        self.enc1 = convolutions(inputs, 2 * w, w)
        self.enc2 = convolutions(w, 2 * w, 2 * w)
        self.bottleneck = convolutions(2 * w, 4 * w, 4 * w)
        self.dec2 = convolutions(6 * w, 2 * w, 2 * w)
        self.dec1 = convolutions(3 * w, w, 3)

    def forward(self, x):
        height, width = x.shape[-2:]
        x = F.pad(x, (0, -width % 4, 0, -height % 4), mode="replicate")
        enc1 = through(self.enc1, x)
        enc2 = through(self.enc2, F.max_pool2d(enc1, 2))
        x = through(self.bottleneck, F.max_pool2d(enc2, 2))
        x = through(self.dec2, torch.cat((operators.upsample(x, 2), enc2), dim=1))
        x = linear_at_last(self.dec1, torch.cat((operators.upsample(x, 2), enc1), dim=1))
        return x[:, :, :height, :width]


class Nsrr(nn.Module):
    """The network. Its state is the list of the previous frames' maps B_1 … B_n, [N, 12, H, W] each."""

    pipeline = "nsrr"
    used = None

    def __init__(self, scale, previous_frames=4, width=32, network_color="ycbcr"):
        super().__init__()
        self.scale, self.previous_frames, self.network_color = scale, previous_frames, network_color
        n, channels = previous_frames, 4 + FEATURES[-1]
        self.features_current = convolutions(4, *FEATURES)
        if n:
            self.features_previous = convolutions(4, *FEATURES)
            self.reweight = convolutions(4 + 4 * n, REWEIGHTING, REWEIGHTING, n)
        self.unet = UNet(channels * (1 + n), width)

    def ahead(self, frames):
        """F^cur and F^prev [N, 12, h, w] of every frame, all frames at once. Without previous frames, no F^prev."""
        color, depth = (torch.cat([getattr(frame, name) for frame in frames]) for name in ("color", "depth"))
        z = torch.cat((operators.ycbcr(color) if self.network_color == "ycbcr" else color, depth), dim=1)
        sets = [self.features_current] + ([self.features_previous] if self.previous_frames else [])
        maps = [torch.cat((z, through(layers, z).to(z.dtype)), dim=1).chunk(len(frames)) for layers in sets]
        return list(zip(*maps))

    def weights(self, raw):
        """How much each previous frame counts, [N, n, H, W], by the first four channels of all frames' maps."""
        return 5 * (torch.tanh(linear_at_last(self.reweight, raw)) + 1)

    def network_output(self, frame, state=None, ahead=None, inside=None):
        """The U-Net's output, in the network's colours, and the new state.

        `used` previous frames, where that is set, instead of all: the maps of the others stay zero.
        """
        s, n = self.scale, self.previous_frames
        used = n if self.used is None else self.used
        current, *previous = ahead or self.ahead([frame])[0]
        if inside is not None:
            inside["features"] = current[:, 4:]
        current = operators.zero_upsample(current, s, frame.jitter)
        history = []
        if n and state is None:
            history = [torch.zeros_like(current)] * n
        elif n:
            motion = operators.upsample_motion(frame.motion, s, frame.motion_jitter)
            maps = operators.warp(torch.cat(state, dim=1), motion, "zero", 0)
            history = list(maps.chunk(n, dim=1))
        history[used:] = [torch.zeros_like(image) for image in history[used:]]
        weighted = []
        if n:
            weights = self.weights(torch.cat([image[:, :4] for image in (current, *history)], dim=1))
            weighted = [weights[:, i : i + 1] * image for i, image in enumerate(history)]
            if inside is not None and used:
                inside["weights"], inside["warped"] = weights[:, :used], torch.cat(history[:used], dim=1)
            history = [operators.zero_upsample(previous[0], s, frame.jitter), *history[:-1]]
        return self.unet(torch.cat((current, *weighted), dim=1)).to(frame.color.dtype), history

    def step(self, frame, state=None, ahead=None, inside=None):
        output, state = self.network_output(frame, state, ahead, inside)
        if inside is not None:
            inside["network_output"] = output
        return (operators.rgb(output) if self.network_color == "ycbcr" else output).clamp(0, 1), state


def shape(arguments):
    if arguments.size not in SIZES:
        raise SystemExit("an NSRR network is of --size full or fast")
    return dict(
        scale=arguments.scale,
        previous_frames=arguments.previous_frames,
        width=SIZES[arguments.size],
        network_color=arguments.network_color,
    )


def create(**shape):
    """A network to be trained, its weights as Glorot and Bengio have them."""
    network = Nsrr(**shape)
    for module in network.modules():
        if isinstance(module, nn.Conv2d):
            nn.init.xavier_uniform_(module.weight)
            nn.init.zeros_(module.bias)
    return network


def parameter_groups(network, arguments):
    return [{"params": list(network.parameters())}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """Of the clip's last frame, which has all the history there is, and in the network's colours.

    The paper's is 1 − SSIM plus a perceptual term, whose weights are not part of this project: L1 is in its place.
    """
    state = None
    for frame, ahead in zip(frames, network.ahead(frames)):
        output, state = network.network_output(frame, state, ahead)
    wanted = operators.ycbcr(reference[-1]) if network.network_color == "ycbcr" else reference[-1]
    return (criterion or losses.ssim_l1)(output, wanted)


def model_tensors(network, jitters=None, mlp=False, half=False):
    facts = {"previous_frames": network.previous_frames, "network_color": network.network_color}
    return plain_model_tensors(network, half, facts)


def load_model(tensors, metadata):
    width = tensors["unet.enc1.1.bias"].shape[0]
    network = Nsrr(int(metadata["scale"]), int(metadata["previous_frames"]), width, metadata["network_color"])
    network.load_state_dict(tensors)
    return network
