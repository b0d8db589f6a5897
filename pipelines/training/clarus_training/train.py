"""Trains a pipeline: python3 -m clarus_training.train --size s --scale 2 --data DIR... --output DIR --hours H.

The output folder receives `checkpoint.pt` (replaced every few minutes; `--resume` continues from it) and `log.csv`. The
learning rate falls by half a cosine over the hours asked for, wherever an interruption came.
"""

import argparse
import csv
import math
import os
import time

import torch

from . import dataset, enss, validation
from .losses import LOSSES
from .sequence import find

LONGEST_STEP = 10  # seconds


def parse():
    parser = argparse.ArgumentParser(description="Train a pipeline's network.")
    parser.add_argument("--pipeline", choices=["enss"], default="enss")
    parser.add_argument("--size", choices=sorted(enss.SIZES), required=True)
    parser.add_argument("--scale", type=int, choices=[2, 3, 4], required=True)
    parser.add_argument("--data", nargs="+", required=True, help="sequences, or folders of them")
    parser.add_argument("--validation", nargs="+", default=[], help="sequences that are never trained on")
    parser.add_argument("--output", required=True)
    parser.add_argument("--hours", type=float, required=True)
    parser.add_argument("--resume", action="store_true", help="continue from the output folder's checkpoint")
    parser.add_argument("--start", help="a checkpoint whose weights to start from")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--hidden", type=int, default=128, help="units a layer of the kernel-predicting MLP")
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--clip", type=int, nargs="+", default=[8, 16], help="lengths of clips, taken in turn")
    parser.add_argument("--crop", type=int, default=64, help="edge of a crop, in render pixels")
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--last-rate", type=float, default=1e-5)
    parser.add_argument("--mlp-rate", type=float, default=0.05, help="the MLP's learning rate, as a share of the others'")
    parser.add_argument("--loss", choices=sorted(LOSSES), default="l1")
    parser.add_argument("--checkpoint-minutes", type=float, default=3)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def parameter_groups(network, mlp_share):
    """The MLP's weights apart: each moves a kernel by the sum of many of them, and so is to move less."""
    common = [*network.body.parameters(), network.kernels.layers[-1].bias]
    theirs = [p for p in network.kernels.parameters() if all(p is not other for other in common)]
    return [{"params": common, "share": 1.0}, {"params": theirs, "share": mlp_share}]


def clip_loss(network, images, jitters, loss):
    """The loss over all frames of a clip that starts with a reset."""
    outputs, state = [], None
    color, depth, motion, reference = images
    kernels = network.kernels(jitters)
    for t, jitter in enumerate(jitters):
        state = network.step(color[t], depth[t], motion[t], jitter, state, kernels=kernels[t])
        outputs.append(state[0])
    return loss(torch.stack(outputs), reference)


def save(path, **content):
    torch.save(content, f"{path}.part")
    os.replace(f"{path}.part", path)


def main():
    arguments = parse()
    torch.manual_seed(arguments.seed)
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    os.makedirs(arguments.output, exist_ok=True)
    checkpoint_path = os.path.join(arguments.output, "checkpoint.pt")
    features, middle = enss.SIZES[arguments.size]
    shape = dict(scale=arguments.scale, features=features, middle=middle, hidden=arguments.hidden)
    network = enss.create(**shape).to(arguments.device, memory_format=torch.channels_last)
    optimizer = torch.optim.Adam(parameter_groups(network, arguments.mlp_rate), lr=arguments.rate)
    iteration, elapsed = 0, 0.0
    if arguments.resume and os.path.exists(checkpoint_path):
        checkpoint = torch.load(checkpoint_path, map_location=arguments.device)
        network.load_state_dict(checkpoint["network"])
        optimizer.load_state_dict(checkpoint["optimizer"])
        iteration, elapsed = checkpoint["iteration"], checkpoint["elapsed"]
    elif arguments.start:
        network.load_state_dict(torch.load(arguments.start, map_location=arguments.device)["network"])
    sequences = [s for s in find(arguments.data) if s.scale == arguments.scale]
    held_out = find(arguments.validation) if arguments.validation else []
    clips = [dataset.Clips(sequences, n, arguments.crop, arguments.seed + iteration) for n in arguments.clip]

    budget, now = arguments.hours * 3600, time.monotonic()
    log = open(os.path.join(arguments.output, "log.csv"), "a" if iteration else "w", newline="", buffering=1)
    table = csv.writer(log)
    if not iteration:
        table.writerow(["seconds", "iteration", "rate", "loss", "psnr", "bicubic psnr"])
    running, last_saved = None, elapsed
    while elapsed < budget:
        fall = (1 + math.cos(math.pi * elapsed / budget)) / 2
        rate = arguments.last_rate + (arguments.rate - arguments.last_rate) * fall
        rate *= min(1, (iteration + 1) / 100)  # Adam's second moments need a few steps to mean something
        for group in optimizer.param_groups:
            group["lr"] = rate * group["share"]
        # Long clips cost more memory and teach accumulation: a batch holds as many frames whatever their length.
        source = clips[iteration % len(clips)]
        count = max(1, arguments.batch * min(arguments.clip) // source.length)
        images, jitters = source.batch(count, arguments.device)
        loss = clip_loss(network, images, jitters, LOSSES[arguments.loss])
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        iteration += 1
        running = loss.item() if running is None else 0.98 * running + 0.02 * loss.item()
        # A process that was paused for a while has not trained meanwhile.
        now, before = time.monotonic(), now
        elapsed += min(now - before, LONGEST_STEP)
        if elapsed - last_saved > 60 * arguments.checkpoint_minutes or elapsed >= budget:
            save(
                checkpoint_path,
                network=network.state_dict(),
                optimizer=optimizer.state_dict(),
                shape=shape,
                iteration=iteration,
                elapsed=elapsed,
            )
            figures = [figure for s in held_out for figure in validation.run(network, s, device=arguments.device)]
            ours, bicubic = (sum(c) / len(c) for c in zip(*figures)) if figures else (math.nan, math.nan)
            row = [f"{elapsed:.0f}", iteration, f"{rate:.2e}", f"{running:.5f}", f"{ours:.3f}", f"{bicubic:.3f}"]
            table.writerow(row)
            print(*row, flush=True)
            last_saved, now = elapsed, time.monotonic()


if __name__ == "__main__":
    main()
