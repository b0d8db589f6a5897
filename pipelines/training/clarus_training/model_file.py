"""Networks as model files."""

import numpy as np
import torch

from . import safetensors


def rounding(half):
    """Makes tensors into what a file holds: arrays in half or single precision."""
    return lambda tensor: tensor.detach().cpu().numpy().astype(np.float16 if half else np.float32)


def save(path, network, jitters=None, mlp=False, half=False):
    """Writes a model; `half` stores all but jitters in half precision. For `jitters` and `mlp`: enss.model_tensors."""
    from .pipelines import FILES

    safetensors.save(path, *FILES[network.pipeline].model_tensors(network, jitters, mlp, half))


def load(path):
    """The network of a model file, in single precision."""
    from .pipelines import FILES

    tensors, metadata = safetensors.load(path)
    loaded = {name: torch.tensor(array.astype(np.float32)) for name, array in tensors.items()}
    return FILES[metadata["pipeline"]].load_model(loaded, metadata)
