"""NSRR (Xiao et al. 2020) as docs/pipelines.md, "NSRR", has it."""

import torch
from torch import nn
import torch.nn.functional as F

from . import history as checks, losses, model_file, operators
from .layers import convolutions, linear_at_last, through

SIZES = {"full": 32, "fast": 16}  # name: width of the U-Net's outermost layers
FEATURES = (32, 32, 8)
REWEIGHTING = 32
ABLATIONS = ("features", "reweighting")  # table 10: features are 0, weights are 1
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
        if width % 4 or height % 4:
            x = F.pad(x, (0, -width % 4, 0, -height % 4), mode="replicate")
        enc1 = through(self.enc1, x)
        enc2 = through(self.enc2, F.max_pool2d(enc1, 2))
        x = through(self.bottleneck, F.max_pool2d(enc2, 2))
        x = through(self.dec2, torch.cat((operators.upsample(x, 2), enc2), dim=1))
        x = linear_at_last(self.dec1, torch.cat((operators.upsample(x, 2), enc1), dim=1))
        return x[:, :, :height, :width]


class Nsrr(nn.Module):
    """The network, without what `without` names of ABLATIONS; `checked` and `held` are those of history.py.

    Its state is the list of the previous frames' maps B_1 …, [N, 12, H, W] each, n at most; where the range is held,
    the previous output [N, 3, H, W] is before them.
    """

    pipeline = "nsrr"
    used = None

    def __init__(self, scale, previous_frames=4, width=32, network_color="ycbcr", without=(), checked=False, held=False):
        super().__init__()
        self.checked, self.held = checked, held
        self.scale, self.previous_frames = scale, previous_frames
        self.network_color, self.without = network_color, without
        n, channels = previous_frames, 4 + FEATURES[-1]
        self.features_current = convolutions(4, *FEATURES)
        if n:
            self.features_previous = convolutions(4, *FEATURES)
            self.reweight = convolutions(4 + 4 * n, REWEIGHTING, REWEIGHTING, n)
        self.unet = UNet(channels * (1 + n), width)

    def ahead(self, frames):
        """Of every frame, all frames at once: F^cur and F^prev [N, 12, h, w], the latter where there are previous frames,
        and where its history is."""
        color, depth = (torch.cat([getattr(frame, name) for frame in frames]) for name in ("color", "depth"))
        z = torch.cat((operators.ycbcr(color) if self.network_color == "ycbcr" else color, depth), dim=1)
        sets = [self.features_current] + ([self.features_previous] if self.previous_frames else [])
        share = 0 if "features" in self.without else 1
        maps = [torch.cat((z, share * through(layers, z).to(z.dtype)), dim=1).chunk(len(frames)) for layers in sets]
        return list(zip(zip(*maps), checks.places(frames, self.scale, self.checked)))

    def place(self, ahead):
        return ahead[1]

    def weights(self, raw):
        """How much each previous frame counts, [N, n, H, W], by the first four channels of all frames' maps."""
        return 5 * (torch.tanh(linear_at_last(self.reweight, raw)) + 1)

    def maps(self, frame, state=None, ahead=None):
        """The zero-upsampled current map, the warped history B_1 …, as far as there is one, and the new state."""
        s, n = self.scale, self.previous_frames
        features, place = ahead or self.ahead([frame])[0]
        current, *previous = (operators.zero_upsample(each, s, frame.jitter) for each in features)
        history = []
        if state:
            history = list(place.warp(torch.cat(state, dim=1), "zero", 0).chunk(len(state), dim=1))
        return current, history, (previous + history)[:n]

    def network_output(self, current, history, inside=None):
        """The U-Net's output, in the network's colours.

        `used` previous frames, where that is set, instead of all: the maps of the others are zero.
        """
        n = self.previous_frames
        used = n if self.used is None else self.used
        history = history[:used]
        history += [torch.zeros_like(current)] * (n - len(history))
        weighted = []
        if n:
            weights = self.weights(torch.cat([image[:, :4] for image in (current, *history)], dim=1))
            if "reweighting" in self.without:
                weights = torch.ones_like(weights)
            weighted = [weights[:, i : i + 1] * image for i, image in enumerate(history)]
            if inside is not None and used:
                inside["weights"], inside["warped"] = weights[:, :used], torch.cat(history[:used], dim=1)
        return self.unet(torch.cat((current, *weighted), dim=1)).to(current.dtype)

    def step(self, frame, state=None, ahead=None, inside=None):
        ahead = ahead or self.ahead([frame])[0]
        before, maps = (state[:1], state[1:]) if self.held and state else ([], state)
        current, history, maps = self.maps(frame, maps, ahead)
        output = self.network_output(current, history, inside)
        if inside is not None:
            inside["features"], inside["network_output"] = ahead[0][0][:, 4:], output
        free = operators.rgb(output) if self.network_color == "ycbcr" else output
        if not self.held:
            return free.clamp(0, 1), maps
        seen = operators.upsample(frame.color, self.scale, frame.jitter)
        if before:
            seen = ahead[1].warp(before[0], "clamp", seen)
        output = checks.hold(free, frame.color, seen, self.scale)
        if inside is not None:
            inside["excess"] = free - output
        return output, [output, *maps]


def shape(arguments):
    if arguments.size not in SIZES:
        raise SystemExit("an NSRR network is of --size full or fast")
    return dict(
        scale=arguments.scale,
        previous_frames=arguments.previous_frames,
        width=SIZES[arguments.size],
        network_color=arguments.network_color,
        without=tuple(arguments.without),
        checked=arguments.checked,
        held=arguments.held,
    )


def create(**shape):
    """A network to be trained, its weights as Glorot and Bengio have them, but for a way through the U-Net.

    Three channels pass the colours on: through the level at which pooling has found the one sample of every 2×2 or 4×4
    pixels, so that training starts at about the bilinearly upsampled colour, not at noise.
    """
    network = Nsrr(**shape)
    for module in network.modules():
        if isinstance(module, nn.Conv2d):
            nn.init.xavier_uniform_(module.weight)
            nn.init.zeros_(module.bias)
    unet = network.unet
    with torch.no_grad():
        for layer in (*unet.enc1, *unet.enc2, *unet.bottleneck, *unet.dec2, *unet.dec1):
            layer.weight[:3] = 0
            from_skip = unet.bottleneck[-1].out_channels if layer is unet.dec2[0] and network.scale < 4 else 0
            layer.weight[range(3), range(from_skip, from_skip + 3), 1, 1] = 1
    return network


def parameter_groups(network, arguments):
    return [{"params": list(network.parameters())}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """Of the clip's last frame, which has all the history there is, and in the network's colours.

    The paper's is 1 − SSIM plus a perceptual term, whose weights are not part of this project: L1 is in its place.
    Networks with a checked history learn from the last two frames, by losses.Followed and 1 − SSIM.
    """
    steps, state = list(zip(frames, network.ahead(frames))), []
    judged = steps[-2:] if network.checked else []
    for frame, ahead in steps[: len(steps) - len(judged)]:
        current, history, state = network.maps(frame, state, ahead)
    if network.checked:
        followed, inside = losses.Followed(reference[-2:]), {}
        if network.held and len(steps) > 2:  # the reference, in place of an output that would cost as much as the others
            state = [reference[-3], *state]
        for frame, ahead in judged:
            output, state = network.step(frame, state, ahead, inside)
            followed.add(output, network.place(ahead), inside.get("excess"))
        return (criterion or losses.ssim)(output, reference[-1]) + followed.cut()
    output = network.network_output(current, history)
    wanted = operators.ycbcr(reference[-1]) if network.network_color == "ycbcr" else reference[-1]
    return (criterion or losses.ssim_l1)(output, wanted)


def model_tensors(network, jitters=None, mlp=False, half=False):
    facts = {"previous_frames": network.previous_frames, "network_color": network.network_color}
    facts.update(checks.metadata_of(network))
    return model_file.plain_tensors(network, half, facts)


def load_model(tensors, metadata):
    width = tensors["unet.enc1.1.bias"].shape[0]
    network = Nsrr(int(metadata["scale"]), int(metadata["previous_frames"]), width, metadata["network_color"])
    network.checked, network.held = checks.options_of(metadata).values()
    network.load_state_dict(tensors)
    return network
