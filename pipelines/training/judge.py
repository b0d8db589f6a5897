#!/usr/bin/env python3
"""Measures what is shipped on the held-out scenes: judge.py CLARUS DATA RESULTS [--sequences KIND...] [--models NAME...].

The list's scenes are rendered into DATA/held_out-KIND where they are not there yet, apart from what is trained on, and
every model's figures are added to RESULTS/quality-KIND.json, of which bench/figures.py makes the tables of the models'
cards. A KIND is what some models want to be shown: a scale, and a jitter.
"""

import argparse
import os
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
HELD_OUT = os.path.join(HERE, "held_out.json")
FILTERS = ["nearest", "bilinear", "bicubic", "lanczos", "fsr1"]
RENDERED = {  # as make_data.py takes it
    "x1.5": ["--scale", "1.5", "--size", "512x288"],
    "x2": ["--scale", "2"],
    "x3": ["--scale", "3", "--size", "256x144"],
    "x4": ["--scale", "4", "--size", "192x108"],
    "mnss-x2": ["--scale", "2", "--jitter", "mnss"],
    "mnss-x3": ["--scale", "3", "--size", "256x144", "--jitter", "mnss"],
}
ANY = ["fsr2", "clarus-s", "clarus-m"]  # of any scale
SHIPPED = {  # what works in time, and so is judged by what moves
    "x1.5": ANY,
    "x2": [*ANY, "enss-s-x2", "enss-m-x2", "enss-l-x2", "nsrr-x2"],
    "x3": [*ANY, "enss-s-x3", "enss-m-x3", "enss-l-x3"],
    "x4": [*ANY, "enss-s-x4", "enss-m-x4", "enss-l-x4", "nsrr-fast-x4", "nsrr-x4"],
    "mnss-x2": ["mnss-x2"],
    "mnss-x3": ["mnss-x3"],
}


def python(*words):
    path = os.pathsep.join(filter(None, [HERE, os.environ.get("PYTHONPATH")]))
    result = subprocess.run([sys.executable, *words], env={**os.environ, "PYTHONPATH": path})
    if result.returncode:
        raise SystemExit(f"judge.py: ended, for this failed: {' '.join(words)}")


def main():
    parser = argparse.ArgumentParser(description="Measure what is shipped on the held-out scenes.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("data", help="where the scenes are, or are to be")
    parser.add_argument("results", help="the folder of quality-KIND.json")
    parser.add_argument("--sequences", nargs="+", choices=RENDERED, default=list(RENDERED), metavar="KIND")
    parser.add_argument("--models", nargs="+", help="in place of all that are shipped; those of other kinds are left out")
    parser.add_argument("--device", default="auto")
    arguments = parser.parse_args()
    known = {name for names in SHIPPED.values() for name in names} | set(FILTERS)
    unknown = set(arguments.models or ()) - known
    if unknown:
        parser.error(f"--models {' '.join(sorted(unknown))}: none of {', '.join(sorted(known))}")
    os.makedirs(arguments.results, exist_ok=True)
    for kind in arguments.sequences:
        usual = SHIPPED[kind] + (FILTERS if kind == "x2" else [])
        models = [name for name in usual if name in (arguments.models or usual)]
        if not models:
            continue
        folder = os.path.join(arguments.data, f"held_out-{kind}")
        path = os.path.join(arguments.results, f"quality-{kind}.json")
        python(os.path.join(HERE, "make_data.py"), arguments.clarus, HELD_OUT, folder, *RENDERED[kind])
        words = [arguments.clarus, HELD_OUT, folder, *models, "--device", arguments.device, "--results", path]
        python("-m", "clarus_training.evaluate", *words)


if __name__ == "__main__":
    main()
