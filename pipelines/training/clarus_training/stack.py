"""Plain stacks of layers (pipelines/stack/README.md): the twin of what the program builds from a model file's list.

A list of layers, as in the file's metadata, and the `widths` of its tensors (output channels of convolutions, slopes
of PReLUs), by the tensor's name, make a network.
"""

import json

import torch
from torch import nn
import torch.nn.functional as F

from . import history, model_file, operators, quantized, srpo

FILTERS = {
    "nearest": lambda image, scale: F.interpolate(image, scale_factor=scale, mode="nearest"),
    "bilinear": operators.upsample,
    "bicubic": operators.keys_upsample,
    "lanczos": srpo.lanczos_upsample,
}

INPUT = -1  # in the place of a layer's number
# Of what a layer takes and what others have left.
TOGETHER = {
    "add": lambda x, others: x + others[0],
    "multiply": lambda x, others: x * others[0],
    "concatenate": lambda x, others: torch.cat([x, *others], dim=1),
}


class Stack(nn.Module):
    """The network. It looks at one frame's colour, or at its luma alone, and has no state. `held`: docs/history.md."""

    pipeline = "stack"

    def __init__(self, scale, layers, widths, network_color="rgb", held=False):
        super().__init__()
        self.held = held
        self.scale, self.layers, self.network_color = scale, layers, network_color
        left = {INPUT: {"rgb": 3, "luma": 1}[network_color]}
        modules = []
        for i, layer in enumerate(layers):
            channels = left[layer.get("of", i - 1)]
            modules.append(make_module(layer, channels, widths.get(layer.get("tensor"))))
            left[i] = channels_after(layer, channels, widths, left)
        self.module_list = nn.ModuleList(modules)

    def ahead(self, frames):
        return [None] * len(frames)

    def run_layers(self, seen):
        left = {INPUT: seen}
        for i, (layer, module) in enumerate(zip(self.layers, self.module_list)):
            x = left[layer.get("of", i - 1)]
            if layer["type"] in TOGETHER:
                with_ = layer["with"]
                x = TOGETHER[layer["type"]](x, [left[n] for n in (with_ if isinstance(with_, list) else [with_])])
            elif layer["type"] == "slice":
                x = x.narrow(1, *layer["channels"])
            elif layer["type"] == "residual":
                factor = x.shape[-1] // seen.shape[-1]
                x = x + (seen if factor == 1 else FILTERS[layer["filter"]](seen, factor))
            elif "channels" in layer:
                first, count = layer["channels"]
                before, part, after = x.split((first, count, x.shape[1] - first - count), dim=1)
                x = torch.cat((before, apply(layer, module, part), after), dim=1)
            else:
                x = apply(layer, module, x)
            left[i] = x
        return x.to(seen.dtype)

    def step(self, frame, state=None, ahead=None, inside=None):
        color = frame.color
        if self.network_color == "rgb":
            output = self.run_layers(color)
        else:
            upsampled = operators.keys_upsample(color, self.scale)
            output = upsampled + self.run_layers(luma(color)) - luma(upsampled)
        if not self.held:
            return output.clamp(0, 1), None
        return history.hold(output, color, operators.upsample(color, self.scale), self.scale), None


def luma(image):
    return operators.ycbcr(image)[:, :1]


def make_module(layer, channels, width):
    """What holds the layer's tensors; nothing where it has none."""
    if layer["type"] == "convolution":
        size, stride, groups = layer["size"], layer.get("stride", 1), layer.get("groups", 1)
        bias = layer.get("bias", True)
        return nn.Conv2d(channels, width, size, stride, size // 2, groups=groups, bias=bias)
    if layer["type"] == "transposed_convolution":
        size, stride, groups = layer["size"], layer["stride"], layer.get("groups", 1)
        padding = layer.get("padding", (size - 1) // 2)
        beyond = stride + 2 * padding - size
        return nn.ConvTranspose2d(channels, width, size, stride, padding, output_padding=beyond, groups=groups)
    return nn.PReLU(width) if layer["type"] == "prelu" else nn.Identity()


def channels_after(layer, channels, widths, left):
    """`left`: how many channels the layers before leave."""
    kind = layer["type"]
    if kind in ("add", "multiply"):
        return max(channels, left[layer["with"]])
    if kind == "concatenate":
        return channels + sum(left[number] for number in layer["with"])
    if kind == "slice":
        return layer["channels"][1]
    if kind in ("convolution", "transposed_convolution"):
        return widths[layer["tensor"]]
    if kind in ("maximum", "sum"):
        return layer.get("groups", 1)
    if kind == "product":
        return channels - layer.get("channels", (0, channels))[1] // 2
    return channels // layer["scale"] ** 2 if kind == "depth_to_space" else channels


def apply(layer, module, x):
    kind = layer["type"]
    if kind == "transposed_convolution" and isinstance(module, quantized.QuantizedConv2d):
        return operators.depth_to_space(module(x), layer["stride"])
    if kind in ("convolution", "transposed_convolution", "prelu"):
        return module(x)
    if kind in ("relu", "tanh", "sigmoid"):
        return getattr(torch, kind)(x)
    if kind == "depth_to_space":
        return operators.depth_to_space(x, layer["scale"])
    if kind == "clamp":
        return x.clamp(layer["low"], layer["high"])
    if kind == "upsample":
        return operators.upsample(x, layer["scale"])
    if kind == "product":
        first, second = x.chunk(2, dim=1)
        return first * second
    if layer.get("groups", 1) == 1:  # the same in fewer operators, which matters where it is exported
        if kind == "softmax":
            return x.softmax(dim=1)
        return x.amax(dim=1, keepdim=True) if kind == "maximum" else x.sum(dim=1, keepdim=True)
    grouped = x.reshape(x.shape[0], layer.get("groups", 1), -1, *x.shape[2:])
    if kind == "softmax":
        return grouped.softmax(dim=2).flatten(1, 2)
    return grouped.amax(dim=2) if kind == "maximum" else grouped.sum(dim=2)


def convolution(tensor, size, **more):
    return {"type": "convolution", "tensor": tensor, "size": size, **more}


def espcn(scale, channels, features=(22, 32)):
    """Shi et al. 2016; with one channel and these features, SRPO's table 1's."""
    layers = [
        convolution("first", 5),
        {"type": "tanh"},
        convolution("second", 3),
        {"type": "tanh"},
        convolution("last", 3),
        {"type": "depth_to_space", "scale": scale},
    ]
    return layers, dict(first=features[0], second=features[1], last=channels * scale**2)


def fsrcnn(scale, channels, features=56, shrunk=12, mappings=4):
    """Dong et al. 2016."""
    names = ["extract", "shrink", *(f"map.{i}" for i in range(mappings)), "expand"]
    sizes = [5, 1, *[3] * mappings, 1]
    layers, widths = [], {}
    for name, size, width in zip(names, sizes, [features, shrunk, *[shrunk] * mappings, features]):
        layers += [convolution(name, size), {"type": "prelu", "tensor": f"{name}.prelu"}]
        widths[name] = widths[f"{name}.prelu"] = width
    layers.append({"type": "transposed_convolution", "tensor": "upscale", "size": 9, "stride": scale})
    return layers, dict(widths, upscale=channels)


def joined(scale, channels, features=8):
    """Of layers that read others than the one before them; small, after EDSR (Lim et al. 2017) and IMDN (2019)."""
    half = features // 2
    layers = [
        convolution("head", 3),  # 0
        convolution("a", 3),
        {"type": "relu"},
        convolution("b", 3),  # 3
        {"type": "add", "with": 0},
        {"type": "slice", "channels": [0, half]},  # 5
        {"type": "slice", "of": 4, "channels": [half, features - half]},
        convolution("c", 1),
        {"type": "sigmoid"},  # 8
        {"type": "multiply", "of": 5, "with": 8},
        {"type": "clamp", "low": -0.75, "high": 1.5},
        {"type": "concatenate", "with": [5, 0]},
        convolution("tail", 3),
        {"type": "depth_to_space", "scale": scale},  # 13
        {"type": "upsample", "of": INPUT, "scale": scale},
        {"type": "add", "with": 13},
    ]
    return layers, dict(head=features, a=features, b=features, c=1, tail=channels * scale**2)


def edge_sr(kind, scale, features, size):
    """Navarrete Michelini et al. 2021, of one channel: eSR-MAX, eSR-TM, eSR-TR ("max", "tm", "tr")."""
    parts = {"max": 1, "tm": 2, "tr": 3}[kind]
    layers = [convolution("filter", size, bias=False), {"type": "depth_to_space", "scale": scale}]
    if kind == "max":
        layers.append({"type": "maximum"})
    else:
        if kind == "tr":  # query · key
            layers.append({"type": "product", "channels": [features, 2 * features]})
        layers += [{"type": "softmax", "channels": [features, features]}, {"type": "product"}, {"type": "sum"}]
    return layers, dict(filter=parts * features * scale**2)


def model_tensors(network, jitters=None, mlp=False, half=False):
    array = model_file.rounding(half)
    tensors = {}
    for layer, module in zip(network.layers, network.module_list):
        if isinstance(module, quantized.QuantizedConv2d):
            own = module.tensors
        else:
            own = {key: array(tensor) for key, tensor in module.state_dict().items()}
        tensors.update({f"{layer['tensor']}.{key}": values for key, values in own.items()})
    layers = [{key: value for key, value in layer.items() if key != "bias"} for layer in network.layers]
    facts = dict(pipeline="stack", scale=str(network.scale), network_color=network.network_color)
    facts.update({"range": "held"} if network.held else {})
    return tensors, dict(facts, layers=json.dumps(layers))


def quantize(network, seen):
    """The network with all its convolutions in whole numbers, each for what it reads of the image `seen`, which the

    network's layers start from. Transposed ones have no groups.
    """
    modules = list(network.module_list)
    x = seen
    for i, (layer, module) in enumerate(zip(network.layers, modules)):
        if "convolution" in layer["type"]:
            weight, bias = (parameter.detach().numpy() for parameter in (module.weight, module.bias))
            if layer["type"] == "transposed_convolution":
                weight = quantized.transposed(weight, layer["stride"], module.padding[0])
                bias = bias.repeat(layer["stride"] ** 2)
            tensors = quantized.quantize(weight, bias, *quantized.quantization_of(x))
            modules[i] = make_quantized(layer, tensors)
        x = apply(layer, module, x)
    network.module_list = nn.ModuleList(modules)
    hand_on(network)
    return network


def make_quantized(layer, tensors):
    stride = layer.get("stride", 1) if layer["type"] == "convolution" else 1
    return quantized.QuantizedConv2d(tensors, stride, layer.get("groups", 1))


def hand_on(network):
    """Has quantized layers hand on numbers where quantized layers alone read them."""
    last = None
    for layer, module in zip(network.layers, network.module_list):
        if isinstance(module, quantized.QuantizedConv2d):
            if last is not None:
                last.hands_on = module.reads
            last = module if layer["type"] == "convolution" else None
        elif layer["type"] != "relu" or "channels" in layer:
            last = None


def load_model(tensors, metadata):
    layers, widths = json.loads(metadata["layers"]), {}
    for layer in layers:
        if "tensor" not in layer:
            continue
        name = layer["tensor"]
        weight = tensors[f"{name}.weight"]
        is_transposed = layer["type"] == "transposed_convolution"
        if is_transposed and not weight.is_floating_point():
            widths[name] = weight.shape[0] // layer["stride"] ** 2
            continue
        widths[name] = weight.shape[1] * layer.get("groups", 1) if is_transposed else weight.shape[0]
        if layer["type"] == "convolution":
            layer["bias"] = f"{name}.bias" in tensors
    checks = history.options_of(metadata)
    if checks["checked"]:
        raise SystemExit("metadata history is checked, but a stack of layers has no history")
    colors = metadata.get("network_color", "rgb")
    network = Stack(int(metadata["scale"]), layers, widths, colors, checks["held"])
    for i, (layer, module) in enumerate(zip(network.layers, network.module_list)):
        if "tensor" in layer and not tensors[f"{layer['tensor']}.weight"].is_floating_point():
            own = {key: tensors[f"{layer['tensor']}.{key}"].numpy() for key in quantized.TENSORS}
            network.module_list[i] = make_quantized(layer, own)
            continue
        module.load_state_dict({key: tensors[f"{layer['tensor']}.{key}"] for key in module.state_dict()})
    hand_on(network)
    return network
