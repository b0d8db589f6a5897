"""Networks as model files."""

import numpy as np
import torch

from . import quantized, safetensors


def rounding(half):
    """Makes tensors into what a file holds: arrays in half or single precision."""
    return lambda tensor: tensor.detach().cpu().numpy().astype(np.float16 if half else np.float32)


def plain_tensors(network, half, facts=None):
    """A model file's content where tensors are called as in the network."""
    array = rounding(half)
    tensors = {name: array(tensor) for name, tensor in network.state_dict().items()}
    whole, quantization = quantized.tensors_of(network)
    metadata = {"pipeline": network.pipeline, "scale": network.scale, **(facts or {}), **quantization}
    return {**tensors, **whole}, {key: str(value) for key, value in metadata.items()}


def save(path, network, jitters=None, mlp=False, half=False):
    """Writes a model; `half` stores all but jitters in half precision. For `jitters` and `mlp`: enss.model_tensors."""
    safetensors.save(path, *content(network, jitters, mlp, half))


def content(network, jitters=None, mlp=False, half=False):
    """The tensors and metadata that `save` writes."""
    from .pipelines import PIPELINES

    module = PIPELINES[network.pipeline]
    if hasattr(module, "model_tensors"):
        return module.model_tensors(network, jitters, mlp, half)
    return plain_tensors(network, half)


def load(path, simulated=False):
    """The network of a model file, in single precision. `simulated`: one in whole numbers, but for stacks, with
    quantized.SimulatedConv2d in place of its layers; what layers of ENSS's kernels read is in its attribute `quantized`.
    """
    from .pipelines import PIPELINES

    tensors, metadata = safetensors.load(path)
    module = PIPELINES[metadata["pipeline"]]
    if metadata["pipeline"] == "stack":  # which lists its layers, and so makes them itself
        return network_of(tensors, metadata, module)
    floats, layers = quantized.in_floats(tensors)
    network = network_of(floats, metadata, module)
    if simulated:
        network.quantized = quantized.simulate(network, floats, layers)
    else:
        quantized.make_exact(network, tensors)
    return network


def network_of(tensors, metadata, module):
    floats = {name: array.astype(np.float32) for name, array in tensors.items() if array.dtype.kind == "f"}
    loaded = {name: torch.tensor(array) for name, array in {**tensors, **floats}.items()}
    if hasattr(module, "load_model"):
        return module.load_model(loaded, metadata)
    network = module.create(scale=int(metadata["scale"]))
    network.load_state_dict(loaded)
    return network
