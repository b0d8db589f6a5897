"""Stacks of layers to be trained: ESPCN, FSRCNN and the eSR family, as SRPO's paper compares them, of the luma."""

from . import losses
from .stack import Stack, edge_sr, espcn, fsrcnn, load_model, model_tensors

__all__ = ["load_model", "model_tensors"]

CLIPS = [1]
RATE = 1e-3
SIZES = {
    "espcn-s": lambda scale: espcn(scale, 1, (22, 32)),
    "espcn-l": lambda scale: espcn(scale, 1, (64, 32)),  # as published
    "fsrcnn": lambda scale: fsrcnn(scale, 1),
    "esr-max": lambda scale: edge_sr("max", scale, 1, 3),
    "esr-tr": lambda scale: edge_sr("tr", scale, 2, 5),
    "esr-tm": lambda scale: edge_sr("tm", scale, 4, 7),
}


def shape(arguments):
    if arguments.size not in SIZES:
        raise SystemExit(f"a stack is of --size {', '.join(SIZES)}")
    return dict(scale=arguments.scale, size=arguments.size, held=arguments.held)


def create(scale, size, held=False):
    """A network to be trained."""
    return Stack(scale, *SIZES[size](scale), "luma", held)


def parameter_groups(network, arguments):
    """The rate of ESPCN's and FSRCNN's last layer is a tenth of the others', as published."""
    *before, last = [module for module in network.module_list if list(module.parameters())]
    if not before:
        return [{"params": list(last.parameters())}]
    before = [parameter for module in before for parameter in module.parameters()]
    return [{"params": before, "share": 1.0}, {"params": list(last.parameters()), "share": 0.1}]


def loss(network, frames, reference, criterion=None, progress=1.0):
    """The mean squared error, as published."""
    return losses.of_clip(network, frames, reference, criterion or losses.l2)
