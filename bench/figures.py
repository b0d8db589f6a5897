#!/usr/bin/env python3
"""Writes the tables of README.md, docs/ and the models' cards from bench/results: figures.py [--check | --record BENCH].

The table NAME stands between <!-- figures: NAME --> and <!-- end of figures -->. --check writes nothing and fails where
one is not what the results give. --record first keeps the times of BENCH, a result of `clarus bench`, in bench/results.
bench/README.md says how results are recorded.
"""

import argparse
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "pipelines" / "training"))

import judge  # noqa: E402
from clarus_training import evaluate  # noqa: E402

QUALITY, TIMES = "bench/results/quality-{}.json", "bench/results/times-1080p.json"
DOCUMENTS = ["README.md", "docs/*.md", "pipelines/*/README.md"]
BEGIN, END = "<!-- figures: ", "<!-- end of figures -->"
BLOCK = re.compile(f"({BEGIN}(.*) -->\n)((?s:.*?))({END})")
SIZE = [1920, 1080]  # of the output, where times are given
MODELS = {  # name: what it is
    "bicubic": "a filter of one frame",
    "fsr1": "AMD's FSR 1, by its description",
    "fsr2": "temporal, of FSR 2's class, no network; any scale",
    "clarus-s": "`fsr2` and a small network that adds to what it shows; any scale",
    "clarus-m": "the same, medium",
    "enss-s-x2": "Mercier et al. 2023, small",
    "enss-m-x2": "medium",
    "enss-l-x2": "large",
}
FILTERS = [*judge.FILTERS, "fsr2"]
ENSS = {of: [f"enss-{size}-{of}" for size in "sml"] for of in ("x2", "x3", "x4")}
ALL = [*FILTERS[1:], "clarus-s", "clarus-m", *ENSS["x2"]]
FIGURES = ["psnr", "gain", "moving_gain", "still_gain", "ssim", "pixel_std"]
IN_MOTION = ["gain", "moving_gain", "still_gain", "in_disoccluded_4_gain", "in_thin_gain", "worse_blocks", "pixel_std"]


def fail(message):
    raise SystemExit(f"figures: {message}")


def read(name, form):
    try:
        found = json.loads((ROOT / name).read_text())
    except (OSError, ValueError) as error:
        fail(f"{name}: {error}")
    if found.get("format") != form:
        fail(f"{name}: not a file of format {form}")
    return found


class Results:
    def __init__(self):
        self.quality = {of: read(QUALITY.format(of), evaluate.FORMAT) for of in judge.SHIPPED}
        self.times = read(TIMES, "clarus-times")

    def of(self, model, sequences):
        if model not in self.quality[sequences]["models"]:
            fail(f"{QUALITY.format(sequences)}: no model {model}")
        return self.quality[sequences]["models"][model]

    def rows(self, model, sequences):
        """A model's scenes and, last, their mean."""
        of = self.of(model, sequences)
        return [*of["scenes"], of["mean"]]

    def dates(self, models, sequences):
        """Of the models' measurements, the first and the last."""
        dates = sorted({self.of(model, sequences)["date"] for model in models})
        return dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"

    def mean(self, model, *figures, sequences="x2"):
        """Cells; there is no gain of bicubic's over itself."""
        row, cells = self.rows(model, sequences)[-1], []
        for figure in figures:
            if figure not in row:
                fail(f"{QUALITY.format(sequences)}: {model} has no {figure}")
            form = {**evaluate.GAINS, **evaluate.ABSOLUTES}[figure][1]
            known = row[figure] is not None and not (model == "bicubic" and figure.endswith("gain"))
            cells.append(format(row[figure], form).replace("-", "−") if known else "–")
        return cells

    def cost(self, model):
        """Cells: milliseconds, with a star where they were not steady, and MiB; – where they were not measured."""
        of = self.times["models"].get(model)
        return [starred(of), f"{of['mib']:.1f}"] if of else ["–", "–"]


def starred(of):
    return f"{of['ms']:.2f}{'' if of['steady'] else '*'}"


def record(bench_file):
    """Keeps of a result of `clarus bench` what the tables give: of its first device, at SIZE in fp32."""
    bench, models = read(pathlib.Path(bench_file).resolve(), "clarus-bench"), {}
    device = bench["devices"][0]
    for item in bench["items"]:
        if (item["device"], item["output_size"], item["precision"]) != (device["profile"]["selector"], SIZE, "fp32"):
            continue
        name = item["model"]["name"]
        if not item["score"]:
            fail(f"{bench_file}: {name} has no score: {item['no_score']}")
        latency, start = item["score"]["latency"], item["start"] or {}
        models[name] = {
            "ms": 1000 * latency["median"],
            "p95": 1000 * latency["p95"],
            "steady": latency["steady"],
            "frames_per_second": item["score"]["frames_per_second"]["median"],
            "mib": item["memory"]["total"] / 2**20,
            "cold": start.get("cold_seconds"),
            "warm": start.get("warm_seconds"),
            "other_size": start.get("other_size_seconds"),
        }
    if not models:
        fail(f"{bench_file}: nothing at {SIZE[0]}x{SIZE[1]} in fp32")
    profile, host = device["profile"], bench["host"]
    found = {
        "format": "clarus-times",
        "source": f"clarus bench, {bench['suite']['commit']}",
        "date": bench["date"][:10],
        "device": f"{profile['name']}, {host['cores']} cores, {profile['platform']} {profile['driver_version']}",
        "steady_within": bench["suite"]["steady_within"],
        "models": models,
    }
    (ROOT / TIMES).write_text(json.dumps(found, indent=1) + "\n")


def table(heads, rows):
    """Texts to the left, numbers, whose heads have a colon for that, to the right."""
    rule = ["--:" if head.endswith(":") else "---" for head in heads]
    lines = [[head.removesuffix(":") for head in heads], rule, *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def times_of(results, models):
    known = [results.times["models"][model] for model in models if model in results.times["models"]]
    within = f"; *: not known to {100 * results.times['steady_within']:.0f} %" if not all(of["steady"] for of in known) else ""
    missing = "; –: not measured there" if len(known) < len(models) else ""
    return f"Times: {results.times['device']}, {results.times['date']}{within}{missing}.\n"


def origin(results, models):
    scenes = len(results.quality["x2"]["scenes"])
    return f"\nQuality: means of {scenes} held-out scenes, {results.dates(models, 'x2')}. {times_of(results, models)}"


def short(results):
    heads = ["×2", "what it is", "PSNR over bicubic, dB:", "flicker (pixel std):", "ms at 1080p:", "memory, MiB:"]
    rows = [
        [f"`{model}`", what, *results.mean(model, "gain", "pixel_std"), *results.cost(model)]
        for model, what in MODELS.items()
    ]
    return table(heads, rows) + origin(results, MODELS)


def long(results):
    heads = ["×2", "PSNR, dB:", "over bicubic:", "moving:", "still:", "SSIM:", "flicker (pixel std):", "ms:", "MiB:"]
    return table(heads, [[f"`{m}`", *results.mean(m, *FIGURES), *results.cost(m)] for m in ALL]) + origin(results, ALL)


def times(results):
    heads = ["1920×1080 output, fp32", "ms:", "p95:", "frames a second:", "MiB:", "cold start, s:", "warm:", "at another size:"]
    rows = []
    for model, of in results.times["models"].items():
        starts = [f"{of['cold']:.1f}", f"{of['warm']:.2f}", f"{of['other_size']:.2f}"] if of["cold"] else ["–"] * 3
        rows.append([f"`{model}`", starred(of), f"{of['p95']:.2f}", f"{of['frames_per_second']:.1f}", f"{of['mib']:.1f}", *starts])
    return table(heads, rows) + "\n" + times_of(results, results.times["models"])


def quality(models, sequences="x2"):
    def of(results):
        heads = [sequences.replace("x", "×"), "PSNR, dB:", "over bicubic:", "moving:", "still:", "SSIM:", "flicker (pixel std):"]
        return table(heads, [[f"`{model}`", *results.mean(model, *FIGURES, sequences=sequences)] for model in models])

    return of


def in_motion(sequences):
    """The means of all that have a card."""

    def of(results):
        heads = ["over bicubic, dB", "all:", "moving:", "still:", "disoccluded 4:", "thin:", "worse blocks, %:", "flicker (pixel std):"]
        return table(heads, [[f"`{m}`", *results.mean(m, *IN_MOTION, sequences=each)] for each in sequences for m in judge.SHIPPED[each]])

    return of


def card(model, sequences):
    def of(results):
        rows = results.rows(model, sequences)
        tables = [evaluate.table(rows, columns, markdown=True) for columns in (evaluate.GAINS, evaluate.ABSOLUTES)]
        return "\n\n".join([*tables, evaluate.bars(rows)]) + "\n"

    return of


TABLES = {
    "models": short,
    "models in full": long,
    "times": times,
    "filters": quality(FILTERS),
    **{f"enss, {of}": quality(models, of) for of, models in ENSS.items()},
    "x1.5 in motion": in_motion(["x1.5"]),
    "x2 in motion": in_motion(["x2", "mnss-x2"]),
    "x3 in motion": in_motion(["x3", "mnss-x3"]),
    "x4 in motion": in_motion(["x4"]),
    **{f"card of {model}, {of}": card(model, of) for of, models in judge.SHIPPED.items() for model in models},
}


def filled(name, text, results):
    """A document with its tables as the results give them, and the names of those that were others."""
    stale = []

    def replace(match):
        begin, table_name, old, end = match.groups()
        if table_name not in TABLES:
            fail(f"{name}: no table is called {table_name}; there are {', '.join(TABLES)}")
        new = TABLES[table_name](results)
        if new != old:
            stale.append(table_name)
        return begin + new + end

    new, count = BLOCK.subn(replace, text)
    if not count == text.count(BEGIN) == text.count(END):
        fail(f"{name}: {BEGIN}NAME --> and {END} do not come in pairs")
    return new, stale


def main():
    parser = argparse.ArgumentParser(description="Write the documents' tables from bench/results.")
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--check", action="store_true", help="write nothing; fail where a table differs")
    either.add_argument("--record", metavar="BENCH", help="a result of clarus bench, whose times are kept")
    arguments = parser.parse_args()
    check = arguments.check
    if arguments.record:
        record(arguments.record)
    results, wrong = Results(), []
    for path in sorted(path for pattern in DOCUMENTS for path in ROOT.glob(pattern)):
        name, text = path.relative_to(ROOT), path.read_text()
        new, stale = filled(name, text, results)
        wrong += [f"{name}: {table_name}" for table_name in stale]
        if stale and not check:
            path.write_text(new)
    for line in wrong:
        print(line, "is not what the results give: bench/figures.py writes it" if check else "written")
    sys.exit(1 if check and wrong else 0)


if __name__ == "__main__":
    main()
