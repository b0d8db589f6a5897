"""Networks as model files."""

import numpy as np
import torch

from . import quantized, safetensors


QUANTIZED = ("stack",)  # pipelines whose networks run here as the program runs their quantized files


def rounding(half):
    """Makes tensors into what a file holds: arrays in half or single precision."""
    return lambda tensor: tensor.detach().cpu().numpy().astype(np.float16 if half else np.float32)


def plain_tensors(network, half, facts=None):
    """A model file's content where tensors are called as in the network."""
    array = rounding(half)
    tensors = {name: array(tensor) for name, tensor in network.state_dict().items()}
    metadata = {"pipeline": network.pipeline, "scale": network.scale, **(facts or {})}
    return tensors, {key: str(value) for key, value in metadata.items()}


def save(path, network, jitters=None, mlp=False, half=False):
    """Writes a model; `half` stores all but jitters in half precision. For `jitters` and `mlp`: enss.model_tensors."""
    from .pipelines import FILES

    module = FILES[network.pipeline]
    if hasattr(module, "model_tensors"):
        content = module.model_tensors(network, jitters, mlp, half)
    else:
        content = plain_tensors(network, half)
    safetensors.save(path, *content)


def load(path, simulated=False):
    """The network of a model file, in single precision. `simulated`: one in whole numbers, but for stacks, with
    quantized.SimulatedConv2d in place of its layers; what layers of ENSS's kernels read is in its attribute `quantized`.
    """
    from .pipelines import FILES

    tensors, metadata = safetensors.load(path)
    layers = {}
    if simulated and metadata["pipeline"] not in QUANTIZED:
        tensors, layers = quantized.in_floats(tensors)
    network = network_of(path, tensors, metadata, FILES[metadata["pipeline"]])
    if layers:
        network.quantized = quantized.simulate(network, tensors, layers)
    return network


def network_of(path, tensors, metadata, module):
    floats = {name: array.astype(np.float32) for name, array in tensors.items() if array.dtype.kind == "f"}
    loaded = {name: torch.tensor(array) for name, array in {**tensors, **floats}.items()}
    if any(array.dtype == np.int8 for array in tensors.values()) and metadata["pipeline"] not in QUANTIZED:
        raise SystemExit(f"{path} is quantized, and here only stacks are computed in whole numbers; `clarus` runs it")
    if hasattr(module, "load_model"):
        return module.load_model(loaded, metadata)
    network = module.create(scale=int(metadata["scale"]))
    network.load_state_dict(loaded)
    return network
