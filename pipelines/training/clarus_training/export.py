"""A checkpoint becomes a model file: python3 -m clarus_training.export CHECKPOINT MODEL [--mlp] [--float32]."""

import argparse

import numpy as np
import torch

from . import enss, operators, safetensors


def model_tensors(network, jitters=None, mlp=None, half=False):
    """A network's tensors and metadata as a model file holds them.

    A table of kernels is baked for `jitters` where they are given, the network's own table is written where it has
    one. The MLP is written where `mlp` asks for it, or nothing else would be there. `half` stores all but the jitters in
    half precision.
    """

    def array(tensor):
        return tensor.detach().cpu().numpy().astype(np.float16 if half else np.float32)

    tensors = {}
    for i, layer in enumerate(network.body):
        tensors[f"body.{i}.weight"], tensors[f"body.{i}.bias"] = array(layer.weight), array(layer.bias)
    if isinstance(network.kernels, enss.KernelTable):
        jitters = network.kernels.jitters.tolist()
    elif mlp or jitters is None:
        for i, layer in enumerate(network.kernels.layers):
            tensors[f"mlp.{i}.weight"], tensors[f"mlp.{i}.bias"] = array(layer.weight), array(layer.bias)
    if jitters is not None:
        table = network.kernels(jitters)
        if len(jitters) > 1:  # a single entry serves every jitter
            tensors["jitter"] = np.array(jitters, dtype=np.float32)
        for name, kernels in enss.split_kernels(table, network.scale, network.features).items():
            tensors[name] = array(kernels)
    metadata = {"pipeline": "enss", "scale": str(network.scale), "features": str(network.features)}
    return tensors, metadata


def load_model(path):
    """The network of a model file, in single precision; its table is used where it has one."""
    tensors, metadata = safetensors.load(path)
    scale, features = int(metadata["scale"]), int(metadata["features"])
    loaded = {name: torch.tensor(array.astype(np.float32)) for name, array in tensors.items()}
    middle = sum(name.startswith("body.") for name in loaded) // 2
    if "first.weight" in loaded:
        names = enss.kernel_shapes(scale, features)
        kernels = enss.KernelTable(
            loaded.get("jitter", torch.zeros(1, 2)), torch.cat([loaded[name].flatten(1) for name in names], dim=1)
        )
    else:
        kernels = enss.KernelMlp(enss.kernel_count(scale, features), loaded["mlp.0.weight"].shape[0])
        for i, layer in enumerate(kernels.layers):
            layer.load_state_dict({"weight": loaded[f"mlp.{i}.weight"], "bias": loaded[f"mlp.{i}.bias"]})
    network = enss.Enss(scale, features, middle, kernels)
    for i, layer in enumerate(network.body):
        layer.load_state_dict({"weight": loaded[f"body.{i}.weight"], "bias": loaded[f"body.{i}.bias"]})
    return network


def load_checkpoint(path):
    """The network of a training checkpoint."""
    checkpoint = torch.load(path, map_location="cpu")
    network = enss.create(*(checkpoint["shape"][name] for name in ("scale", "features", "middle", "hidden")))
    network.load_state_dict(checkpoint["network"])
    return network


def main():
    parser = argparse.ArgumentParser(description="Export a training checkpoint as a Clarus model.")
    parser.add_argument("checkpoint")
    parser.add_argument("model")
    parser.add_argument("--jitters", type=int, default=16, help="length of the Halton sequence to bake kernels for")
    parser.add_argument("--mlp", action="store_true", help="also write the MLP, for jitters the table does not have")
    parser.add_argument("--float32", action="store_true", help="store weights in single precision, not in half")
    arguments = parser.parse_args()
    network = load_checkpoint(arguments.checkpoint)
    jitters = operators.halton_jitter(arguments.jitters)
    tensors, metadata = model_tensors(network, jitters, arguments.mlp, half=not arguments.float32)
    safetensors.save(arguments.model, tensors, metadata)


if __name__ == "__main__":
    main()
