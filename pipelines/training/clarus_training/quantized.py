"""The twin of docs/quantization.md: convolutions in whole numbers, to the bit.

Whole numbers are kept in double precision, in which all of them and all sums of their products are exact. A layer takes
and returns what numbers stand for, in single precision's values; numbers that one layer hands to the next are the same
when they are rounded again.
"""

import numpy as np
import torch
from torch import nn
import torch.nn.functional as F

LARGEST = 255
LARGEST_WEIGHT = 127


def single(value):
    """As a float32, in double precision."""
    return torch.as_tensor(value).float().double()


def numbers(image, scale, zero_point):
    """The numbers that stand for an image's values: halves to even; 0 for NaN."""
    product = image.float() * torch.tensor(np.float32(1) / np.float32(scale))
    return (product.double().round() + zero_point).clamp(0, LARGEST).nan_to_num(0)


def requantization(factor):
    """(m, s) for factors in double precision below a quarter: factor is about m · 2^−s."""
    factor = np.asarray(factor, dtype=np.float64)
    fraction, exponent = np.frexp(factor)
    multiplier, shift = np.floor(np.ldexp(fraction, 31) + 0.5), 31 - exponent
    rounded_up = multiplier == 2.0**31
    multiplier, shift = np.where(rounded_up, multiplier / 2, multiplier), shift - rounded_up
    small = (factor == 0) | (shift > 62)
    multiplier = np.where(small, np.floor(np.ldexp(factor, 62) + 0.5), multiplier)
    shift = np.where(small, 62, shift)
    multiplier = np.where(shift < 33, 2.0**31 - 1, multiplier)
    return multiplier.astype(np.int64), np.maximum(shift, 33).astype(np.int64)


TENSORS = ("weight", "weight_scale", "bias", "input_scale", "input_zero_point")


class QuantizedConv2d(nn.Module):
    """A layer of a quantized model file; an activation comes after it.

    `hands_on`: the (scale, zero point) of its result's numbers, where quantized layers alone read it; else the result is
    floating-point. Of a layer that has a table, `entry` is which of its sets serves.
    """

    def __init__(self, tensors, stride=1, groups=1):
        """`tensors`: TENSORS as the file has them."""
        super().__init__()
        self.tensors = {name: np.asarray(array) for name, array in tensors.items()}
        self.stride, self.groups, self.hands_on = stride, groups, None

    @property
    def weight(self):
        return self.tensors["weight"]

    @property
    def reads(self):
        """The scale and zero point of the numbers that it reads."""
        return self.tensors["input_scale"][0], int(self.tensors["input_zero_point"][0])

    def sums(self, image, entry=...):
        """Σ (q − zero point) · w + b of what stands for the image, [N, out, h, w] in whole numbers."""
        scale, zero_point = self.reads
        weight = torch.from_numpy(self.tensors["weight"][entry].astype(np.float64))
        bias = torch.from_numpy(self.tensors["bias"][entry].astype(np.float64))
        centred = numbers(image, scale, zero_point) - zero_point
        return F.conv2d(centred, weight, bias, self.stride, weight.shape[-1] // 2, groups=self.groups)

    def forward(self, image, entry=...):
        result = result_of(self.sums(image, entry), self.reads[0], self.tensors["weight_scale"][entry], self.hands_on)
        return result.to(image.dtype)


def result_of(sums, input_scale, weight_scale, hands_on=None):
    """What whole sums [N, out, h, w] stand for, in double precision: rounded to single precision, or, where `hands_on` is a
    scale and zero point, to numbers of these."""
    if hands_on is None:
        unit = torch.from_numpy((np.float32(input_scale) * weight_scale).astype(np.float32))
        return (sums.float() * unit[:, None, None]).double()
    scale, zero_point = hands_on
    factor = np.float64(input_scale) * weight_scale.astype(np.float64) / np.float64(scale)
    multiplier, shift = requantization(factor)
    upper = np.int64(1) << (shift - 1)
    parts = sums.numpy().astype(np.int64)
    made = (parts * multiplier[:, None, None] + upper[:, None, None]) >> shift[:, None, None]
    made = np.clip(made + zero_point, 0, LARGEST)
    return torch.from_numpy(made - zero_point).double() * single(scale)


def straight_through(value, rounded):
    """`rounded`, with the gradient of `value`, finite."""
    return rounded.detach() + (value - value.detach())


class TrainedConv2d(nn.Module):
    """A quantized layer that learns: the bits of QuantizedConv2d with its `tensors`, and gradients as if nothing were
    rounded, but none of what is clamped.

    Weights and biases are floating-point; scales and zero points stay as they are. It runs on the CPU.
    """

    def __init__(self, weight, bias, reads, weight_scale, stride=1, groups=1):
        """`weight` [out, in, k, k] and `bias` [out]: what it starts from; `reads`: (scale, zero point); `weight_scale`:
        [out]. Of a table, [K, …] each.
        """
        super().__init__()
        self.weight, self.bias = (nn.Parameter(each.detach()) for each in (weight, bias))
        self.stride, self.groups = stride, groups
        self.register_buffer("weight_scale", torch.tensor(np.asarray(weight_scale)))
        self.register_buffer("input_scale", torch.tensor([reads[0]]))
        self.register_buffer("input_zero_point", torch.tensor([reads[1]], dtype=torch.int32))
        self.hands_on = None

    @property
    def reads(self):
        """The scale and zero point of the numbers that it reads."""
        return self.input_scale.numpy()[0], int(self.input_zero_point)

    @property
    def units(self):
        """What 1 stands for in biases and sums [out], in double precision; of a table [K, out]."""
        return self.input_scale.double() * self.weight_scale.double()

    def whole(self, entry=...):
        """Weights and biases in whole numbers, in double precision, with the gradients of what they are rounded from."""
        weight = self.weight[entry].double() / self.weight_scale[entry].double()[..., None, None, None]
        weight = weight.clamp(-LARGEST_WEIGHT, LARGEST_WEIGHT)
        bias = self.bias[entry].double() / self.units[entry]
        return straight_through(weight, weight.round()), straight_through(bias, bias.round())

    def tensors(self):
        """TENSORS, as a file has them."""
        weight, bias = (each.detach() for each in self.whole())
        return dict(
            weight=weight.to(torch.int8).numpy(),
            weight_scale=self.weight_scale.numpy(),
            bias=bias.to(torch.int32).numpy(),
            input_scale=self.input_scale.numpy(),
            input_zero_point=self.input_zero_point.numpy(),
        )

    def forward(self, image, entry=...):
        scale, zero_point = self.reads
        read = (image.double() / float(scale)).clamp(-zero_point, LARGEST - zero_point)
        read = straight_through(read, numbers(image, scale, zero_point) - zero_point)
        weight, bias = self.whole(entry)
        # Sums up to 2^24 are exact in single precision too, which is several times as fast.
        most = (LARGEST * weight.detach().abs().sum(dim=(1, 2, 3)) + bias.detach().abs()).max()
        kind = torch.float32 if most <= 2**24 else torch.float64
        padding = weight.shape[-1] // 2
        with torch.autocast(image.device.type, enabled=False):
            numbers_and_weights = read.to(kind), weight.to(kind), bias.to(kind)
            sums = F.conv2d(*numbers_and_weights, self.stride, padding, groups=self.groups).double()
        free = sums * self.units[entry][:, None, None]
        if self.hands_on:
            low, high = (float(self.hands_on[0]) * (number - self.hands_on[1]) for number in (0, LARGEST))
            free = free.clamp(low, high)
        result = result_of(sums.detach(), scale, self.weight_scale[entry].numpy(), self.hands_on)
        return straight_through(free, result).to(image.dtype)


def simulated(image, weight, reads, weight_scale):
    """An image and a weight as a layer sees them that computes in whole numbers: rounded to what numbers stand for.
    `reads`: the layer's (scale, zero point); `weight_scale`: [out].
    """
    scale, zero_point = reads
    image = torch.fake_quantize_per_tensor_affine(image, scale, zero_point, 0, LARGEST)
    zeros = torch.zeros(len(weight_scale), dtype=torch.int32)
    weight = torch.fake_quantize_per_channel_affine(weight, weight_scale, zeros, 0, -LARGEST_WEIGHT - 1, LARGEST_WEIGHT)
    return image, weight


class SimulatedConv2d(nn.Module):
    """A quantized layer in floating point, as frameworks express it: QuantizeLinear and DequantizeLinear before a plain
    convolution. The same as QuantizedConv2d but for how sums are rounded.
    """

    def __init__(self, weight, bias, reads, weight_scale, stride=1, groups=1):
        """`weight` and `bias`: what the numbers stand for; `reads`: (scale, zero point); `weight_scale`: [out]."""
        super().__init__()
        self.register_buffer("weight", torch.tensor(weight))
        self.register_buffer("bias", torch.tensor(bias))
        self.register_buffer("weight_scale", torch.tensor(weight_scale))
        self.reads, self.stride, self.groups, self.padding = reads, stride, groups, weight.shape[-1] // 2

    def forward(self, image):
        image, weight = simulated(image, self.weight, self.reads, self.weight_scale)
        return F.conv2d(image, weight, self.bias, self.stride, self.padding, groups=self.groups)


def layers_of(tensors):
    """Of a quantized file's tensors, or a checkpoint's, {layer: its (scale, zero point), weight scales}; of tables [K, out]."""
    layers = {}
    for key in tensors:
        if key.endswith(".weight_scale"):
            name = key.removesuffix(".weight_scale")
            reads = float(tensors[f"{name}.input_scale"][0]), int(tensors[f"{name}.input_zero_point"][0])
            layers[name] = reads, tensors[key]
    return layers


def in_floats(tensors):
    """A quantized file's tensors, NumPy's, as a floating-point file has them, and `layers_of` them."""
    layers = layers_of(tensors)
    floats = {key: array for key, array in tensors.items() if key.rsplit(".", 1)[0] not in layers}
    for name, ((scale, _), weight_scale) in layers.items():
        weight = tensors[f"{name}.weight"].astype(np.float32)
        floats[f"{name}.weight"] = weight * weight_scale.reshape(*weight_scale.shape, 1, 1, 1)
        bias = tensors[f"{name}.bias"].astype(np.float64)
        floats[f"{name}.bias"] = (bias * scale * weight_scale).astype(np.float32)
    return floats, layers


def replace(network, layers, make):
    """Puts `make(name, (weight, bias), stride, groups)` in place of the network's convolutions that `layers` has, of as
    many outputs. Returns the names of the others, which are no convolutions of their own.
    """
    others = set(layers)
    for name, module in list(network.named_modules()):
        if name not in layers or not isinstance(module, nn.Conv2d) or module.out_channels != len(layers[name][1]):
            continue
        others.remove(name)
        parent, _, own = name.rpartition(".")
        bias = torch.zeros(module.out_channels) if module.bias is None else module.bias
        made = make(name, (module.weight, bias), module.stride, module.groups)
        setattr(network.get_submodule(parent), own, made)
    return others


def simulate(network, tensors, layers):
    """Puts SimulatedConv2d in place of the network's convolutions of these names. `tensors`, `layers`: as `in_floats`
    returns them. Returns those of `layers` that are no convolutions of their own.
    """

    def simulated_layer(name, _, *shape):
        return SimulatedConv2d(tensors[f"{name}.weight"], tensors[f"{name}.bias"], *layers[name], *shape)

    return {name: layers[name] for name in replace(network, layers, simulated_layer)}


def make_exact(network, tensors):
    """Puts QuantizedConv2d in place of a network's layers that are in whole numbers in `tensors`, a file's, NumPy's."""

    def exact(name, _, *shape):
        return QuantizedConv2d({key: tensors[f"{name}.{key}"] for key in TENSORS}, *shape)

    replace_all(network, layers_of(tensors), exact)


def make_trained(network, layers):
    """Puts TrainedConv2d in place of a network's `layers`, as `layers_of` has them."""
    replace_all(network, layers, lambda name, start, *shape: TrainedConv2d(*start, *layers[name], *shape))


def tensors_of(network):
    """What a file has of a network's layers that learn in whole numbers, and the metadata that says so."""
    layers = {name: module for name, module in network.named_modules() if isinstance(module, TrainedConv2d)}
    tensors = {f"{name}.{key}": array for name, module in layers.items() for key, array in module.tensors().items()}
    return tensors, {"quantization": "int8"} if layers else {}


def replace_all(network, layers, make):
    """`replace`, and of a network's tables as well (`network.tables`, their names). Layers of a ModuleList, and of each of
    `network.sequences()`, are one after the other.
    """
    for name in sorted(replace(network, layers, make)):
        if name not in getattr(network, "tables", ()):
            raise SystemExit(f"{name}: no convolution of its own here; it learns in floating point alone")
        setattr(network, name, make(name, network.table(name), 1, 1))
    lists = [module for module in network.modules() if isinstance(module, nn.ModuleList)]
    for following in lists + getattr(network, "sequences", list)():
        for layer, reader in zip(following, following[1:]):
            if hasattr(layer, "hands_on") and hasattr(reader, "reads"):
                layer.hands_on = reader.reads


def quantization_of(image):
    """(scale, zero point) for the values of an image, 0 among them."""
    low, high = min(float(image.min()), 0.0), max(float(image.max()), 0.0)
    scale = np.float32((high - low or 1.0) / LARGEST)
    return scale, int(np.clip(np.round(-low / scale), 0, LARGEST))


def quantize(weight, bias, scale, zero_point):
    """The tensors of a layer that reads numbers of that scale and zero point, each channel's largest weight being 127."""
    weight_scale = np.maximum(np.abs(weight).max(axis=(1, 2, 3)), 1e-6).astype(np.float32) / np.float32(LARGEST_WEIGHT)
    rounded = np.round(weight / weight_scale[:, None, None, None]).clip(-LARGEST_WEIGHT, LARGEST_WEIGHT)
    return dict(
        weight=rounded.astype(np.int8),
        weight_scale=weight_scale,
        bias=np.round(bias / (np.float64(scale) * weight_scale)).astype(np.int32),
        input_scale=np.array([scale], np.float32),
        input_zero_point=np.array([zero_point], np.int32),
    )


def transposed(weight, stride, padding):
    """A transposed convolution's weight [in, out, k, k] as that of the convolution that goes from depth to space."""
    inputs, outputs, size, _ = weight.shape
    reach = max((stride - 1 + padding) // stride, (size - 1 - padding) // stride)
    result = np.zeros((outputs, stride, stride, inputs, 2 * reach + 1, 2 * reach + 1), weight.dtype)
    for dy, dx, row, column in np.ndindex(2 * reach + 1, 2 * reach + 1, stride, stride):
        y, x = row + padding - stride * (dy - reach), column + padding - stride * (dx - reach)
        if 0 <= y < size and 0 <= x < size:
            result[:, row, column, :, dy, dx] = weight[:, :, y, x].T
    return result.reshape(outputs * stride**2, inputs, 2 * reach + 1, 2 * reach + 1)
