"""What models gain over bicubic on held-out sequences, as the clarus program computes both.

python3 -m clarus_training.evaluate CLARUS MANIFEST DIRECTORY MODEL... [--markdown] [--json FILE] [--device SELECTOR]

DIRECTORY holds what make_data.py rendered of the manifest. Outputs are compared as floats. A scene's figures are means
over its frames, of all or of those in segments marked moving or still; the last line is the mean over scenes. Pixel std
is the specification's, in 8-bit levels, averaged over the static segments that `clarus compare` finds.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile

from . import manifest

COLUMNS = {  # name: (heading, format)
    "frames": ("frames", "d"),
    "bicubic_psnr": ("bicubic PSNR", ".2f"),
    "bicubic_ssim": ("SSIM", ".4f"),
    "psnr": ("model PSNR", ".2f"),
    "ssim": ("SSIM", ".4f"),
    "gain": ("gain", "+.2f"),
    "moving_gain": ("moving", "+.2f"),
    "still_gain": ("still", "+.2f"),
    "pixel_std": ("pixel std", ".2f"),
}


def run(command):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if result.returncode:
        raise SystemExit(f"{' '.join(command)}: {result.stderr.strip()}")
    return result.stdout


def measure(clarus, sequence, model, options):
    """What `clarus compare` has to say of a model: pixel_std, and frames, each with its psnr and ssim."""
    with tempfile.TemporaryDirectory() as output:
        run([clarus, "upscale", sequence, "--model", model, "--output", output, "--format", "exr", *options])
        return json.loads(run([clarus, "compare", output, sequence, "--json"]))


def mean(values):
    values = [value for value in values if value is not None]
    return sum(values) / len(values) if values else None


def figures_of(entry, model_frames, bicubic_frames, spread):
    """A scene's row: the columns above by name, None where there is no such frame."""

    def mean_over(frames, figure, indices):
        return mean([frames[t][figure] for t in indices])

    def gain(indices):
        return mean([model_frames[t]["psnr"] - bicubic_frames[t]["psnr"] for t in indices])

    every = range(len(model_frames))
    return {
        "scene": entry.name,
        "thin": entry.thin,
        "frames": len(model_frames),
        "bicubic_psnr": mean_over(bicubic_frames, "psnr", every),
        "bicubic_ssim": mean_over(bicubic_frames, "ssim", every),
        "psnr": mean_over(model_frames, "psnr", every),
        "ssim": mean_over(model_frames, "ssim", every),
        "gain": gain(every),
        "moving_gain": gain(entry.frames_of("moving")),
        "still_gain": gain(entry.frames_of("still")),
        "pixel_std": spread,
    }


def mean_row(rows):
    means = {name: mean([row[name] for row in rows]) for name in COLUMNS}
    return {"scene": "mean", "thin": False, **means, "frames": sum(row["frames"] for row in rows)}


def table(rows, markdown):
    cells = [["scene"] + [heading for heading, _ in COLUMNS.values()]]
    for row in rows:
        named = [row["scene"] + (" (thin features)" if row["thin"] else "")]
        cells.append(named + ["–" if row[c] is None else format(row[c], form) for c, (_, form) in COLUMNS.items()])
    if markdown:
        cells.insert(1, ["---"] + ["--:"] * len(COLUMNS))
        return "\n".join(f"| {' | '.join(line)} |" for line in cells)
    widths = [max(map(len, column)) for column in zip(*cells)]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(line, widths)) for line in cells)


def evaluate(clarus, entries, directory, models, options):
    """For every model the rows of all scenes and of their mean; and for every model and scene the frames' figures."""
    rows, details = {model: [] for model in models}, {model: {} for model in models}
    for entry in entries:
        sequence = os.path.join(directory, entry.name)
        bicubic = measure(clarus, sequence, "bicubic", options)["frames"]
        for model in models:
            figures = measure(clarus, sequence, model, options)
            rows[model].append(figures_of(entry, figures["frames"], bicubic, figures.get("pixel_std")))
            print(f"{model}, {entry.name}: {rows[model][-1]['gain']:+.2f} dB", file=sys.stderr, flush=True)
            details[model][entry.name] = {"model": figures["frames"], "bicubic": bicubic}
    for model in models:
        rows[model].append(mean_row(rows[model]))
    return rows, details


def main():
    parser = argparse.ArgumentParser(description="PSNR, SSIM, gain and pixel std from the clarus program.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("manifest")
    parser.add_argument("directory")
    parser.add_argument("models", nargs="+", help="names of models, or files; of the sequences' scale")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--only", nargs="+", help="names of sequences, in place of all")
    parser.add_argument("--markdown", action="store_true", help="print the tables for a model card")
    parser.add_argument("--json", metavar="FILE", help="also write the figures, with every frame's, as JSON")
    arguments = parser.parse_args()
    entries = [e for e in manifest.read(arguments.manifest) if not arguments.only or e.name in arguments.only]
    if not entries:
        raise SystemExit(f"{arguments.manifest}: no such sequence")
    options = ["--device", arguments.device]
    rows, details = evaluate(arguments.clarus, entries, arguments.directory, arguments.models, options)
    for model in arguments.models:
        print(f"{model}\n{table(rows[model], arguments.markdown)}")
    if arguments.json:
        report = {m: {"scenes": rows[m][:-1], "mean": rows[m][-1], "frames": details[m]} for m in arguments.models}
        with open(arguments.json, "w") as file:
            json.dump(report, file, indent=1)


if __name__ == "__main__":
    main()
