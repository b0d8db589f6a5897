#!/usr/bin/env python3
"""Renders the sequences of manifests: make_data.py CLARUS MANIFEST DIRECTORY [--scale S] [--size WxH] [--jitter J].

Sequence NAME becomes DIRECTORY/NAME. What is there already is left alone, so that an interrupted run continues; several
runs may work on one folder, on machines that share it too, and each takes what no other has begun.
"""

import argparse
import contextlib
import fcntl
import os
import shutil
import subprocess
import time

from clarus_training import manifest


def render(clarus, entry, scale, directory):
    """Whether it was rendered now: not where it is there already, or another process is at it."""
    folder = os.path.join(directory, entry.name)
    part = f"{folder}.part"
    if os.path.exists(folder):
        return False
    os.makedirs(part, exist_ok=True)
    try:
        lock = os.open(part, os.O_RDONLY)
    except FileNotFoundError:  # another process has just finished it
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.exists(folder):
            work = os.path.join(part, "sequence")
            shutil.rmtree(work, ignore_errors=True)
            command = entry.render_command(clarus, scale, work)
            result = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            if result.returncode:
                raise SystemExit(f"{entry.name}: {result.stderr.strip()}")
            os.rename(work, folder)
        with contextlib.suppress(FileNotFoundError):  # another process may have tidied up
            os.rmdir(part)
    except BlockingIOError:
        return False
    finally:
        os.close(lock)
    return True


def main():
    parser = argparse.ArgumentParser(description="Render the sequences of a manifest.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("manifest")
    parser.add_argument("directory")
    parser.add_argument("--scale", default="2")
    parser.add_argument("--size", help="WxH in place of the manifest's render sizes")
    parser.add_argument("--jitter", help="as clarus render takes it, in place of the manifest's")
    parser.add_argument("--reference-samples", type=int, help="in place of the manifest's")
    parser.add_argument("--output-buffers", action="store_true", help="for all, to measure in masks")
    parser.add_argument("--first", type=int, metavar="N", help="so many sequences from the list's start, in place of all")
    parser.add_argument("--only", nargs="+", help="names of sequences, in place of all")
    arguments = parser.parse_args()
    os.makedirs(arguments.directory, exist_ok=True)
    entries = manifest.read(arguments.manifest)[: arguments.first]
    if arguments.only:
        entries = [entry for entry in entries if entry.name in arguments.only]
    start = time.monotonic()
    for i, entry in enumerate(entries):
        given = {name: getattr(arguments, name) for name in ("size", "jitter", "reference_samples", "output_buffers")}
        entry = entry._replace(**{name: value for name, value in given.items() if value})
        rendered = render(arguments.clarus, entry, arguments.scale, arguments.directory)
        seconds = time.monotonic() - start
        print(f"{i + 1}/{len(entries)} {entry.name}{'' if rendered else ': left alone'} ({seconds:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
