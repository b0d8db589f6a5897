"""A full NSRR network that starts as a trained fast one: it computes the same (after Chen et al. 2016, Net2Net).

What is new in the U-Net's layers is random, and nobody listens to it yet. The weights of another scale may serve, too.
"""

import torch


def grow(network, small):
    """Puts the weights of `small` into a newly created `network` whose U-Net is at least as wide."""
    same = ("previous_frames", "network_color")
    if any(getattr(network, name) != getattr(small, name) for name in same) or width(network) < width(small):
        raise SystemExit("a network grows into one of as many previous frames, the same colours, and no less width")
    for name in ("features_current", "features_previous", "reweight"):
        if hasattr(small, name):
            getattr(network, name).load_state_dict(getattr(small, name).state_dict())
    with torch.no_grad():
        for stage, skip in (("enc1", None), ("enc2", None), ("bottleneck", None), ("dec2", "enc2"), ("dec1", "enc1")):
            for ours, theirs in zip(getattr(network.unet, stage), getattr(small.unet, stage)):
                kept = list(range(theirs.in_channels))
                if skip:  # a first layer's last inputs are the encoder's
                    unets = (network.unet, small.unet)
                    ours_skipped, skipped = (getattr(unet, skip)[-1].out_channels for unet in unets)
                    begin = ours.in_channels - ours_skipped
                    kept[-skipped:] = range(begin, begin + skipped)
                    skip = None
                outputs = theirs.out_channels
                ours.weight[:outputs] = 0
                ours.weight[:outputs, kept] = theirs.weight
                ours.bias[:outputs] = theirs.bias


def width(network):
    return network.unet.enc1[-1].out_channels
