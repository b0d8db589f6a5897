"""A small MLP in place of a checkpoint's large one: python3 -m clarus_training.distil CHECKPOINT OUTPUT [--hidden 64].

ENSS only. The small one is fitted to the kernels that the large one predicts, on jitters all over the pixel and those
of Halton-32; what that costs is said as the error of the kernels and, given --validation, in dB. OUTPUT is a
checkpoint, to be exported as one.
"""

import argparse
import math

import torch

from . import enss, export, operators, validation
from .sequence import find

TABLE = 32
POOL, BATCH = 8192, 128  # jitters all over the pixel, and how many of them a step looks at


def fit(teacher, hidden, steps, rate=2e-3, seed=0):
    """A KernelMlp of `hidden` units a layer that predicts what the teacher does, and the share of variance missed."""
    torch.manual_seed(seed)
    last = teacher.layers[-1]
    student = enss.KernelMlp(last.out_features, hidden)
    table = torch.tensor(operators.halton_jitter(TABLE))
    with torch.no_grad():
        enss.start_hidden_layers(student)
        axis = torch.linspace(-0.5, 0.5, 33)
        grid = torch.cat((table, torch.cartesian_prod(axis, axis)))
        # Kernels vary along few directions: their coordinates there are as many numbers to learn, not thousands. They
        # are found among the teacher's hidden units, which are as many as its kernels have dimensions at the most.
        seen = teacher.hidden(grid)
        mean = seen.mean(dim=0)
        variance, directions = torch.linalg.eigh((seen - mean).T @ (seen - mean))
        spread = (variance.clamp(min=0).sqrt() * directions).T @ last.weight.T
        _, strength, basis = torch.linalg.svd(spread, full_matrices=False)
        kept = min(hidden, int((strength > 1e-4 * strength[0]).sum()))
        basis, scale = basis[:kept], strength[0] / math.sqrt(len(grid))
        to_coordinates = last.weight.T @ basis.T / scale

        jitters = torch.rand(POOL, 2) - 0.5
        table_target, pool_target = ((teacher.hidden(each) - mean) @ to_coordinates for each in (table, jitters))

    coordinates = torch.nn.Linear(hidden, kept)
    optimizer = torch.optim.Adam([*student.layers[:-1].parameters(), *coordinates.parameters()])
    for step in range(steps):
        for group in optimizer.param_groups:
            group["lr"] = 1e-6 + rate * (1 + math.cos(math.pi * step / steps)) / 2
        drawn = torch.randint(POOL, (BATCH,))
        predicted = coordinates(student.hidden(torch.cat((table, jitters[drawn]))))
        loss = (predicted - torch.cat((table_target, pool_target[drawn]))).square().sum(dim=1).mean()
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        optimizer.step()
    with torch.no_grad():
        student.layers[-1].weight.copy_(scale * (basis.T @ coordinates.weight))
        student.layers[-1].bias.copy_(last.weight @ mean + last.bias + scale * (coordinates.bias @ basis))
        wanted = teacher(grid)
        missed = (student(grid) - wanted).square().sum() / (wanted - wanted.mean(dim=0)).square().sum()
    return student, missed.item()


def main():
    parser = argparse.ArgumentParser(description="Fit a small kernel-predicting MLP to a large one.")
    parser.add_argument("checkpoint")
    parser.add_argument("output")
    parser.add_argument("--hidden", type=int, default=64)
    parser.add_argument("--steps", type=int, default=4000)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--validation", nargs="+", default=[], help="sequences on which to say what it costs")
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    checkpoint = torch.load(arguments.checkpoint, map_location="cpu")
    network = export.load_checkpoint(arguments.checkpoint)
    student, missed = fit(network.kernels, arguments.hidden, arguments.steps)
    print(f"kernels: {100 * missed:.3f} % of their variance over the pixel is missed")
    shape = {**checkpoint["shape"], "hidden": arguments.hidden}
    small = enss.Enss(network.scale, network.features, len(network.body), student)
    small.body.load_state_dict(network.body.state_dict())
    torch.save(dict(pipeline="enss", shape=shape, network=small.state_dict()), arguments.output)
    for sequence in find(arguments.validation) if arguments.validation else []:
        large_psnr, small_psnr = (
            sum(ours for ours, _ in figures) / len(figures)
            for figures in (validation.run(network, sequence), validation.run(small, sequence))
        )
        print(f"{sequence.directory}: {large_psnr:.3f} dB, {small_psnr - large_psnr:+.3f} dB")


if __name__ == "__main__":
    main()
