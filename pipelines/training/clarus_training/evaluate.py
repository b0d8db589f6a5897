"""What models gain over bicubic on held-out sequences, as the clarus program computes both.

python3 -m clarus_training.evaluate CLARUS MANIFEST DIRECTORY MODEL... [--markdown] [--json FILE] [--results FILE]
    [--device SELECTOR]

DIRECTORY holds what make_data.py rendered of the manifest. Outputs are compared as floats. Two tables a model: what it
gains over bicubic, and what it has. A scene's figures are means over its frames: of all, of those in segments marked
moving or still, and, where sequences have output buffers, inside the masks of docs/metrics.md (frames that have the
mask). Worst 1 % is of a scene's blocks of 48x48 pixels; worse blocks are those whose error is larger than bicubic's, in
the frames marked moving. Pixel std is in 8-bit levels, averaged over the static segments that `clarus compare` finds.
The last line is the mean over scenes; below it is whether the bars are met that a model of moving pictures should meet.

--results adds the models' rows to a file of such, of the same scenes, as bench/results keeps them; several runs may
share one file.
"""

import argparse
import datetime
import fcntl
import json
import os
import subprocess
import sys
import tempfile

from . import manifest

FORMAT = "clarus-quality"
MASKS = {  # compare's name: heading
    "disoccluded_1": "disoccl. 1",
    "disoccluded_4": "disoccl. 4",
    "disoccluded_8": "disoccl. 8",
    "thin": "thin",
    "moving": "moving pixels",
    "still": "still pixels",
}
GAINS = {  # name: (heading, format)
    "gain": ("gain (dB)", "+.2f"),
    "moving_gain": ("moving", "+.2f"),
    "still_gain": ("still", "+.2f"),
    **{f"in_{mask}_gain": (heading, "+.2f") for mask, heading in MASKS.items()},
    "worst_gain": ("worst 1 %", "+.2f"),
    "worse_blocks": ("worse blocks (%)", ".1f"),
    "pixel_std": ("pixel std", ".2f"),
}
ABSOLUTES = {
    "frames": ("frames", "d"),
    "bicubic_psnr": ("bicubic PSNR", ".2f"),
    "bicubic_ssim": ("SSIM", ".4f"),
    "psnr": ("model PSNR", ".2f"),
    "ssim": ("SSIM", ".4f"),
    **{f"in_{mask}_psnr": (heading, ".2f") for mask, heading in MASKS.items()},
    "worst_psnr": ("worst 1 %", ".2f"),
    "if_ssim": ("IF-SSIM", ".4f"),
    "strred": ("STRRED", ".2f"),
}
BARS = {  # name: (what it is, whether a value meets it, the bar in words)
    "in_disoccluded_4_gain": ("gain where disoccluded 4 (dB)", lambda value: value >= 0, "0 or more"),
    "worse_blocks": ("worse blocks in moving frames (%)", lambda value: value <= 5, "5 at most"),
}


def run(command):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if result.returncode:
        raise SystemExit(f"{' '.join(command)}: {result.stderr.strip()}")
    return result.stdout


def measure(clarus, sequence, model, output, options, baseline=None):
    """What `clarus compare` has to say of a model's images, which stay in the folder `output`: figures of the sequence,
    and frames with theirs; of blocks against those in the folder `baseline`."""
    run([clarus, "upscale", sequence, "--model", model, "--output", output, "--format", "exr", *options])
    against = ["--baseline", baseline] if baseline else []
    return json.loads(run([clarus, "compare", output, sequence, "--json", *against]))


def mean(values):
    values = [value for value in values if value is not None]
    return sum(values) / len(values) if values else None


def difference(value, baseline):
    return None if value is None or baseline is None else value - baseline


def figures_of(entry, model, bicubic):
    """A scene's row: the columns above by name, None where there is no such frame or mask."""
    frames, bicubic_frames = model["frames"], bicubic["frames"]

    def mean_over(of, figure, indices):
        return mean([of[t].get(figure) for t in indices])

    def gain(figure, indices):
        return mean([difference(frames[t].get(figure), bicubic_frames[t].get(figure)) for t in indices])

    every, moving, still = range(len(frames)), entry.frames_of("moving"), entry.frames_of("still")
    worse = mean_over(frames, "worse_blocks", moving)
    row = {
        "scene": entry.name,
        "thin": entry.thin,
        "frames": len(frames),
        "bicubic_psnr": mean_over(bicubic_frames, "psnr", every),
        "bicubic_ssim": mean_over(bicubic_frames, "ssim", every),
        "psnr": mean_over(frames, "psnr", every),
        "ssim": mean_over(frames, "ssim", every),
        "gain": gain("psnr", every),
        "moving_gain": gain("psnr", moving),
        "still_gain": gain("psnr", still),
        "worst_psnr": model.get("worst_blocks_psnr"),
        "worst_gain": difference(model.get("worst_blocks_psnr"), bicubic.get("worst_blocks_psnr")),
        "worse_blocks": None if worse is None else 100 * worse,
        "if_ssim": model.get("if_ssim"),
        "strred": model.get("strred"),
        "pixel_std": model.get("pixel_std"),
    }
    for mask in MASKS:
        row[f"in_{mask}_psnr"] = mean_over(frames, f"{mask}_psnr", every)
        row[f"in_{mask}_gain"] = gain(f"{mask}_psnr", every)
    return row


def mean_row(rows):
    means = {name: mean([row[name] for row in rows]) for name in [*GAINS, *ABSOLUTES]}
    return {"scene": "mean", "thin": False, **means, "frames": sum(row["frames"] for row in rows)}


def table(rows, columns, markdown):
    cells = [["scene"] + [heading for heading, _ in columns.values()]]
    for row in rows:
        named = [row["scene"] + (" (thin features)" if row["thin"] else "")]
        cells.append(named + ["–" if row[c] is None else format(row[c], form) for c, (_, form) in columns.items()])
    if markdown:
        cells.insert(1, ["---"] + ["--:"] * len(columns))
        return "\n".join(f"| {' | '.join(line)} |" for line in cells)
    widths = [max(map(len, column)) for column in zip(*cells)]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(line, widths)) for line in cells)


def bars(rows):
    """A line a bar: the mean over scenes, whether it meets the bar, and the scenes that do not."""
    lines = []
    *scenes, overall = rows
    for name, (what, meets, words) in BARS.items():
        if overall[name] is None:
            lines.append(f"{what}: not measured, should be {words}")
            continue
        missed = [row["scene"] for row in scenes if row[name] is not None and not meets(row[name])]
        verdict = "met" if meets(overall[name]) else "missed"
        scenes_text = f"; not on {', '.join(missed)}" if missed else ""
        lines.append(f"{what}: {overall[name]:.2f}, should be {words}: {verdict} on the mean{scenes_text}")
    return "\n".join(lines)


def evaluate(clarus, entries, directory, models, options):
    """For every model the rows of all scenes and of their mean; and for every model and scene the frames' figures."""
    rows, details = {model: [] for model in models}, {model: {} for model in models}
    for entry in entries:
        sequence = os.path.join(directory, entry.name)
        with tempfile.TemporaryDirectory() as work:
            baseline = os.path.join(work, "bicubic")
            bicubic = measure(clarus, sequence, "bicubic", baseline, options)
            for model in models:
                figures = bicubic
                if model != "bicubic":
                    with tempfile.TemporaryDirectory(dir=work) as output:
                        figures = measure(clarus, sequence, model, output, options, baseline)
                rows[model].append(figures_of(entry, figures, bicubic))
                print(f"{model}, {entry.name}: {rows[model][-1]['gain']:+.2f} dB", file=sys.stderr, flush=True)
                details[model][entry.name] = {"model": figures["frames"], "bicubic": bicubic["frames"]}
        if all(rows[model][-1][f"in_{mask}_psnr"] is None for model in models for mask in MASKS):
            print(f"{entry.name}: no masks, for it has no output buffers (make_data.py)", file=sys.stderr, flush=True)
    for model in models:
        rows[model].append(mean_row(rows[model]))
    return rows, details


def recorded(path, names):
    """The models that a file of results has, by name; none where there is no such file."""
    try:
        with open(path) as file:
            found = json.load(file)
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise SystemExit(f"--results {path}: {error}")
    if not isinstance(found, dict) or found.get("format") != FORMAT or not {"scenes", "models"} <= found.keys():
        raise SystemExit(f"--results {path}: not a file of results, and left as it is")
    if found["scenes"] != names:
        raise SystemExit(f"--results {path}: of other scenes, {', '.join(found['scenes'])}; give another file")
    return found["models"]


def record(path, names, program, rows):
    """Adds every model's rows and mean, the program and the day to a file of results, which it begins if need be."""

    def kept(row):
        return {name: round(value, 5) if isinstance(value, float) else value for name, value in row.items()}

    about = {"program": program, "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")}
    new = {m: {**about, "scenes": [kept(row) for row in of[:-1]], "mean": kept(of[-1])} for m, of in rows.items()}
    folder = os.open(os.path.dirname(os.path.abspath(path)), os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        models = {**recorded(path, names), **new}
        with open(f"{path}.part", "w") as file:
            json.dump({"format": FORMAT, "scenes": names, "models": models}, file, indent=1)
            file.write("\n")
        os.replace(f"{path}.part", path)
    finally:
        os.close(folder)


def main():
    parser = argparse.ArgumentParser(description="Gain over bicubic and absolute figures, in whole and in masks, from the clarus program.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("manifest")
    parser.add_argument("directory")
    parser.add_argument("models", nargs="+", help="names of models, or files; of the sequences' scale")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--only", nargs="+", help="names of sequences, in place of all")
    parser.add_argument("--markdown", action="store_true", help="print the tables for a model card")
    parser.add_argument("--json", metavar="FILE", help="also write the figures, with every frame's, as JSON")
    parser.add_argument("--results", metavar="FILE", help="also add the figures without the frames' to a file of bench/results")
    arguments = parser.parse_args()
    entries = [e for e in manifest.read(arguments.manifest) if not arguments.only or e.name in arguments.only]
    if not entries:
        raise SystemExit(f"{arguments.manifest}: no such sequence")
    names = [entry.name for entry in entries]
    if arguments.results:
        if not os.path.isdir(os.path.dirname(os.path.abspath(arguments.results))):
            raise SystemExit(f"--results {arguments.results}: there is no such folder")
        recorded(arguments.results, names)  # what it cannot be added to is said before hours of work
    options = ["--device", arguments.device]
    rows, details = evaluate(arguments.clarus, entries, arguments.directory, arguments.models, options)
    for model in arguments.models:
        print(f"{model}\n\n{table(rows[model], GAINS, arguments.markdown)}\n")
        print(f"{table(rows[model], ABSOLUTES, arguments.markdown)}\n\n{bars(rows[model])}\n")
    if arguments.json:
        report = {m: {"scenes": rows[m][:-1], "mean": rows[m][-1], "frames": details[m]} for m in arguments.models}
        with open(arguments.json, "w") as file:
            json.dump(report, file, indent=1)
    if arguments.results:
        record(arguments.results, names, run([arguments.clarus, "--version"]).splitlines()[0], rows)


if __name__ == "__main__":
    main()
