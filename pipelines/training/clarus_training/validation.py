"""The twin's PSNR on whole sequences, beside bicubic: python3 -m clarus_training.validation MODEL SEQUENCE...

MODEL is a model file, or a training's checkpoint (.pt).
"""

import argparse

import torch

from . import export, model_file, operators
from .sequence import find


def psnr(image, reference):
    """10·log₁₀(1/MSE) over all pixels and channels, capped at 100 dB."""
    error = (image.double() - reference.double()).square().mean().clamp(min=1e-10)
    return -10 * torch.log10(error).item()


def rounded(image):
    """As an 8-bit file would hold it."""
    return (image * 255).round() / 255


def run(network, sequence, frames=None):
    """Per frame, the PSNR of the network's output and of bicubic, both as 8-bit files hold them."""
    device = next(network.parameters()).device
    network.scale = sequence.scale
    figures, state = [], None
    with torch.no_grad():
        for t in range(min(len(sequence), frames or len(sequence))):
            frame, reference = sequence.frame(t, device), sequence.images("reference", t, device)
            output, state = network.step(frame, None if sequence.reset[t] else state)
            bicubic = operators.keys_upsample(frame.color, sequence.scale, frame.jitter)
            figures.append((psnr(rounded(output), reference), psnr(rounded(bicubic), reference)))
    return figures


def report(name, ours, bicubic):
    print(f"{name}: {ours:.2f} dB, bicubic {bicubic:.2f} dB, {ours - bicubic:+.2f} dB", flush=True)


def main():
    parser = argparse.ArgumentParser(description="PSNR of a model and of bicubic, computed in PyTorch.")
    parser.add_argument("model")
    parser.add_argument("sequences", nargs="+")
    parser.add_argument("--frames", type=int, help="only so many frames of each sequence")
    parser.add_argument("--per-frame", action="store_true")
    arguments = parser.parse_args()
    load = export.load_checkpoint if arguments.model.endswith(".pt") else model_file.load
    network = load(arguments.model)
    means = []
    for sequence in find(arguments.sequences):
        figures = run(network, sequence, arguments.frames)
        if arguments.per_frame:
            for t, (ours, bicubic) in enumerate(figures):
                print(f"  {t:4}  {ours:6.2f}  {bicubic:6.2f}  {ours - bicubic:+.2f}")
        ours, bicubic = (sum(column) / len(column) for column in zip(*figures))
        means.append((ours, bicubic))
        report(sequence.directory, ours, bicubic)
    if len(means) > 1:
        report("mean", *(sum(column) / len(column) for column in zip(*means)))


if __name__ == "__main__":
    main()
