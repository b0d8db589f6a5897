"""SRPO beside other upscalers of single images, as its paper compares them (Gu et al. 2022, section 4.1).

python3 -m clarus_training.rasterized CLARUS DIRECTORY --srpo MODEL [--others MODEL...] [--every N] [--keep DIRECTORY]
    [--times BENCH.json --plot FILE.svg]

DIRECTORY holds sequences without jitter whose references have one sample a pixel. The reference is the morphologically
antialiased (MLAA) reference image. SRPO sees the aliased image, and MLAA works on its output; every other upscaler sees
the image antialiased. Figures are the mean over sequences of each one's mean over its frames.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile

from . import trade_off
from .evaluate import mean, run
from .sequence import find
from .single_images import antialias, write_sequence


def images_of(sequence, every):
    """Every n-th frame's files, {color, reference}."""
    return [{kind: frame[kind] for kind in ("color", "reference")} for frame in sequence.frames[::every]]


def measure(clarus, sequence, every, methods, work):
    """Per method {psnr, ssim} of a sequence. Images are left in the folder `work`."""
    images = images_of(sequence, every)
    at = lambda *names: os.path.join(work, *names)
    for image in images:
        for kind, name in image.items():
            os.makedirs(os.path.dirname(at(name)), exist_ok=True)
            shutil.copy(os.path.join(sequence.directory, name), at(name))
    write_sequence(work, images, sequence.facts["render_size"], sequence.scale)
    antialias(clarus, [at(image["reference"]) for image in images], at("antialiased"))
    figures = {}
    for model, option in methods.items():
        output = at("outputs", name_of(model))
        run([clarus, "upscale", work, "--model", model, option, "mlaa", "--output", output])
        figures[model] = json.loads(run([clarus, "compare", output, at("antialiased"), "--json"]))
    return figures


def name_of(model):
    return os.path.basename(model).removesuffix(".safetensors")


def main():
    parser = argparse.ArgumentParser(description="SRPO's comparison with upscalers of single images.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("directory")
    parser.add_argument("--srpo", nargs="+", required=True, metavar="MODEL", help="models that want aliased images")
    others = "beside nearest, bicubic, lanczos, fsr1"
    parser.add_argument("--others", nargs="*", default=[], metavar="MODEL", help=others)
    parser.add_argument("--every", type=int, default=1, metavar="N", help="frames: the first of every N")
    parser.add_argument("--keep", metavar="DIRECTORY", help="to leave each sequence's outputs and references in")
    parser.add_argument("--markdown", action="store_true", help="print a table for a model card")
    parser.add_argument("--times", metavar="JSON", help="a result of `clarus bench -o` with these models, for --plot")
    parser.add_argument("--plot", metavar="SVG", help="to draw PSNR and SSIM over time in")
    arguments = parser.parse_args()
    if bool(arguments.times) != bool(arguments.plot):
        parser.error("--times and --plot: one without the other")
    times = trade_off.times_of(arguments.times) if arguments.times else {}
    methods = dict.fromkeys(["nearest", "bicubic", "lanczos", "fsr1", *arguments.others], "--antialias-input")
    methods.update(dict.fromkeys(arguments.srpo, "--antialias"))
    if len(set(map(name_of, methods))) < len(methods):
        raise SystemExit(f"two models have one name: {', '.join(methods)}")
    if arguments.keep and os.path.exists(arguments.keep):
        raise SystemExit(f"{arguments.keep} is there already; remove it or name another folder")
    figures = {model: [] for model in methods}
    with tempfile.TemporaryDirectory() as temporary:
        for sequence in find([arguments.directory]):
            if any(jitter != (0, 0) for jitter in sequence.jitter):
                raise SystemExit(f"{sequence.directory}: is jittered; render with --jitter none --reference-samples 1")
            name = os.path.relpath(sequence.directory, os.path.dirname(os.path.abspath(arguments.directory)))
            work = os.path.join(temporary, name)
            for model, measured in measure(arguments.clarus, sequence, arguments.every, methods, work).items():
                figures[model].append(measured)
            print(name, file=sys.stderr, flush=True)
        if arguments.keep:
            shutil.copytree(temporary, f"{arguments.keep}.part", dirs_exist_ok=True)
            os.rename(f"{arguments.keep}.part", arguments.keep)
    means = {
        name_of(model): {name: mean([measured[name] for measured in each]) for name in ("psnr", "ssim")}
        for model, each in figures.items()
    }
    rows = [["upscaler", "PSNR", "SSIM"]] + ([["---", "--:", "--:"]] if arguments.markdown else [])
    rows += [[model, f"{each['psnr']:.2f}", f"{each['ssim']:.4f}"] for model, each in means.items()]
    for row in rows:
        print(f"| {' | '.join(row)} |" if arguments.markdown else f"{row[0]:<24}{row[1]:>8}{row[2]:>9}")
    if arguments.plot:
        with open(arguments.plot, "w") as file:
            file.write(trade_off.plot(means, times))


if __name__ == "__main__":
    main()
