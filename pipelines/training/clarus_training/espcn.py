"""ESPCN (Shi et al. 2016) to be trained, as a stack of layers; a model file of it is one of pipeline `stack`."""

from . import losses
from .stack import Stack, espcn, load_model, model_tensors

__all__ = ["load_model", "model_tensors"]

CLIPS = [1]
RATE = 1e-3
SIZES = {"s": (22, 32), "l": (64, 32)}  # features: the one that SRPO is compared with; the published one


def shape(arguments):
    size = arguments.size or "s"
    if size not in SIZES:
        raise SystemExit("an ESPCN network is of --size s or l")
    return dict(scale=arguments.scale, features=SIZES[size], held=arguments.held)


def create(scale, features, held=False):
    """A network to be trained, of the luma."""
    return Stack(scale, *espcn(scale, 1, features), "luma", held)


def parameter_groups(network, arguments):
    """The last layer's rate is a tenth of the others', as published."""
    *before, last = [module for module in network.module_list if list(module.parameters())]
    before = [parameter for module in before for parameter in module.parameters()]
    return [{"params": before, "share": 1.0}, {"params": list(last.parameters()), "share": 0.1}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """The mean squared error, as published."""
    return losses.of_clip(network, frames, reference, criterion or losses.l2)
