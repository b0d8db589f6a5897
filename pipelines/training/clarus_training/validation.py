"""The twin's PSNR on whole sequences, beside bicubic: python3 -m clarus_training.validation MODEL SEQUENCE...

MODEL is a model file, or a training's checkpoint (.pt). --library runs a model file in Clarus's library as well, by the
Python package (docs/python.md), and says how far its outputs are from PyTorch's.
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


class Library:
    """A model file in Clarus's library, for a sequence's frames in their order; `distance` is how far its outputs have been
    from PyTorch's at most."""

    def __init__(self, path, sequence, device):
        import clarus  # which training does without

        height, width = sequence.color.shape[1:3]
        self._upscaler = clarus.Upscaler(
            path, (width, height), scale=sequence.scale, device=device,
            motion_sampled_at_jitter=sequence.motion_jitter is sequence.jitter)
        self.distance = 0.0

    def compare(self, frame, reset, output):
        """Upscales a batch of one frame, of which PyTorch made `output`."""
        color, depth, motion = (image[0].movedim(0, 2).contiguous().numpy() for image in frame[:3])
        ours = torch.from_numpy(self._upscaler.upscale(color, depth, motion, jitter=frame.jitter, reset=reset))
        self.distance = max(self.distance, (ours.movedim(2, 0) - output[0]).abs().max().item())


def run(network, sequence, frames=None, library=None):
    """Per frame, the PSNR of the network's output and of bicubic, both as 8-bit files hold them. `library` has the same
    frames to compare."""
    device = next(network.parameters(), torch.empty(0)).device  # layers in whole numbers have none
    network.scale = sequence.scale
    figures, state = [], None
    with torch.no_grad():
        for t in range(min(len(sequence), frames or len(sequence))):
            frame, reference = sequence.frame(t, device), sequence.images("reference", t, device)
            output, state = network.step(frame, None if sequence.reset[t] else state)
            bicubic = operators.keys_resample(frame.color, sequence.scale, reference.shape[2:], frame.jitter).clamp(0, 1)
            if library:
                library.compare(frame, sequence.reset[t], output)
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
    parser.add_argument("--library", action="store_true", help="how far the library's outputs are from PyTorch's")
    parser.add_argument("--device", default="auto", help="of the library; clarus devices lists them")
    arguments = parser.parse_args()
    is_checkpoint = arguments.model.endswith(".pt")
    if arguments.library and is_checkpoint:
        parser.error(f"--library takes a model file, not {arguments.model}; clarus_training.export writes one")
    network = (export.load_checkpoint if is_checkpoint else model_file.load)(arguments.model)
    means = []
    for sequence in find(arguments.sequences):
        library = Library(arguments.model, sequence, arguments.device) if arguments.library else None
        figures = run(network, sequence, arguments.frames, library)
        if arguments.per_frame:
            for t, (ours, bicubic) in enumerate(figures):
                print(f"  {t:4}  {ours:6.2f}  {bicubic:6.2f}  {ours - bicubic:+.2f}")
        ours, bicubic = (sum(column) / len(column) for column in zip(*figures))
        means.append((ours, bicubic))
        report(sequence.directory, ours, bicubic)
        if library:
            print(f"  the library's outputs differ from PyTorch's by {library.distance:.1e} at most", flush=True)
    if len(means) > 1:
        report("mean", *(sum(column) / len(column) for column in zip(*means)))


if __name__ == "__main__":
    main()
