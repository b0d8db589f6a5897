"""Writes the golden models, inputs and outputs that the C++ tests compare with: python3 -m clarus_training.golden DIR.

Each case is a pair of files: NAME.model.safetensors, a model with random weights, and NAME.golden.safetensors: the
inputs `color`, `depth`, `motion` [T, h, w, c], `jitter` [T, 2], `reset` [T], and where motion was not sampled at pixel
centres `motion_jitter` [T, 2]; the `output` [T, H, W, 3]; and what the network shows of frame 3 as [C, H, W], such as
ENSS's `warped` (colour, feature), `alpha` and `candidate`. Motion is canonical but unchecked: it holds vectors that are
not finite or longer than the image's diagonal; depth holds ties. Outputs are computed in double precision.

Of some stacks there is also NAME.onnx, the same network as PyTorch exports it, of a size that is not the frames'.
"""

import argparse
import math
import os

import numpy as np
import torch

from . import clarus, enss, mnss, model_file, nsrr, nss, onnx, operators, safetensors, srpo, stack
from .frame import Frame
from .layers import convolutions

FRAMES = 8
RESET_AT = 5
INSIDE_AT = 3
HALTON = operators.halton_jitter()

# Of every kind, with groups and strides, on parts of the channels.
EVERY_LAYER = (
    [
        stack.convolution("a", 3, stride=2),
        {"type": "relu"},
        stack.convolution("b", 5, groups=4),
        {"type": "relu", "channels": [0, 3]},
        {"type": "tanh", "channels": [3, 5]},
        {"type": "sigmoid", "channels": [6, 4]},
        {"type": "transposed_convolution", "tensor": "c", "size": 4, "stride": 2, "groups": 2},
        {"type": "prelu", "tensor": "c.prelu"},
        {"type": "softmax", "channels": [2, 6], "groups": 3},
        {"type": "product", "channels": [0, 4]},
        stack.convolution("d", 1),
        {"type": "depth_to_space", "scale": 2},
        {"type": "maximum", "groups": 6},
        {"type": "sum", "groups": 3},
        {"type": "residual", "filter": "bicubic"},
    ],
    {"a": 8, "b": 12, "c": 10, "c.prelu": 1, "d": 48},
)

# Convolutions, of which all are in whole numbers; nothing between them rounds.
IN_WHOLE_NUMBERS = (
    [
        stack.convolution("a", 5),
        {"type": "relu"},
        stack.convolution("b", 3, groups=2, stride=2),
        {"type": "relu"},
        stack.convolution("c", 1),
        {"type": "relu"},
        {"type": "transposed_convolution", "tensor": "d", "size": 5, "stride": 2},
        {"type": "relu"},
        stack.convolution("e", 3),
        stack.convolution("f", 3),
        {"type": "depth_to_space", "scale": 2},
    ],
    {"a": 18, "b": 20, "c": 37, "d": 8, "e": 24, "f": 12},
)
IN_WHOLE_NUMBERS_ALONE = (
    [stack.convolution("a", 3), {"type": "relu"}, stack.convolution("b", 3), {"type": "depth_to_space", "scale": 2}],
    {"a": 5, "b": 12},
)

# `hidden`: an MLP of that width instead of a table. `away`: jitters of some frames that no table entry has. `jittered`:
# motion was sampled where colour was. `any_scale`: of a model for any, used at `scale`. `checked`, `held`: docs/history.md. `use`: only so many of the previous frames, whose number the golden file says.
CASES = {
    "clarus": {
        "clarus_x2": dict(scale=2, features=8, middle=1, size=(13, 9)),
        "clarus_x3": dict(scale=3, features=12, middle=0, size=(11, 7), jittered=True),
        "clarus_x4_1x1": dict(scale=4, features=4, middle=1, size=(1, 1)),
        "clarus_x1.5": dict(scale=1.5, features=8, middle=1, size=(14, 10)),
        "clarus_x2.5": dict(scale=2.5, features=4, middle=0, size=(9, 7), any_scale=True),
    },
    "enss": {
        "enss_x2_table": dict(scale=2, features=16, middle=1, size=(13, 9), table=HALTON),
        "enss_x3_table": dict(scale=3, features=8, middle=0, size=(11, 7), table=HALTON[:6], away=0.004),
        "enss_x4_single": dict(scale=4, features=12, middle=2, size=(9, 8), table=HALTON[:1]),
        "enss_x2_mlp": dict(scale=2, features=8, middle=1, size=(17, 11), hidden=32),
        "enss_x2_1x1": dict(scale=2, features=4, middle=1, size=(1, 1), table=HALTON[:1]),
        "enss_x2_held": dict(scale=2, features=8, middle=1, size=(13, 9), table=HALTON[:8], held=True),
        "enss_x3_checked": dict(scale=3, features=8, middle=1, size=(9, 7), table=HALTON[:8], checked=True, held=True),
    },
    "nsrr": {
        "nsrr_x4": dict(scale=4, width=8, size=(9, 7)),
        "nsrr_x2_rgb": dict(scale=2, width=4, size=(3, 151), previous_frames=2, network_color="rgb", jittered=True),
        "nsrr_x3_alone": dict(scale=3, width=4, size=(7, 6), previous_frames=0),
        "nsrr_x3_used": dict(scale=3, width=4, size=(7, 5), previous_frames=3, use=1),
        "nsrr_x6_1x1": dict(scale=6, width=4, size=(1, 1), previous_frames=1, jittered=True),
        "nsrr_x5_ragged": dict(scale=5, width=6, size=(5, 3), previous_frames=3, jittered=True, ragged=True),
        "nsrr_x2_checked": dict(scale=2, width=4, size=(11, 7), previous_frames=2, checked=True, held=True),
    },
    "mnss": {
        "mnss_x2": dict(scale=2, size=(13, 9), table=operators.mnss_jitter(2)),
        "mnss_x3": dict(scale=3, size=(9, 7), table=operators.mnss_jitter(3), away=0.4, jittered=True),
        "mnss_x2_1x1": dict(scale=2, size=(1, 1)),
        "mnss_x2_checked": dict(scale=2, size=(13, 9), checked=True, held=True),
    },
    "nss": {
        "nss_x2": dict(scale=2, size=(13, 9), white=1.0),
        "nss_x1.5": dict(scale=1.5, size=(17, 13), white=4.0),
        "nss_x1.7": dict(scale=1.7, size=(20, 10), white=1.0, away=0.3),
        "nss_x3": dict(scale=3, size=(9, 8), white=1.0),
        "nss_x2_1x1": dict(scale=2, size=(1, 1), white=1.0),
        "nss_x2_linear": dict(scale=2, size=(16, 8), white=float("inf")),
    },
    "srpo": {
        "srpo_x2": dict(scale=2, size=(13, 9)),
        "srpo_x3": dict(scale=3, size=(9, 8)),
        "srpo_x5_1x1": dict(scale=5, size=(1, 1)),
        "srpo_x1": dict(scale=1, size=(11, 6)),
        "srpo_x11": dict(scale=11, size=(3, 2)),
    },
    "stack": {
        "stack_espcn_x2": dict(scale=2, size=(13, 9), color="luma", layers=stack.espcn(2, 1)),
        "stack_espcn_rgb_x3": dict(scale=3, size=(9, 7), color="rgb", layers=stack.espcn(3, 3, (16, 12))),
        "stack_fsrcnn_x3": dict(scale=3, size=(11, 7), color="luma", layers=stack.fsrcnn(3, 1)),
        "stack_esr_max_x2": dict(scale=2, size=(13, 9), color="luma", layers=stack.edge_sr("max", 2, 2, 3)),
        "stack_esr_tm_x2": dict(scale=2, size=(13, 9), color="luma", layers=stack.edge_sr("tm", 2, 4, 7)),
        "stack_esr_tr_x3": dict(scale=3, size=(7, 5), color="luma", layers=stack.edge_sr("tr", 3, 2, 5)),
        "stack_all_x2": dict(scale=2, size=(14, 10), color="rgb", layers=EVERY_LAYER),
        "stack_1x1": dict(scale=2, size=(1, 1), color="luma", layers=stack.fsrcnn(2, 1, 8, 4, 1)),
        "stack_espcn_x2_held": dict(scale=2, size=(13, 9), color="luma", layers=stack.espcn(2, 1), held=True),
        "stack_int8_x2": dict(scale=2, size=(14, 10), color="rgb", layers=IN_WHOLE_NUMBERS, quantized=True),
        "stack_int8_1x1": dict(scale=2, size=(1, 1), color="rgb", layers=IN_WHOLE_NUMBERS_ALONE, quantized=True),
        "stack_joined_x2": dict(scale=2, size=(13, 9), color="rgb", layers=stack.joined(2, 3)),
    },
}

# Cases that there are ONNX files of, too.
AS_ONNX = ("stack_espcn_x2", "stack_espcn_rgb_x3", "stack_fsrcnn_x3", "stack_esr_max_x2", "stack_esr_tm_x2", "stack_joined_x2")


def random_weights(generator, network, gain):
    """Of a size that keeps features alive; rounded to what the file holds in half precision."""
    with torch.no_grad():
        for parameter in network.parameters():
            fan_in = parameter[0].numel() if parameter.ndim > 1 else 1
            std = (2 / fan_in) ** 0.5 * gain if parameter.ndim > 1 else 0.1
            parameter.copy_((torch.randn(parameter.shape, generator=generator) * std).half().float())
    return network


def checks_of(case):
    return {name: case.get(name, False) for name in ("checked", "held")}


def random_nsrr(generator, scale, width, previous_frames=4, network_color="ycbcr", use=None, ragged=False, **more):
    network = nsrr.Nsrr(scale, previous_frames, width, network_color, **checks_of(more))
    if ragged:  # widths that no published network has
        network.features_previous = convolutions(4, 20, 13, nsrr.FEATURES[-1])
        network.reweight = convolutions(4 + 4 * previous_frames, 17, 23, previous_frames)
    network = random_weights(generator, network, 0.9)
    network.used = use
    with torch.no_grad():
        network.unet.dec1[1].weight.copy_((network.unet.dec1[1].weight * 0.3).half())
        network.unet.dec1[1].bias.copy_((network.unet.dec1[1].bias + 0.5).half())
    return network


def random_clarus(generator, scale, features, middle, any_scale=False, **_):
    grids = clarus.GRIDS if any_scale else [math.ceil(scale)]
    network = clarus.Clarus("any" if any_scale else scale, {grid: (features, middle) for grid in grids})
    network.scale = scale
    random_weights(generator, network, 0.7)
    with torch.no_grad():
        for grid in grids:
            getattr(network, f"x{grid}")[-1].weight.mul_(0.25)  # corrections
    return network


def random_mnss(generator, scale, **more):
    return random_weights(generator, mnss.Mnss(scale, **checks_of(more)), 0.5)


def random_nss(generator, scale, white, **_):
    return random_weights(generator, nss.Nss(scale, white), 1.0)


def random_srpo(generator, scale, **_):
    return random_weights(generator, srpo.Srpo(scale), 1.2)


def random_stack(generator, scale, color, layers, held=False, quantized=False, **_):
    """Weights that add up to about 1 where there are no biases to centre the result."""
    network = random_weights(generator, stack.Stack(scale, *layers, color, held), 0.7)
    modules = [module for module in network.module_list if hasattr(module, "weight") and module.weight.ndim == 4]
    with torch.no_grad():
        if modules[-1].bias is not None:
            modules[-1].bias.add_(0.4)
        else:
            modules[-1].weight.add_(0.9 / modules[-1].weight[0].numel())
        for parameter in network.parameters():
            parameter.copy_(parameter.half().float())
        if quantized:
            stack.quantize(network, torch.rand((1, 3, 16, 16), generator=generator))
    return network


def random_enss(generator, scale, features, middle, table=None, hidden=None, **more):
    """Weights large enough for α to span (0, 1), the candidate around ½, every feature alive."""

    checks = checks_of(more)

    def normal(*shape, std):
        return torch.randn(shape, generator=generator) * std

    def random_kernels():
        squared = scale * scale
        inputs = 6 + checks["checked"] + 4 * squared
        kernels = {
            "first.weight": normal(features, inputs, 3, 3, std=(2 / (9 * inputs)) ** 0.5 * 2),
            "first.bias": normal(features, std=0.2),
            "last.weight": normal(5 * squared, features, 3, 3, std=(1 / (9 * features)) ** 0.5),
            "last.bias": normal(5 * squared, std=0.2),
        }
        kernels["last.weight"][:squared] *= 4
        kernels["last.weight"][squared : 4 * squared] *= 0.5
        kernels["last.bias"][squared : 4 * squared] += 0.5
        return enss.join_kernels(kernels)

    if hidden:
        kernels = enss.KernelMlp(enss.kernel_count(scale, features), hidden)
        with torch.no_grad():
            for i, layer in enumerate(kernels.layers[:-1]):
                gain = 6 if i == 0 else 1  # jitters are small
                layer.weight.copy_(normal(*layer.weight.shape, std=gain * (2 / layer.in_features) ** 0.5))
                layer.bias.copy_(normal(*layer.bias.shape, std=0.1))
            strength = kernels.hidden(torch.tensor(HALTON)).square().sum(dim=1).mean().sqrt()
            spread = random_kernels()
            last = kernels.layers[-1]
            last.weight.copy_(normal(*last.weight.shape, std=0.7) * spread.abs()[:, None] / strength)
            last.bias.copy_(spread)
    else:
        kernels = enss.KernelTable(torch.tensor(table), torch.stack([random_kernels() for _ in table]))
    network = enss.Enss(scale, features, middle, kernels, **checks)
    with torch.no_grad():
        for layer in network.body:
            layer.weight.copy_(normal(*layer.weight.shape, std=(2 / (9 * features)) ** 0.5))
            layer.bias.copy_(normal(features, std=0.2))
    # What the file stores in half precision is rounded before the outputs are computed.
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.copy_(parameter.half().float())
    return network


RANDOM_NETWORKS = {
    "clarus": random_clarus,
    "enss": random_enss,
    "nsrr": random_nsrr,
    "mnss": random_mnss,
    "nss": random_nss,
    "srpo": random_srpo,
    "stack": random_stack,
}


def random_inputs(generator, size, away=0.0, table=None, jittered=False, **_):
    width, height = size
    shape = (FRAMES, height, width)

    def uniform(*shape):
        return torch.rand(shape, generator=generator)

    depth = (uniform(*shape, 1) * 6).floor() / 6  # few levels: many ties
    motion = torch.randn((*shape, 2), generator=generator) * 1.5
    for bad in ((float("nan"), 0.0), (0.0, float("inf")), (-1e30, 1e30), (2.0 * (width + height), 0.0)):
        motion[uniform(*shape) < 0.04] = torch.tensor(bad)
    motion[uniform(*shape) < 0.05] = torch.tensor((0.8 * width, -0.6 * height))  # valid, and far outside the image
    period = table if table and len(table) > 1 else HALTON
    jitter = torch.tensor([period[t % len(period)] for t in range(FRAMES)])
    jitter[RESET_AT - 1] += away
    reset = torch.zeros(FRAMES, dtype=torch.int32)
    reset[[0, RESET_AT]] = 1
    inputs = dict(color=uniform(*shape, 3), depth=depth, motion=motion, jitter=jitter, reset=reset)
    return {**inputs, "motion_jitter": jitter} if jittered else inputs


def run(network, inputs):
    network = network.double()
    outputs, inside, state = [], {}, None
    color, depth, motion = (inputs[name].double().permute(0, 3, 1, 2) for name in ("color", "depth", "motion"))
    with torch.no_grad():
        for t in range(FRAMES):
            seen = {}
            images = (image[t : t + 1] for image in (color, depth, operators.mark_invalid(motion)))
            where = inputs.get("motion_jitter", torch.zeros(FRAMES, 2))
            frame = Frame(*images, *(tuple(each[t].tolist()) for each in (inputs["jitter"], where)))
            output, state = network.step(frame, None if inputs["reset"][t] else state, inside=seen)
            outputs.append(output[0].permute(1, 2, 0))
            if t == INSIDE_AT:
                inside = {name: value[0] for name, value in seen.items() if name != "excess"}
    return dict(output=torch.stack(outputs), **inside)


def main():
    parser = argparse.ArgumentParser(description="Write the golden files of the C++ tests.")
    parser.add_argument("directory")
    parser.add_argument("--pipelines", nargs="+", choices=sorted(CASES), default=["enss"])
    arguments = parser.parse_args()
    directory = arguments.directory
    chosen = [(pipeline, *case) for pipeline in arguments.pipelines for case in CASES[pipeline].items()]
    for pipeline, name, case in chosen:
        generator = torch.Generator().manual_seed(list(CASES[pipeline]).index(name))
        network = RANDOM_NETWORKS[pipeline](generator, **case)
        inputs = random_inputs(generator, **case)
        model_file.save(os.path.join(directory, f"{name}.model.safetensors"), network, half=True)
        if name in AS_ONNX:
            graph = onnx.network_graph(network, onnx.smooth_frame(network, (12, 8)))
            onnx.save(os.path.join(directory, f"{name}.onnx"), graph)
        results = run(network, inputs)
        golden = {key: value.numpy() for key, value in inputs.items()}
        golden.update({key: value.numpy().astype(np.float32) for key, value in results.items()})
        facts = {"pipeline": pipeline, "scale": str(case["scale"])}
        if "use" in case:
            facts["use"] = str(case["use"])
        safetensors.save(os.path.join(directory, f"{name}.golden.safetensors"), golden, facts)
        ranges = ", ".join(f"{key} {value.min():.3f} … {value.max():.3f}" for key, value in results.items())
        print(f"{name}: {tuple(results['output'].shape)}, {ranges}")


if __name__ == "__main__":
    main()
