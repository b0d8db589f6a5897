"""Trains a pipeline: python3 -m clarus_training.train --size s --scale 2 --data DIR... --output DIR --hours H.

The output folder receives `checkpoint.pt` (replaced every few minutes and when the process is told to end; `--resume`
continues from it as if nothing had happened) and `log.csv`. The learning rate falls by half a cosine over the hours or
steps asked for, wherever an interruption came.
"""

import argparse
import contextlib
import csv
import math
import operator
import os
import random
import signal
import time

import torch

from . import dataset, enss_growth, export, history, model_file, nsrr_growth, quantized, safetensors
from . import stack_training, validation
from .frame import run
from .losses import LOSSES
from .pipelines import ABLATIONS, PIPELINES
from .sequence import find

LONGEST_STEP = 10  # seconds
GROWTH = {"enss": enss_growth.grow, "nsrr": nsrr_growth.grow}


def scale(text):
    if text == "any":
        return text
    if text not in map(str, range(2, 7)):
        raise argparse.ArgumentTypeError(f"{text} is neither a whole number from 2 to 6 nor any")
    return int(text)


def parse():
    parser = argparse.ArgumentParser(description="Train a pipeline's network.")
    parser.add_argument("--pipeline", choices=sorted(PIPELINES), default="enss")
    sizes = f"s, m, l for enss; s, m for clarus; full, fast for nsrr; {', '.join(stack_training.SIZES)} for stack"
    parser.add_argument("--size", help=f"of a network that has several: {sizes}")
    scales = "2 to 6; nss: or any, for a network of every scale"
    parser.add_argument("--scale", type=scale, required=True, metavar="SCALE", help=scales)
    data = "sequences, or folders of them; those of other scales are left out"
    parser.add_argument("--data", nargs="+", required=True, help=data)
    parser.add_argument("--validation", nargs="+", default=[], help="likewise, never trained on")
    parser.add_argument("--output", required=True)
    budget = parser.add_mutually_exclusive_group(required=True)
    budget.add_argument("--hours", type=float, help="train for so long")
    budget.add_argument("--steps", type=int, help="train for so many steps")
    parser.add_argument("--resume", action="store_true", help="continue from the output folder's checkpoint")
    parser.add_argument("--start", help="a checkpoint or a model file whose weights to start from")
    whole = "in whole numbers (docs/quantization.md), as --start, a file by `clarus quantize`, has them; its scales stay"
    parser.add_argument("--int8", action="store_true", help=whole)
    parser.set_defaults(entries=None)  # of ENSS's table, where kernels are one: --start's
    parser.add_argument("--teacher", help="a model file whose outputs are learned from, in place of references")
    parser.add_argument("--grow", help="enss, nsrr: a checkpoint of a smaller network, or of another scale, to start from")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--amp", action="store_true", help="convolutions in bfloat16: faster, where the device has it")
    parser.add_argument("--hidden", type=int, default=128, help="enss: units a layer of the kernel-predicting MLP")
    parser.add_argument("--mlp-rate", type=float, default=0.05, help="enss: the MLP's share of the learning rate")
    without = "leave this out: " + "; ".join(f"{name}: {', '.join(each)}" for name, each in ABLATIONS.items())
    parser.add_argument("--without", nargs="+", choices=sum(ABLATIONS.values(), ()), default=[], help=without)
    parser.add_argument("--checked", action="store_true", help="enss, mnss, nsrr: history = checked (docs/history.md)")
    parser.add_argument("--held", action="store_true", help="enss, mnss, nsrr, stack: range = held")
    parser.add_argument("--previous-frames", type=int, choices=range(5), default=4, help="nsrr: frames of history")
    parser.add_argument("--network-color", choices=["ycbcr", "rgb"], default="ycbcr", help="nsrr: colours it works in")
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--clip", type=int, nargs="+", help="lengths of clips, taken in turn")
    parser.add_argument("--crop", type=int, default=64, help="edge of a crop, in render pixels")
    parser.add_argument("--no-turns", action="store_true", help="neither mirror nor transpose the images")
    parser.add_argument("--no-tints", action="store_true", help="leave colours as they are")
    parser.add_argument("--events", action="store_true", help="clips with cuts, fades, flat pictures and bars")
    parser.add_argument("--rate", type=float, help="in place of the pipeline's own")
    parser.add_argument("--last-rate", type=float, default=1e-5)
    parser.add_argument("--decay", type=float, default=0.0, help="AdamW's weight decay")
    parser.add_argument("--ema", type=float, default=0.999, help="of the averages that are evaluated and exported")
    parser.add_argument("--loss", choices=sorted(LOSSES), help="in place of the pipeline's own")
    parser.add_argument("--checkpoint-minutes", type=float, default=3)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    if arguments.scale == "any" and arguments.pipeline != "nss":
        parser.error(f"--scale any: networks of {arguments.pipeline} are of one scale; those of nss serve any")
    if arguments.scale == "any" and arguments.teacher:
        parser.error("--teacher: for networks of one scale, not --scale any")
    if arguments.int8 and not (arguments.start or "").endswith(".safetensors"):
        parser.error("--int8: --start is to be a quantized model file, by `clarus quantize`")
    if arguments.int8 and torch.device(arguments.device).type != "cpu":
        parser.error("--int8: whole numbers are computed by the CPU alone, --device cpu")
    return arguments


def teacher(arguments):
    network = model_file.load(arguments.teacher).to(arguments.device)
    if network.scale != arguments.scale:
        raise SystemExit(f"--teacher {arguments.teacher}: of scale {network.scale}, not {arguments.scale}")
    return network


class Average:
    """Exponentially moving averages of a network's parameters; young ones forget faster."""

    def __init__(self, network, decay):
        self.decay, self.count = decay, 0
        self.parameters = list(network.parameters())
        self.averages = [parameter.detach().clone() for parameter in self.parameters]

    def update(self):
        self.count += 1
        decay = min(self.decay, (1 + self.count) / (10 + self.count))
        with torch.no_grad():
            torch._foreach_mul_(self.averages, decay)
            torch._foreach_add_(self.averages, self.parameters, alpha=1 - decay)

    def swap(self):
        """Puts the averages into the network, or takes them out again."""
        for parameter, average in zip(self.parameters, self.averages):
            parameter.data, average.data = average.data, parameter.data


class WholeNumbers:
    """A quantized model file that learning in whole numbers starts from."""

    def __init__(self, path):
        self.path = path
        self.tensors, self.metadata = safetensors.load(path)
        self.floats, self.layers = quantized.in_floats(self.tensors)
        if not self.layers:
            raise SystemExit(f"--start {path}: no layer is in whole numbers; `clarus quantize` makes such a file")

    @property
    def entries(self):
        """How many sets of kernels it has, where these depend on the jitter."""
        return len(self.tensors["first.bias"]) if "first.bias" in self.tensors else None

    def check(self, network):
        """That it is of the network that the command line asks for."""
        asked = model_file.content(network)[1]
        for key in sorted({*asked, *history.OPTIONS}):
            theirs, ours = (facts.get(key, history.OPTIONS.get(key, ["none"])[0]) for facts in (self.metadata, asked))
            if theirs != ours:
                raise SystemExit(f"--start {self.path}: its {key} is {theirs}, and {ours} is asked for")
        for name in self.layers:
            layer = dict(network.named_modules()).get(name)
            if layer and layer.weight.shape != self.tensors[f"{name}.weight"].shape:
                what = "is of another shape than here: another --size, or a layer that learns in floating point alone"
                raise SystemExit(f"--start {self.path}: {name} {what}")

    def state(self, network, pipeline):
        """Of `network`, whose layers are in whole numbers already."""
        names = [f"{layer}.{key}" for layer in self.layers for key in ("weight", "bias")]
        others = model_file.network_of(self.floats, self.metadata, pipeline).state_dict()
        whole = {name: torch.tensor(self.floats[name], dtype=torch.float32) for name in names}
        return {**network.state_dict(), **others, **whole}


class Training:
    """A network, its optimiser and everything else that a checkpoint holds."""

    def __init__(self, arguments):
        self.arguments = arguments
        self.pipeline = PIPELINES[arguments.pipeline]
        self.rate = arguments.rate or self.pipeline.RATE
        whole = WholeNumbers(arguments.start) if arguments.int8 else None
        arguments.entries = whole and whole.entries
        self.shape = self.pipeline.shape(arguments)
        torch.manual_seed(arguments.seed)
        self.network = self.pipeline.create(**self.shape)
        # Kernels that are a table have a set for each of its jitters and for no other.
        self.turns = not (arguments.no_turns or whole and whole.entries)
        if whole:
            whole.check(self.network)
            quantized.make_trained(self.network, whole.layers)
            self.network.load_state_dict(whole.state(self.network, self.pipeline))
        # Layers in whole numbers make doubles of their weights anyway, and tables have one dimension too many.
        layout = torch.preserve_format if arguments.int8 else torch.channels_last
        self.network.to(arguments.device, memory_format=layout)
        self.teacher = teacher(arguments) if arguments.teacher else None
        self.optimizer = torch.optim.AdamW(
            self.pipeline.parameter_groups(self.network, arguments), lr=self.rate, weight_decay=arguments.decay
        )
        self.average = Average(self.network, arguments.ema)
        self.chance = random.Random(arguments.seed)
        self.iteration, self.elapsed, self.running = 0, 0.0, None

    def save(self, path):
        self.average.swap()
        averaged = {name: tensor.clone() for name, tensor in self.network.state_dict().items()}
        self.average.swap()
        content = dict(
            pipeline=self.arguments.pipeline,
            shape=self.shape,
            network=averaged,
            raw=self.network.state_dict(),
            optimizer=self.optimizer.state_dict(),
            averaged=self.average.count,
            chance=self.chance.getstate(),
            torch=torch.get_rng_state(),
            iteration=self.iteration,
            elapsed=self.elapsed,
            running=self.running,
        )
        torch.save(content, f"{path}.part")
        os.replace(f"{path}.part", path)

    def load(self, path):
        content = torch.load(path, map_location=self.arguments.device)
        self.start_from(content["network"])
        self.network.load_state_dict(content["raw"])
        self.optimizer.load_state_dict(content["optimizer"])
        self.average.count = content["averaged"]
        self.chance.setstate(content["chance"])
        torch.set_rng_state(content["torch"].cpu())
        self.iteration, self.elapsed, self.running = (content[name] for name in ("iteration", "elapsed", "running"))

    def start_from(self, state):
        """The weights and their averages."""
        self.network.load_state_dict(state)
        self.average = Average(self.network, self.arguments.ema)

    def grow_from(self, path):
        GROWTH[self.arguments.pipeline](self.network, export.load_checkpoint(path).to(self.arguments.device))
        self.average = Average(self.network, self.arguments.ema)

    @property
    def progress(self):
        """Of the time or the steps asked for."""
        arguments = self.arguments
        return self.iteration / arguments.steps if arguments.steps else self.elapsed / (3600 * arguments.hours)

    def step(self, clips):
        arguments = self.arguments
        rate = arguments.last_rate + (self.rate - arguments.last_rate) * (1 + math.cos(math.pi * self.progress)) / 2
        rate *= min(1, (self.iteration + 1) / 100)  # Adam's second moments need a few steps to mean something
        for group in self.optimizer.param_groups:
            group["lr"] = rate * group.get("share", 1)
        source = clips[self.iteration % len(clips)]
        frames, reference = source.batch(self.count(source, clips), self.chance, arguments.device)
        if self.teacher:
            with torch.no_grad():
                reference = torch.stack(run(self.teacher, frames))
        kind = torch.device(arguments.device).type
        with torch.autocast(kind, torch.bfloat16, enabled=arguments.amp):
            losses = self.pipeline.loss(self.network, frames, reference, LOSSES.get(arguments.loss), self.progress)
        losses = iter([losses] if torch.is_tensor(losses) else losses)
        while True:
            with torch.autocast(kind, torch.bfloat16, enabled=arguments.amp):
                loss = next(losses, None)
            if loss is None:
                return rate
            self.descend(loss)

    def count(self, source, clips):
        """How many clips of `source` a batch holds.

        Long clips cost more memory and teach accumulation: a batch holds as many frames whatever their length, unless
        the network learns from windows of a clip.
        """
        batch = self.arguments.batch
        if hasattr(self.pipeline, "WINDOW"):
            return batch
        return max(1, batch * min(clip.length for clip in clips) // source.length)

    def descend(self, loss):
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimizer.step()
        self.average.update()
        self.iteration += 1
        self.running = loss.item() if self.running is None else 0.98 * self.running + 0.02 * loss.item()

    def validate(self, held_out):
        """Mean PSNR of the averaged network and of bicubic, over all frames."""
        self.average.swap()
        figures = [figure for sequence in held_out for figure in validation.run(self.network, sequence)]
        self.average.swap()
        return [sum(column) / len(column) for column in zip(*figures)] if figures else [math.nan, math.nan]


class LogTable:
    """A CSV file that grows with a run, resumed or not; what is written is printed too."""

    def __init__(self, path, resumed):
        self.file = open(path, "a" if resumed else "w", newline="", buffering=1)
        self.table = csv.writer(self.file)
        if not resumed:
            self.write("seconds", "iteration", "rate", "loss", "psnr", "bicubic psnr")

    def write(self, *row):
        self.table.writerow(row)
        print(*row, flush=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()


@contextlib.contextmanager
def told_to_end():
    """A list that is empty until the process is interrupted or told to terminate, which then it does not by itself."""
    told = []
    before = {name: signal.signal(name, lambda *_: told.append(name)) for name in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield told
    finally:
        for name, handler in before.items():
            signal.signal(name, handler)


def usable(option, directories, pipeline, scale):
    """The sequences there that the pipeline's network for that scale, or for "any", can be compared on."""
    serves = getattr(pipeline, "serves", operator.eq)
    found = [each for each in find(directories) if each.has_references and serves(scale, each.scale)]
    if not found:
        raise SystemExit(f"{option}: no sequence of scale {scale} with references in {', '.join(directories)}")
    return found


def starting_weights(training, path):
    """Of a checkpoint or of a model file."""
    if path.endswith(".safetensors"):
        trained = model_file.load(path)
        if hasattr(training.pipeline, "adopt"):
            return training.pipeline.adopt(training.network, trained)
        state = trained.state_dict()
    else:
        state = torch.load(path, map_location=training.arguments.device)["network"]
    if not export.same_shape(state, training.network.state_dict()):
        raise SystemExit(f"--start {path}: a network of another shape")
    return state


def main():
    arguments = parse()
    if arguments.grow and arguments.pipeline not in GROWTH:
        raise SystemExit(f"--grow: {arguments.pipeline} has no smaller network to grow from; --start takes its own")
    for name in set(arguments.without).difference(ABLATIONS.get(arguments.pipeline, ())):
        raise SystemExit(f"--without {name}: not of {arguments.pipeline}")
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    torch.set_flush_denormal(True)  # moments of weights that have stopped moving would slow the optimiser down
    os.makedirs(arguments.output, exist_ok=True)
    checkpoint = os.path.join(arguments.output, "checkpoint.pt")
    training = Training(arguments)
    if arguments.resume and os.path.exists(checkpoint):
        training.load(checkpoint)
    elif arguments.start and not arguments.int8:
        training.start_from(starting_weights(training, arguments.start))
    elif arguments.grow:
        training.grow_from(arguments.grow)
    for_network = training.pipeline, arguments.scale
    sequences = usable("--data", arguments.data, *for_network)
    held_out = usable("--validation", arguments.validation, *for_network) if arguments.validation else []
    lengths = arguments.clip or training.pipeline.CLIPS
    kind = dict(turn=training.turns, tint=not arguments.no_tints, eventful=arguments.events)
    kind.update(checked=getattr(training.network, "checked", False), collected=hasattr(training.network, "collects"))
    clips = [dataset.Clips(sequences, length, arguments.crop, **kind) for length in lengths]

    with LogTable(os.path.join(arguments.output, "log.csv"), training.iteration) as log, told_to_end() as told:
        now, last_saved = time.monotonic(), training.elapsed
        while training.progress < 1 and not told:
            rate = training.step(clips)
            # A process that was paused for a while has not trained meanwhile.
            now, before = time.monotonic(), now
            training.elapsed += min(now - before, LONGEST_STEP)
            end = training.progress >= 1 or told
            if end or training.elapsed - last_saved > 60 * arguments.checkpoint_minutes:
                training.save(checkpoint)
                ours, bicubic = training.validate([] if told else held_out)
                figures = [f"{rate:.2e}", f"{training.running:.5f}", f"{ours:.3f}", f"{bicubic:.3f}"]
                log.write(f"{training.elapsed:.0f}", training.iteration, *figures)
                last_saved, now = training.elapsed, time.monotonic()


if __name__ == "__main__":
    main()
