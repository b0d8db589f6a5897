#!/usr/bin/env python3
"""Commands in which one call fails: of OpenCL, of the system, an allocation, a thread that is begun. Whatever it is, the
command ends, says what failed, or gives what it gives without; no file is half written under its name, nothing is left
of what was not finished, and what OpenCL made is released.

Usage: faults_test.py [--every] [--only WORD] TOOL LAYER SYSTEM MODEL

LAYER and SYSTEM are the modules of calls.cpp and system.cpp, MODEL has history. Without --every, some calls fail: of
the system's each name's first, middle and last, of the others `some` of a command. --only: of commands and names that have WORD in `COMMAND NAME`."""

import argparse
import collections
import concurrent.futures
import errno
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

DEVICE = os.environ.get("CLARUS_TEST_DEVICE", "auto")
LONGEST = 120  # seconds, after which a command hangs
ALLOCATIONS = 12  # of a command, spread over all that ask for memory, from which `some` are taken
MOST, FEW = 700, 32  # of a name with more calls, the first few, and as many spread over all
OUT_OF_RESOURCES, NOT_AVAILABLE = -5, -2

Fault = collections.namedtuple("Fault", "name number code says more", defaults=[""])
Outcome = collections.namedtuple("Outcome", "code errors files unfinished counts left")


def fault(name, number):
    """How the call of that name fails, and what the error is to say."""
    if name.startswith("cl"):
        return Fault(name, number, OUT_OF_RESOURCES, r"could not .+\(CL_OUT_OF_RESOURCES\)")
    if name.startswith("allocation:"):
        return Fault(name, number, errno.ENOMEM, r"\bmemory\b")
    if name == "thread":
        return Fault(name, number, errno.EAGAIN, r"\bthreads?\b")
    code = {"write": errno.ENOSPC, "fsync": errno.EIO, "rename": errno.EACCES}[name]
    return Fault(name, number, code, r"cannot write \S+: " + os.strerror(code))


def numbers(name, count, every):
    """Of the calls of a name, those that are to fail, one a run."""
    if name.startswith("allocation:"):
        return sorted({1, min(2, count), (count + 1) // 2, count}) if every else [1]
    if every and count <= MOST:
        return range(1, count + 1)
    if every:  # a loop's; how often it turns differs from run to run
        return sorted({*range(1, FEW + 1), *(count * part // FEW for part in range(1, FEW + 1))})
    return sorted({1, (count + 1) // 2, count})


class Command:
    """`arguments` of the tool, which writes what it writes into the folder that they are given."""

    name = ""
    some = 0  # how many faults are taken where not all are
    program_cache_is_cold = False

    def __init__(self, tests):
        self.tests = tests
        self.failures = 0  # runs that a fault has made fail

    def arguments(self, place):
        raise NotImplementedError

    def is_whole(self, name, content, expected):
        return content == expected.get(name)

    def is_whole_after_warning(self, name, content, expected):
        """Where the command goes on without something, as it says."""
        return self.is_whole(name, content, expected)

    def reasons(self, files):
        """Why something failed, as files that the command leaves say it."""
        return []

    def run(self, fault=None):
        with tempfile.TemporaryDirectory(dir=self.tests.folder) as folder:
            place = pathlib.Path(folder)
            counts = place / "counts"
            environment = dict(os.environ, OPENCL_LAYERS=self.tests.layer, CLARUS_FAULTS_COUNTS=str(counts),
                               LD_PRELOAD=self.tests.system, XDG_RUNTIME_DIR=str(place / "runtime"),
                               CLARUS_CACHE_DIR=str(place / "output" if self.program_cache_is_cold else self.tests.cache))
            (place / "runtime").mkdir(mode=0o700)
            (place / "output").mkdir(mode=0o700)
            if fault:
                environment["CLARUS_FAULTS"] = f"{fault.name} {fault.number} {fault.code} {fault.more}"
            code, errors = self.outcome(place, environment)
            files = {str(file.relative_to(place / "output")): file.read_bytes()
                     for file in (place / "output").rglob("*") if file.is_file()}
            unfinished = sorted(name for name in files if name.endswith(".partial"))
            unfinished += [str(file.name) for file in (place / "runtime").rglob("*") if not file.is_dir()]
            told = {}
            if counts.exists():
                for line in counts.read_text().splitlines():
                    name, count = line.split()
                    told[name] = int(count)
            left = {name: told.pop(name) for name in list(told) if name.startswith("left:")}
            return Outcome(code, errors, files, unfinished, told, left)

    def outcome(self, place, environment):
        with open(place / "errors", "w+") as errors:
            process = subprocess.Popen([self.tests.tool, *self.arguments(place / "output")], env=environment,
                                       stdout=subprocess.DEVNULL, stderr=errors)
            return self.code_of(process), pathlib.Path(errors.name).read_text(errors="replace")

    @staticmethod
    def code_of(process):
        try:
            return process.wait(LONGEST)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return None


class Upscale(Command):
    name = "upscale"
    some = 20

    def arguments(self, place):
        return ["upscale", self.tests.sequence, "--model", self.tests.model, "--device", DEVICE, "--output", place]

    def is_whole(self, name, content, expected):
        """A run that ends before its time leaves the state that --resume goes on from: a whole safetensors file."""
        if name != ".clarus-run.safetensors":
            return super().is_whole(name, content, expected)
        header = content[8:8 + int.from_bytes(content[:8], "little")]
        ends = [tensor["data_offsets"][1] for key, tensor in json.loads(header).items() if key != "__metadata__"]
        return len(content) == 8 + len(header) + max(ends)


class Prepare(Command):
    name = "prepare"
    some = 16
    program_cache_is_cold = True

    def arguments(self, _):
        return ["prepare", "nearest", "--device", DEVICE]

    def is_whole_after_warning(self, name, content, expected):
        """Of a device that is thought to have other abilities, other programs are kept."""
        magic, length = content[:8], int.from_bytes(content[24:32], sys.byteorder)  # host/cl/disk_cache.cpp
        return magic == b"CLARUSC2" and len(content) == 40 + length


class Bench(Command):
    name = "bench"
    some = 2

    def arguments(self, place):
        return ["bench", "--models", "nearest", "--sizes", "64x36", "--seconds", "0.001", "--without-start", "--devices",
                DEVICE, "--output", place / "bench.json"]

    def is_whole(self, name, content, expected):
        """Its figures are never the same. What was measured when it was interrupted is in a file of its own."""
        return name.removesuffix(".part") in expected and "items" in json.loads(content)

    def reasons(self, files):
        return [item["no_score"] for content in files.values() for item in json.loads(content)["items"] if item["no_score"]]


class Serve(Command):
    """With a renderer, which goes on in another process, and needs not to end where the upscaler has."""

    name = "serve"
    some = 8

    def arguments(self, place):
        return ["serve", "game", "--model", self.tests.model, "--device", DEVICE, "--output", place]

    def outcome(self, place, environment):
        without = {name: value for name, value in environment.items()
                   if name not in ("CLARUS_FAULTS", "CLARUS_FAULTS_COUNTS", "LD_PRELOAD", "OPENCL_LAYERS")}
        player = subprocess.Popen([self.tests.tool, "play", self.tests.sequence, "--share", "game"], env=without,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            return super().outcome(place, environment)
        finally:
            player.send_signal(signal.SIGINT)
            try:
                player.wait(LONGEST)
            except subprocess.TimeoutExpired:
                player.kill()
                player.wait()


def defects(outcome, command, fault, expected):
    """What is wrong, in words."""
    if outcome.code is None:
        yield f"hangs: no end in {LONGEST} s"
        return
    if outcome.code not in (0, 1):
        yield f"ends by {'signal ' + str(-outcome.code) if outcome.code < 0 else 'code ' + str(outcome.code)}"
        return
    errors, warnings = (re.findall(f"^clarus: {level}: .*", outcome.errors, re.M) for level in ("error", "warning"))
    warned = any(re.search(fault.says, warning) for warning in warnings)
    is_whole = command.is_whole_after_warning if warned else command.is_whole
    whole = {name: content for name, content in outcome.files.items() if name not in outcome.unfinished}
    for name, content in whole.items():
        if not is_whole(name, content, expected.files):
            yield f"{name} is not as it is without the fault"
    if outcome.unfinished:
        yield f"left behind: {', '.join(outcome.unfinished)}"
    if outcome.code == 0 and not warned and whole.keys() != expected.files.keys():
        yield f"says that all is well, and has not written {', '.join(expected.files.keys() - whole.keys())}"
    if outcome.code == 0 and errors:
        yield "says that all is well, and reports an error"
    if outcome.code == 1 and not any(re.search(fault.says, error) for error in errors + warnings + command.reasons(whole)):
        yield f"what it says does not have {fault.says}"
    if outcome.code == 1 and len(errors) != 1:
        yield f"{len(errors)} errors in place of one"
    for kind, count in outcome.left.items():
        if count > expected.left.get(kind, 0):
            yield f"{count} of {kind.removeprefix('left:')} not released"


class Tests:
    def __init__(self, options, folder):
        self.options = options
        self.tool, self.layer, self.system, self.model = (
            str(pathlib.Path(path).resolve()) for path in (options.tool, options.layer, options.system, options.model))
        self.folder = pathlib.Path(folder)
        self.callers = set()  # that have asked for memory and were refused
        self.cache = self.folder / "cache"
        self.sequence = self.folder / "sequence"
        os.environ["POCL_CACHE_DIR"] = str(self.folder / "pocl")  # warm in every run, and nobody else's
        subprocess.run([self.tool, "render", "--size", "16x12", "--frames", "3", "--no-reference", "-o", self.sequence],
                       check=True, stdout=subprocess.DEVNULL)

    def faults_of(self, command, expected):
        every = self.options.every
        allocations = sorted(name for name in expected.counts if name.startswith("allocation:"))
        names = [name for name in expected.counts if not name.startswith("allocation:")]
        systems = [name for name in names if not name.startswith("cl")]
        allocations = [name for name in allocations if name not in self.callers]
        spread = allocations[::1 if every else max(1, len(allocations) // ALLOCATIONS)]
        self.callers.update(spread)
        faults = [fault(name, number) for name in names + spread if name not in systems
                  for number in numbers(name, expected.counts[name], every)]
        faults += [Fault(name, number, NOT_AVAILABLE, r"CL_DEVICE_NOT_AVAILABLE", "on")
                   for name in ("clEnqueueNDRangeKernel", "clFinish", "clWaitForEvents") if name in names
                   for number in numbers(name, expected.counts[name], every)]
        faults = [each for each in faults if self.options.only in f"{command.name} {each.name}"]
        if not every and not self.options.only:
            faults = faults[:: max(1, -(-len(faults) // command.some))]
        return faults + [fault(name, number) for name in systems if self.options.only in f"{command.name} {name}"
                         for number in numbers(name, expected.counts[name], every)]

    def run(self):
        failed = total = 0
        commands = (Upscale(self), Prepare(self), Bench(self), Serve(self))
        named = [command for command in commands if self.options.only.startswith(command.name)]
        for command in named or commands:
            command.run()  # fills the caches
            expected = command.run()
            problems = list(defects(expected, command, Fault("none", 0, 0, ""), expected))
            assert expected.code == 0 and expected.files and not problems, (command.name, problems, expected.errors)
            chosen = self.faults_of(command, expected)
            start = time.monotonic()
            with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
                for each, outcome in zip(chosen, pool.map(command.run, chosen)):
                    found = list(defects(outcome, command, each, expected))
                    total += 1
                    command.failures += outcome.code == 1
                    failed += bool(found)
                    if found:
                        print(f"{command.name}, {each.name} {each.number} {each.code} {each.more}: {'; '.join(found)}")
                        print("".join(f"    {line}\n" for line in outcome.errors.splitlines()[-6:]), flush=True)
            if chosen and not self.options.only and command.failures == 0:
                failed += 1
                print(f"{command.name}: none of its faults made it fail: do they reach it?")
            print(f"{command.name}: {len(chosen)} faults in {time.monotonic() - start:.0f} s", flush=True)
        print(f"{total} faults, {failed} of them are not as they should be")
        return int(failed != 0 or total == 0)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--every", action="store_true")
    parser.add_argument("--only", default="")
    for word in ("tool", "layer", "system", "model"):
        parser.add_argument(word)
    with tempfile.TemporaryDirectory() as folder:
        return Tests(parser.parse_args(), folder).run()


if __name__ == "__main__":
    sys.exit(main())
