"""A model as an ONNX graph of one size and jitter: python3 -m clarus_training.onnx MODEL GRAPH.onnx --size 960x540.

A model in whole numbers is exported with QuantizeLinear and DequantizeLinear before each of its layers, which frameworks
compute in whole numbers in their turn.

`--part network` leaves out all but the convolutions and what lies between them. State is inputs and outputs of the
graph. All motion counts as valid, so that the graphs hold no fallbacks for vectors that are not.
"""

import argparse
import inspect
import warnings
from typing import NamedTuple

import torch
from torch import nn

from . import enss, model_file, nss, operators, quantized
from .frame import Frame
from .layers import linear_at_last, through

OPSET = 16  # the first with GridSample


class Graph(NamedTuple):
    """`module`, called with the values of `inputs` in their order, returns as many tensors as `outputs` names."""

    module: nn.Module
    inputs: dict
    outputs: list


class EnssNetwork(nn.Module):
    """The convolutions, with the kernels of one jitter."""

    def __init__(self, network, jitter):
        super().__init__()
        self.network = network
        with torch.no_grad():
            kernels = network.kernels_for([jitter])
        self.kernels = nn.ParameterDict({name.replace(".", "_"): tensor[0] for name, tensor in kernels.items()})

    def forward(self, x):
        kernels = {name.replace("_", ".", 1): tensor for name, tensor in self.kernels.items()}
        return self.network.layers(x, kernels).contiguous()


class EnssFrame(nn.Module):
    """The new state, whose first three channels are the output."""

    def __init__(self, network, jitter):
        super().__init__()
        self.network, self.jitter, self.convolutions = network, jitter, EnssNetwork(network, jitter)

    def forward(self, color, depth, motion, state):
        scale = self.network.scale
        warped = operators.warp(state, operators.dilate(motion, depth, scale), "clamp", 0)
        history = operators.space_to_depth(warped, scale)
        x = self.network.network_input(Frame(color, depth, motion, self.jitter), history)
        state = self.network.blend(history, self.convolutions(x))[0]
        return self.network.within_range(state, color, warped) if self.network.held else state


class NsrrNetwork(nn.Module):
    """Both sets of features, the previous frames' weights, and the U-Net."""

    def __init__(self, network):
        super().__init__()
        self.network = network

    def forward(self, z, raw, maps):
        features = [through(layers, z) for layers in self.sets()]
        weights = [self.network.weights(raw)] if self.network.previous_frames else []
        return (*features, *weights, self.network.unet(maps))

    def sets(self):
        network = self.network
        return [network.features_current] + ([network.features_previous] if network.previous_frames else [])


class MnssNetwork(nn.Module):
    """The convolutions of inpainting, antialiasing and reconstruction."""

    def __init__(self, network):
        super().__init__()
        self.network = network

    def forward(self, difference, seen, blended):
        network = self.network
        antialiased = linear_at_last(network.antialias, seen)
        return network.inpaint(difference), antialiased, linear_at_last(network.reconstruct, blended)


class Call(nn.Module):
    """A network's method or part as a module of its own."""

    def __init__(self, network, name):
        super().__init__()
        self.network, self.name = network, name

    def forward(self, image):
        return getattr(self.network, self.name)(image)


class FrameStep(nn.Module):
    """A network's step, its state one tensor after the other."""

    def __init__(self, network, jitter):
        super().__init__()
        self.network, self.jitter = network, jitter

    def forward(self, color, depth, motion, *state):
        output, state = self.network.step(Frame(color, depth, motion, self.jitter), list(state))
        # A state that begins with the output returns it once.
        return tuple(state) if state and state[0] is output else (output, *state)


class FrameAlone(nn.Module):
    """The step of a network that looks at one frame's colour."""

    def __init__(self, network):
        super().__init__()
        self.network = network

    def forward(self, color):
        return self.network.step(Frame(color, None, None, (0.0, 0.0)))[0]


def own_jitter(network):
    """A jitter that the network has kernels for."""
    if isinstance(getattr(network, "kernels", None), enss.KernelTable):
        return tuple(network.kernels.jitters[-1].tolist())
    return operators.halton_jitter()[1]


def state_after_reset(network, frame):
    """The state after a reset by this frame; maps that NSRR does not have yet are zero."""
    with torch.no_grad():
        state = network.step(frame)[1]
    if network.pipeline == "nsrr":
        outputs, maps = (state[:1], state[1:]) if network.held else ([], state)
        missing = network.previous_frames - len(maps)
        state = outputs + maps + [torch.zeros_like(maps[0])] * missing if maps else outputs
    return state


class Unexportable(SystemExit):
    """What of a model ONNX cannot express."""


def frame_graph(network, frame):
    """A whole frame with this one's jitter. Values of `inputs` are the frame, and its `state_after_reset`."""
    if getattr(network, "checked", False):
        raise Unexportable("a frame with a checked history scatters depth, which cannot be exported; --part network can")
    if network.pipeline in ("clarus", "nss"):
        what = "its frame scatters depth, which cannot be exported; --part network has its convolutions"
        raise Unexportable(f"{network.pipeline}: {what}")
    images = dict(color=frame.color, depth=frame.depth, motion=frame.motion)
    if network.pipeline in ("srpo", "stack"):
        return Graph(FrameAlone(network), {"color": frame.color}, ["output"])
    state = state_after_reset(network, frame)
    if network.pipeline == "enss":
        return Graph(EnssFrame(network, frame.jitter), dict(images, previous_state=state), ["state"])
    module = FrameStep(network, frame.jitter)
    if network.pipeline == "mnss":
        previous = dict(zip(("previous_output", "previous_depth"), state))
        return Graph(module, {**images, **previous}, ["output", "upsampled_depth"])
    kept = ["output"] if network.held else []
    maps = [f"map_{i + 1}" for i in range(len(state) - len(kept))]
    previous = {f"previous_{name}": tensor for name, tensor in zip(kept + maps, state)}
    return Graph(module, {**images, **previous}, ["output", *maps])


def network_graph(network, frame):
    """The convolutions alone, at the frame's size and jitter. Values of `inputs` are noise."""
    generator = torch.Generator().manual_seed(0)
    height, width = frame.color.shape[-2:]

    def noise(channels, factor=1):
        return torch.rand(1, channels, factor * height, factor * width, generator=generator).to(frame.color)

    s = network.scale
    if network.pipeline == "enss":
        return Graph(EnssNetwork(network, frame.jitter), {"x": noise(6 + network.checked + 4 * s * s)}, ["predictions"])
    if network.pipeline == "clarus":
        return Graph(Call(network, "network"), {"x": noise(6 + 4 * network.grid**2)}, ["details"])
    if network.pipeline == "nsrr":
        n = network.previous_frames
        inputs = {"z": noise(4), "raw": noise(4 + 4 * n, s), "maps": noise(12 * (1 + n), s)}
        more = ["features_previous", "weights"] if n else []
        return Graph(NsrrNetwork(network), inputs, ["features_current", *more, "image"])
    if network.pipeline == "mnss":
        inputs = {"difference": noise(4), "seen": noise(6), "blended": noise(3, s)}
        return Graph(MnssNetwork(network), inputs, ["weight", "antialiased", "residual"])
    if network.pipeline == "nss":
        seen = torch.rand(1, 12, nss.padded(height), nss.padded(width), generator=generator).to(frame.color)
        return Graph(Call(network, "autoencoder"), {"seen": seen}, ["kernels", "temporal"])
    if network.pipeline == "srpo":
        return Graph(Call(network, "offsets"), {"color": noise(3)}, ["offsets"])
    channels = {"rgb": 3, "luma": 1}[network.network_color]
    return Graph(Call(network, "run_layers"), {"seen": noise(channels)}, ["image"])


GRAPHS = {"network": network_graph, "frame": frame_graph}


def smooth_frame(network, size, seed=0):
    """A frame of (width, height) without detail, its motion up to three pixels."""
    generator = torch.Generator().manual_seed(seed)
    width, height = size

    def image(channels):
        coarse = torch.rand(1, channels, 2 + height // 16, 2 + width // 16, generator=generator)
        return nn.functional.interpolate(coarse, (height, width), mode="bilinear", align_corners=False)

    return Frame(image(3), image(1), 6 * image(2) - 3, own_jitter(network))


def refuse_quantized(network):
    if any(isinstance(module, quantized.QuantizedConv2d) for module in network.modules()):
        raise SystemExit("a quantized stack's whole numbers cannot be exported; export the one in floating point")


def save(path, graph):
    """Writes the graph; needs no package beside PyTorch."""
    # Since 2.9 the exporter that traces has to be asked for.
    tracing = {"dynamo": False} if "dynamo" in inspect.signature(torch.onnx.export).parameters else {}
    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            graph.module,
            tuple(graph.inputs.values()),
            path,
            input_names=list(graph.inputs),
            output_names=graph.outputs,
            opset_version=OPSET,
            **tracing,
        )


def main():
    parser = argparse.ArgumentParser(description="Export a model as an ONNX graph of one size and jitter.")
    parser.add_argument("model")
    parser.add_argument("graph")
    parser.add_argument("--size", required=True, metavar="WxH", help="the render size")
    parser.add_argument("--part", choices=sorted(GRAPHS), default="frame")
    of_any = "of a model for any scale: the one that it is used at; clarus, 2 unless told, has other convolutions at others"
    parser.add_argument("--scale", type=float, help=of_any)
    arguments = parser.parse_args()
    network = model_file.load(arguments.model, simulated=True)
    refuse_quantized(network)
    if arguments.scale:
        if not getattr(network, "any_scale", False):
            parser.error(f"--scale {arguments.scale:g}: {arguments.model} has a scale of its own, {network.scale}")
        network.scale = arguments.scale
    size = tuple(int(extent) for extent in arguments.size.split("x"))
    graph = GRAPHS[arguments.part](network, smooth_frame(network, size))
    save(arguments.graph, graph)
    shapes = {name: tuple(tensor.shape) for name, tensor in graph.inputs.items()}
    print(f"{arguments.graph}: {shapes} → {', '.join(graph.outputs)}")


if __name__ == "__main__":
    main()
