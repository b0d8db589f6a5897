#!/usr/bin/env python3
"""Trains every shipped model, in order: ladder.py LADDER DATA RUNS [--only NAME...] [--scale-hours F] [--processes N] [--dry-run].

LADDER is a list of runs, as ladder.json: `name`, `arguments` of clarus_training.train, `hours`, where it has one `grow`,
the run whose checkpoint it starts from, and `data`, its folders within DATA ("x2" unless told). Run NAME is trained in
RUNS/NAME. What is finished is left alone, what was interrupted goes on: give the command again after any end, an interrupt
included.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import time

COMMON = ["--amp"]


class Run:
    def __init__(self, facts, data, runs, share):
        self.name, self.grow = facts["name"], facts.get("grow")
        self.hours = facts["hours"] * share
        self.output = os.path.join(runs, self.name)
        words = [sys.executable, "-m", "clarus_training.train", *facts["arguments"].split(), *COMMON]
        folders = facts.get("data", "x2").split()
        words += ["--data", *(os.path.join(data, folder) for folder in folders), "--output", self.output]
        words += ["--hours", str(self.hours), "--resume"]
        if self.grow:
            words += ["--grow", os.path.join(runs, self.grow, "checkpoint.pt")]
        self.words = words

    def start(self):
        os.makedirs(self.output, exist_ok=True)
        with open(os.path.join(self.output, "output.txt"), "a") as log:
            return subprocess.Popen(self.words, stdout=log, stderr=log)

    def is_finished(self):
        """By its log: the last row's seconds."""
        try:
            with open(os.path.join(self.output, "log.csv")) as file:
                return float(file.read().split()[-1].split(",")[0]) >= 3600 * self.hours - 1
        except (OSError, ValueError, IndexError):
            return False


def read(path, data, runs, share):
    with open(path) as file:
        listed = json.load(file)
    names = [facts["name"] for facts in listed]
    for i, facts in enumerate(listed):
        unknown = set(facts) - {"name", "arguments", "hours", "grow", "data"}
        if unknown or facts.get("grow", names[0]) not in names[: i + 1] or names.count(facts["name"]) > 1:
            raise SystemExit(f"{path}: {facts['name']}: a key or a run to grow from that is not known, or its name twice")
    return [Run(facts, data, runs, share) for facts in listed]


def main():
    parser = argparse.ArgumentParser(description="Train every shipped model, in order.")
    parser.add_argument("ladder")
    parser.add_argument("data", help="the folder of the folders of sequences")
    parser.add_argument("runs", help="the folder of the runs' folders")
    parser.add_argument("--only", nargs="+", help="names of runs, in place of all")
    parser.add_argument("--scale-hours", type=float, default=1, help="times the hours of every run")
    parser.add_argument("--processes", type=int, default=1, help="runs at once, a thread each")
    parser.add_argument("--dry-run", action="store_true", help="print the commands that are left")
    arguments = parser.parse_args()
    runs = read(arguments.ladder, arguments.data, arguments.runs, arguments.scale_hours)
    by_name = {run.name: run for run in runs}
    if unknown := set(arguments.only or ()) - set(by_name):
        raise SystemExit(f"--only {min(unknown)}: not in {arguments.ladder}")
    left = [run for run in runs if run.name in (arguments.only or by_name) and not run.is_finished()]
    if arguments.dry_run:
        for run in left:
            print(" ".join(run.words))
        return
    if arguments.processes > 1:
        for run in left:
            run.words += ["--threads", "1"]
    failed = train(left, by_name, arguments.processes)
    if failed:
        raise SystemExit(f"failed, see output.txt there: {', '.join(failed)}")


def train(left, by_name, processes):
    """Runs what is left, as many at once as `processes`; returns the names of those that failed."""
    working, failed, told = {}, [], []
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda number, _: told.append(number))
    while working or (left and not told):
        ready = [run for run in left if not run.grow or by_name[run.grow].is_finished()]
        while ready and len(working) < processes and not told:
            run = ready.pop(0)
            left.remove(run)
            working[run] = run.start()
            print(f"{run.name}: {run.hours:g} h, in {run.output}", flush=True)
        if not working:
            print(f"left out, for what they grow from is not finished: {', '.join(run.name for run in left)}")
            return failed
        time.sleep(0.2)
        if told:
            for process in working.values():
                process.terminate()  # it writes its checkpoint, and ends; told again, it does no more
        for run, process in list(working.items()):
            if (told and process.wait() is not None) or process.poll() is not None:
                del working[run]
                print(f"{run.name}: {'finished' if run.is_finished() else 'ended early'}", flush=True)
                failed += [run.name] if process.returncode else []
    return failed


if __name__ == "__main__":
    main()
