"""The project's own network (docs/clarus.md): it learns how to filter the frame and how far to trust the history."""

import torch
from torch import nn
import torch.nn.functional as F

from . import history, losses, model_file, operators
from .layers import convolutions

SIZES = {"s": (16, 2), "m": (32, 3)}  # name: (width, middle layers)
CLIPS = [24]
WINDOW = 8  # frames that a step learns from
RATE = 2e-3
SCALES = (1.3, 4)  # it learns all of them at once
SENSED = 9  # channels of `sense`
PARAMETERS = 17  # channels of what `compose` is told
FEATURES = 4  # channels that are handed on to the next frame
MOST = 64.0  # the largest weight of a history
SPREAD = 0.45  # of a sample, in output pixels
STARTING_BIASES = (0.0, 0.0, 0.0, -1.0, 0.0, -4.0, 3.0, 3.0)  # of the parameters that are not colours


class Clarus(nn.Module):
    """The network, for any scale: `scale` may change from clip to clip.

    Its state is (S, f): the previous output and its weight, [N, 4, H, W], and features, [N, 4, h, w].
    """

    pipeline = "clarus"
    checked, held = True, True

    def __init__(self, scale, width, middle):
        super().__init__()
        self.scale = scale
        inputs = 3 + SENSED + 1 + 3 + FEATURES
        self.layers = convolutions(inputs, *[width] * (middle + 1), PARAMETERS + FEATURES)

    def ahead(self, frames):
        return history.places(frames, self.scale)

    def place(self, ahead):
        return ahead

    def step(self, frame, state=None, ahead=None, inside=None):
        s, color = self.scale, frame.color
        place = ahead or self.ahead([frame])[0]
        upsampled = F.pad(history.upsample(color, s, frame.jitter), (0, 0, 0, 0, 0, 1))
        if state is None:
            past, validity = upsampled, torch.zeros_like(frame.depth)
            features = color.new_zeros(color.shape[0], FEATURES, *color.shape[2:])
        else:
            image, features = state
            past = torch.where(place.has_history() > 0, warp_sharply(image, place.grid), upsampled)
            features = operators.warp(features, place.checked, "zero", 0)
            validity = place.validity
        sensed = sense(past, frame.depth, frame.jitter)
        planes = color.new_tensor((*frame.jitter, s))[:, None, None].expand(color.shape[0], 3, *color.shape[2:])
        x = torch.cat((color, sensed, validity, planes, features), dim=1)
        x = self.predict(x.contiguous(memory_format=torch.channels_last)).to(color.dtype).contiguous()
        parameters, features = x.split((PARAMETERS, FEATURES), dim=1)
        with torch.autocast(color.device.type, enabled=False):
            state, excess = compose(color, past, parameters, s, frame.jitter)
        if inside is not None:
            inside.update(excess=excess, weight=state[:, 3:])
        return state[:, :3], (state, torch.tanh(features))

    def predict(self, x):
        for layer in self.layers[:-1]:
            x = F.relu(layer(x))
        return self.layers[-1](x)


def luma(image):
    return 0.299 * image[:, :1] + 0.587 * image[:, 1:2] + 0.114 * image[:, 2:3]


def warp_sharply(image, grid):
    """Colour [N, 0:3] by Catmull and Rom's kernel without its four corners, clamped to [0, 1]; the weight bilinearly.

    The twelve taps of the former are five bilinear look-ups. Its gradient is that of the bilinear kernel, which is a
    fifth of the work.
    """
    bilinear = operators.sample(image, grid)
    with torch.no_grad():
        sharp = sharply(image[:, :3], grid).clamp(0, 1) - bilinear[:, :3]
    return bilinear + F.pad(sharp, (0, 0, 0, 0, 0, 1))


def sharply(image, grid):
    size = grid.new_tensor([image.shape[3], image.shape[2]])
    place = (grid + 1) * size / 2 - 0.5
    whole = place.floor()
    t = place - whole
    before, after = t * (-0.5 + t * (1 - 0.5 * t)), t * t * (-0.5 + 0.5 * t)
    second = t * (0.5 + t * (2 - 1.5 * t))
    middle = 1 + t * t * (-2.5 + 1.5 * t) + second
    between = whole + second / middle

    def look_up(x, y, weight_x, weight_y):
        at = torch.stack((x, y), dim=-1)
        weight = (weight_x * weight_y)[:, None]
        return weight * operators.sample(image, (at + 0.5) * 2 / size - 1), weight

    (x, y), (wx, wy) = between.unbind(dim=-1), middle.unbind(dim=-1)
    taps = [
        look_up(x, y, wx, wy),
        look_up(whole[..., 0] - 1, y, before[..., 0], wy),
        look_up(whole[..., 0] + 2, y, after[..., 0], wy),
        look_up(x, whole[..., 1] - 1, wx, before[..., 1]),
        look_up(x, whole[..., 1] + 2, wx, after[..., 1]),
    ]
    return sum(value for value, _ in taps) / sum(weight for _, weight in taps)


def sense(past, depth, jitter):
    """What the network sees of the history, for every render pixel.

    Colour and log2(1 + weight) / 4 where the pixel's sample was taken; luma a quarter of a render pixel from its centre,
    up and down, left and right; and how much nearer the nearest of the 3×3 pixels around is.
    """
    count, _, height, width = depth.shape

    def at(image, x, y):
        """That far from every pixel's centre; several places side by side."""
        x, y = (past.new_tensor(each).reshape(1, -1, 1) for each in (x, y))
        column = (torch.arange(width, dtype=image.dtype, device=image.device) + 0.5 + x) * 2 / width - 1
        row = (torch.arange(height, dtype=image.dtype, device=image.device)[:, None, None] + 0.5 + y) * 2 / height - 1
        grid = torch.stack((column.expand(height, -1, -1), row.expand(-1, -1, width)), dim=-1).flatten(1, 2)
        return operators.sample(image, grid.expand(count, -1, -1, -1))

    here = at(past, *jitter)
    quarters = at(luma(past), *zip((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)))
    quarters = quarters.unflatten(3, (4, width)).movedim(3, 2)[:, 0]
    nearest = -F.max_pool2d(-depth, 3, 1, 1)
    edge = 1 - nearest / depth.clamp(min=1e-6)
    return torch.cat((here[:, :3], torch.log2(1 + here[:, 3:]) / 4, quarters, edge), dim=1)


def compose(color, past, parameters, scale, jitter):
    """The new history [N, 4, H, W], its first three channels the output; and what the range cut off the estimate."""
    height, width = color.shape[-2:]
    u, v = history.output_coordinates(color, scale, past.shape[-2:], jitter)
    u, v = u[0, 0, 0], v[0, 0, :, 0]
    column, row = history.nearest_index(u, width), history.nearest_index(v, height)
    x, y = u - column, (v - row)[:, None]  # from the nearest sample, in render pixels
    offset = torch.arange(-1, 2, dtype=x.dtype, device=x.device)
    fx, fy = (offset[:, None] - x)[None, :, None], (offset[:, None, None] - y)[:, None]  # of 3×3 samples
    with torch.no_grad():
        around = F.pad(color, (1, 1, 1, 1), mode="replicate")
        around = [around[:, :, dy : dy + height, dx : dx + width] for dy in range(3) for dx in range(3)]
        seen = torch.stack(around, dim=1)[:, :, :, row][..., column]  # [N, 9, 3, H, W]
    nearest = matrix(row, height, x) @ parameters @ matrix(column, width, x).T
    squares = torch.stack([(a * b).expand(3, 3, len(row), len(column)).flatten(0, 1) for a, b in ((fx, fx), (fy, fy), (fx, fy))])
    nearness = torch.exp(-((scale * x).square() + (scale * y).square()) / (2 * SPREAD**2))
    return mixed(nearest, seen, seen.amin(dim=1), seen.amax(dim=1), past, squares, nearness, x, y)


def matrix(index, size, like):
    """Which of `size` each is, as ones in rows: its product's gradient is fast, which an index's is not."""
    return (index[:, None] == torch.arange(size, device=index.device)).to(like)


def mixed(p, seen, low, high, past, squares, nearness, x, y):
    """`compose`, pixel by pixel."""
    along_x, along_y = 2 * torch.exp2(p[:, 0:1].clamp(-6, 6)), 2 * torch.exp2(p[:, 1:2].clamp(-6, 6))
    across = 0.95 * torch.tanh(p[:, 2:3]) * torch.sqrt(along_x * along_y)
    distance = 0.5 * (along_x * squares[0] + along_y * squares[1]) + across * squares[2]
    weight = torch.exp(-distance) * (1 - 0.5 * torch.sigmoid(p[:, 3:4]) * distance)  # [N, 9, H, W]
    filtered = (weight[:, :, None] * seen).sum(dim=1) / weight.sum(dim=1, keepdim=True).clamp(min=1e-3)
    free = filtered + p[:, 8:11] + p[:, 11:14] * x + p[:, 14:17] * y
    estimate = torch.minimum(torch.maximum(free, low), high)

    fresh = torch.exp2(p[:, 4:5].clamp(-6, 4)) * nearness + torch.exp2(p[:, 5:6].clamp(-8, 4))
    kept = torch.sigmoid(p[:, 6:7]) * past[:, 3:]
    before = past[:, :3]
    before = torch.lerp(torch.minimum(torch.maximum(before, low), high), before, torch.sigmoid(p[:, 7:8]))
    weight = kept + fresh
    output = (kept * before + fresh * estimate) / weight
    return torch.cat((output, weight.clamp(max=MOST)), dim=1), free - estimate


def shape(arguments):
    if arguments.size not in SIZES:
        raise SystemExit("a Clarus network is of --size s or m")
    width, middle = SIZES[arguments.size]
    return dict(width=width, middle=middle)


def create(width, middle):
    """A network to be trained; it starts as an accumulation of nearby samples."""
    network = Clarus(2, width, middle)
    with torch.no_grad():
        for layer in network.layers:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
            nn.init.zeros_(layer.bias)
        last = network.layers[-1]
        last.weight.mul_(0.1)
        last.bias[: len(STARTING_BIASES)] = torch.tensor(STARTING_BIASES)
    return network


def parameter_groups(network, arguments):
    return [{"params": list(network.parameters())}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """losses.followed, at the clip's own scale."""
    network.scale = reference.shape[-1] / frames[0].color.shape[-1]
    return losses.followed(network, frames, reference, WINDOW)


def model_tensors(network, jitters=None, mlp=False, half=False):
    tensors, metadata = model_file.plain_tensors(network, half)
    return tensors, {**metadata, "scale": "any"}


def load_model(tensors, metadata):
    """Of scale 2, until told otherwise."""
    width, middle = tensors["layers.0.bias"].shape[0], len(tensors) // 2 - 2
    network = Clarus(2, width, middle)
    network.load_state_dict(tensors)
    return network
