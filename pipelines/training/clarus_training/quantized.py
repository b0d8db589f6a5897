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
    """A layer of a quantized model file. `hands_on`: the (scale, zero point) of its result's numbers, where quantized

    layers alone read it; else the result is floating-point. An activation comes after it.
    """

    def __init__(self, tensors, stride=1, groups=1):
        """`tensors`: TENSORS as the file has them."""
        super().__init__()
        self.tensors = {name: np.asarray(array) for name, array in tensors.items()}
        self.stride, self.groups, self.hands_on = stride, groups, None

    @property
    def reads(self):
        """The scale and zero point of the numbers that it reads."""
        return self.tensors["input_scale"][0], int(self.tensors["input_zero_point"][0])

    def sums(self, image):
        """Σ (q − zero point) · w + b of what stands for the image, [N, out, h, w] in whole numbers."""
        scale, zero_point = self.reads
        weight = torch.from_numpy(self.tensors["weight"].astype(np.float64))
        bias = torch.from_numpy(self.tensors["bias"].astype(np.float64))
        centred = numbers(image, scale, zero_point) - zero_point
        return F.conv2d(centred, weight, bias, self.stride, weight.shape[-1] // 2, groups=self.groups)

    def forward(self, image):
        sums = self.sums(image)
        input_scale, weight_scale = self.tensors["input_scale"][0], self.tensors["weight_scale"]
        if self.hands_on is None:
            unit = torch.from_numpy((np.float32(input_scale) * weight_scale).astype(np.float32))
            return (sums.float() * unit[:, None, None]).double()
        scale, zero_point = self.hands_on
        factor = np.float64(input_scale) * weight_scale.astype(np.float64) / np.float64(scale)
        multiplier, shift = requantization(factor)
        upper = np.int64(1) << (shift - 1)
        parts = sums.numpy().astype(np.int64)
        made = (parts * multiplier[:, None, None] + upper[:, None, None]) >> shift[:, None, None]
        made = np.clip(made + zero_point, 0, LARGEST)
        return torch.from_numpy(made - zero_point).double() * single(scale)


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


def in_floats(tensors):
    """A quantized file's tensors, NumPy's, as a floating-point file has them, and {layer: its (scale, zero point), weight
    scales}, of tables [K, out].
    """
    layers = {}
    for key in tensors:
        if key.endswith(".weight_scale"):
            name = key.removesuffix(".weight_scale")
            reads = float(tensors[f"{name}.input_scale"][0]), int(tensors[f"{name}.input_zero_point"][0])
            layers[name] = reads, tensors[key]
    floats = {key: array for key, array in tensors.items() if key.rsplit(".", 1)[0] not in layers}
    for name, ((scale, _), weight_scale) in layers.items():
        weight = tensors[f"{name}.weight"].astype(np.float32)
        floats[f"{name}.weight"] = weight * weight_scale.reshape(*weight_scale.shape, 1, 1, 1)
        bias = tensors[f"{name}.bias"].astype(np.float64)
        floats[f"{name}.bias"] = (bias * scale * weight_scale).astype(np.float32)
    return floats, layers


def simulate(network, tensors, layers):
    """Puts SimulatedConv2d in place of the network's convolutions of these names. `tensors`, `layers`: as `in_floats`
    returns them. Returns the layers that are no convolutions of their own.
    """
    others = dict(layers)
    for name, module in list(network.named_modules()):
        if name not in layers or not isinstance(module, nn.Conv2d):
            continue
        reads, weight_scale = others.pop(name)
        weight, bias = tensors[f"{name}.weight"], tensors[f"{name}.bias"]
        layer = SimulatedConv2d(weight, bias, reads, weight_scale, module.stride, module.groups)
        parent, _, own = name.rpartition(".")
        setattr(network.get_submodule(parent), own, layer)
    return others


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
