"""A checkpoint becomes a model file: python3 -m clarus_training.export CHECKPOINT MODEL [--mlp] [--float32]."""

import argparse

import torch

from . import clarus, model_file, operators, quantized
from .pipelines import PIPELINES


def load_checkpoint(path):
    """The network of a training checkpoint, with its averaged weights."""
    checkpoint = torch.load(path, map_location="cpu")
    network = PIPELINES[checkpoint["pipeline"]].create(**checkpoint["shape"])
    quantized.make_trained(network, quantized.layers_of(checkpoint["network"]))
    network.load_state_dict(checkpoint["network"])
    return network


def load(path):
    """The network of a checkpoint or of a model file."""
    return model_file.load(path) if path.endswith(".safetensors") else load_checkpoint(path)


def same_shape(state, other):
    """Whether two networks' tensors agree in their names and shapes."""
    return {name: t.shape for name, t in state.items()} == {name: t.shape for name, t in other.items()}


def mix(network, other, share):
    """Moves a network's weights by a share of the way to those of another training of it, with the same jitters and, in
    whole numbers, the same scales.
    """
    theirs = dict(other.named_buffers())
    for name, buffer in network.named_buffers():
        if not torch.equal(buffer, theirs[name]):
            raise SystemExit(f"--mix: {name} of the two networks differ")
    theirs = dict(other.named_parameters())
    with torch.no_grad():
        for name, parameter in network.named_parameters():
            parameter.lerp_(theirs[name], share)


def main():
    parser = argparse.ArgumentParser(description="Export a training checkpoint as a Clarus model.")
    parser.add_argument("checkpoint")
    parser.add_argument("model")
    parser.add_argument(
        "--jitters", type=int, default=32, help="enss: bake kernels for so many Halton jitters, and shorter sequences"
    )
    parser.add_argument(
        "--mix", nargs=2, metavar=("CHECKPOINT", "SHARE"), help="weights that much nearer those of a later training"
    )
    parser.add_argument(
        "--join",
        nargs="+",
        metavar="FILE",
        help="clarus: checkpoints of the other scales, or a model file that has them, for one model of any scale",
    )
    parser.add_argument("--mlp", action="store_true", help="also write the MLP, for jitters the table does not have")
    parser.add_argument("--float32", action="store_true", help="store weights in single precision, not in half")
    arguments = parser.parse_args()
    jitters = operators.halton_jitter(arguments.jitters)
    network = load_checkpoint(arguments.checkpoint)
    if getattr(network, "without", ()):
        raise SystemExit(
            f"{arguments.checkpoint}: trained without {', '.join(network.without)}, which no model file can say"
        )
    if arguments.mix:
        other = load_checkpoint(arguments.mix[0])
        if not same_shape(network.state_dict(), other.state_dict()):
            raise SystemExit(f"--mix {arguments.mix[0]}: a network of another shape")
        mix(network, other, float(arguments.mix[1]))
    if arguments.join:
        networks = [network, *map(load, arguments.join)]
        if any(each.pipeline != "clarus" for each in networks):
            raise SystemExit("--join: networks of pipeline clarus make one of any scale, and of no other")
        network = clarus.joined(networks)
    model_file.save(arguments.model, network, jitters, arguments.mlp, half=not arguments.float32)


if __name__ == "__main__":
    main()
