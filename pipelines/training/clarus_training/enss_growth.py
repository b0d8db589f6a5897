"""A larger ENSS network, or one of another scale, that starts as good as a trained smaller one.

Wider and deeper it computes the same (after Chen et al. 2016, Net2Net): new features are random and nobody listens to
them yet; new middle layers hand on what they get. At another scale it computes nearly the same: kernels over the
history, which has s² values a render pixel, are resampled, and what is predicted for s² output pixels is interpolated.
Where the larger one checks its history and the smaller did not, nobody listens to the validity yet.
"""

import torch

from .enss import split_kernels


def grow(network, small):
    """Puts the weights of `small` into a newly created `network` with at least as many features and middle layers."""
    f = small.features
    check_room(network, small)
    with torch.no_grad():
        for i, layer in enumerate(network.body):
            layer.weight[:f], layer.bias[:f] = 0, 0
            if i < len(small.body):
                layer.weight[:f, :f], layer.bias[:f] = small.body[i].weight, small.body[i].bias
            else:
                layer.weight[range(f), range(f), 1, 1] = 1
        for layer, other in zip(network.kernels.layers[:-1], small.kernels.layers[:-1]):
            layer.load_state_dict(other.state_dict())
        last, other = network.kernels.layers[-1], small.kernels.layers[-1]
        last.weight.zero_()  # what is random depends on no jitter
        for theirs, ours in zip(other.weight.T, last.weight.T):
            ours.copy_(grown_kernels(theirs, small, ours, network))
        last.bias.copy_(grown_kernels(other.bias, small, last.bias, network))


def check_room(network, small):
    widths = (("features", small.features, network.features), ("middle layers", len(small.body), len(network.body)))
    for what, theirs, ours in widths:
        if ours < theirs:
            raise SystemExit(f"--grow: the network has {ours} {what}, the checkpoint {theirs}; it cannot grow smaller")
    theirs, ours = (each.kernels.layers[0].out_features for each in (small, network))
    if small.checked and not network.checked:
        raise SystemExit("--grow: the checkpoint's history is checked, the network's is not: --checked")
    if ours != theirs:
        raise SystemExit(f"--grow: the network's MLP has {ours} hidden units, the checkpoint's {theirs}: --hidden {theirs}")


def grown_kernels(vector, small, start, network):
    """A vector of kernels of `small` as one of `network`, where `start` has what new features begin with."""
    result = start.clone()
    theirs = split_kernels(vector, small.scale, small.features, small.checked)
    ours = split_kernels(result, network.scale, network.features, network.checked)
    f, s, t = small.features, small.scale, network.scale
    # 6 inputs of one value a render pixel, 7 where history is checked, then those of the history: 4 channels of s × s.
    lone, their_lone = 6 + network.checked, 6 + small.checked
    ours["first.weight"][:f, :lone] = 0
    ours["first.weight"][:f, :their_lone] = theirs["first.weight"][:, :their_lone]
    history = theirs["first.weight"][:, their_lone:].unflatten(1, (4, s, s))
    fine = history.permute(0, 1, 4, 2, 5, 3).reshape(f, 4, 3 * s, 3 * s)  # a kernel over output pixels
    resampled = resampling(3 * s, 3 * t).to(fine)
    fine = (resampled @ fine @ resampled.T).reshape(f, 4, 3, t, 3, t).permute(0, 1, 3, 5, 2, 4)
    ours["first.weight"][:f, lone:] = fine.flatten(1, 3)
    ours["first.bias"][:f] = theirs["first.bias"]
    ours["last.weight"].zero_()
    between = interpolation(s, t).to(vector)
    for name, part in (("last.weight", ours["last.weight"][:, :f]), ("last.bias", ours["last.bias"])):
        grid = theirs[name].unflatten(0, (5, s, s))
        grid = torch.einsum("yi,xj,cij...->cyx...", between, between, grid)
        part.copy_(grid.flatten(0, 2))
    return result


def resampling(count, finer):
    """A kernel's `count` weights along an axis as `finer` of them with the same sum, by the areas that they share."""
    edges = [torch.arange(n + 1, dtype=torch.float64) / n for n in (finer, count)]
    low = torch.maximum(edges[0][:-1, None], edges[1][None, :-1])
    high = torch.minimum(edges[0][1:, None], edges[1][None, 1:])
    return (high - low).clamp(min=0) * count


def interpolation(count, finer):
    """Values at the centres of `count` parts of a pixel, linearly between and beyond them, at those of `finer` parts."""
    places = (torch.arange(finer, dtype=torch.float64) + 0.5) / finer * count - 0.5
    below = places.floor().clamp(0, count - 2).long()
    matrix = torch.zeros(finer, count, dtype=torch.float64)
    matrix[range(finer), below + 1] = places - below
    matrix[range(finer), below] = 1 - (places - below)
    return matrix
