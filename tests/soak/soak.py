#!/usr/bin/env python3
"""A long run of `clarus serve` under change: models and sizes switched, renderers killed and come back, garbage on its
sockets. Memory, descriptors and threads of the server must stay where they were.

usage: soak.py CLARUS SECONDS [--device SEL] [--models A,B] [-o FILE]

Every round goes through the same changes and ends where it began; there the server is looked at. Rounds of the first
fifth of the time, at least two, warm caches up. Over the others, the line through a figure must not rise by more than a
twentieth and its allowance; from ten minutes on, of the last third's latencies the median not by more
than half over the first's, and the 95th percentile not to more than twice.
Prints a table, a line for each tenth of the time; FILE gets all samples as JSON."""
import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MODELS = "enss-s-x2,bilinear,enss-s-x2-int8,mnss-x2,nsrr-x2"
SIZES = ["auto", "256x160", "300x200"]
RENDER_SIZES = ["128x80", "96x64"]
# What may be added to a twentieth: what the system's allocators keep, in KB, and a descriptor or thread in passing.
ALLOWANCES = {"memory": 16 << 10, "descriptors": 2, "threads": 2}
KEPT = 0.05
LONG_ENOUGH_FOR_LATENCY = 600  # seconds: a shared machine slows down for some
LATENCIES_KEPT = {0.5: 1.5, 0.95: 2}  # so many times the first third's, at the end; those above are for the table
CAMERAS = 8


class Failed(Exception):
    pass


def run(*command):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600)
    if result.returncode != 0:
        raise Failed(f"{' '.join(map(str, command))}: {result.returncode}\n{result.stdout}")
    return result.stdout


def look_at(process):
    """Resident memory in KB, open descriptors and threads of a process."""
    status = dict(line.split(":\t", 1) for line in Path(f"/proc/{process}/status").read_text().splitlines() if ":\t" in line)
    return {"memory": int(status["VmRSS"].split()[0]), "descriptors": len(os.listdir(f"/proc/{process}/fd")),
            "threads": int(status["Threads"])}


class Soak:
    def __init__(self, tool, folder, device, models):
        self.tool, self.folder, self.models = tool, folder, models
        self.sequences = []
        for size in RENDER_SIZES:
            sequence = folder / size
            run(tool, "render", "-o", sequence, "--size", size, "--frames", str(CAMERAS), "--no-reference")
            self.sequences.append(sequence)
        self.log = open(folder / "serve.log", "w+")
        self.server = subprocess.Popen([tool, "serve", "soak", "--model", self.models[0], "--keep", "--device", device],
                                       stdout=self.log, stderr=self.log)
        self.player = None
        self.latencies, self.complaints = [], []
        self.socket = folder / "clarus" / "soak.control"
        end = time.monotonic() + 60
        while not self.socket.exists() and self.server.poll() is None:
            if time.monotonic() > end:
                self.server.kill()
                raise Failed("the server does not listen within a minute")
            time.sleep(0.02)

    def close(self):
        for process in (self.player, self.server):
            if process and process.poll() is None:
                process.send_signal(signal.SIGINT)
                try:
                    process.wait(60)
                except subprocess.TimeoutExpired:
                    process.kill()
                    self.complaints.append("a process does not end at SIGINT")
        self.log.close()

    def state(self):
        if self.server.poll() is not None:
            self.log.seek(0)
            raise Failed(f"the server ended, {self.server.returncode}:\n{self.log.read()}")
        return json.loads(run(self.tool, "control", "soak", "--json"))

    def wait(self, condition, what):
        end = time.monotonic() + 120
        while time.monotonic() < end:
            state = self.state()
            if "milliseconds" in state and state["milliseconds"]:
                self.latencies.append(state["milliseconds"])
            if condition(state):
                return state
            time.sleep(0.1)
        raise Failed(f"{what}: not within two minutes; {state}")

    def frames_go_on(self, count=5):
        before = self.state()["frames"]
        return self.wait(lambda state: state["frames"] >= before + count, "frames go on")

    def play(self, sequence):
        """In place of the renderer that there was, which is killed."""
        if self.player:
            self.player.kill()
            self.player.wait()
        connections = self.state()["connections"] if self.player else 0
        self.player = subprocess.Popen([self.tool, "play", sequence, "--share", "soak", "--loop", "--frame-rate", "60"],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.wait(lambda state: state["connections"] > connections and state["connected"], "a renderer comes back")

    def disturb(self):
        """Clients that say nothing, nonsense, too much, or go in the middle."""
        for words in (b"", b"{", b"[" * 50000, b'{"model": 3}', b"\xff" * 60000):
            client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            client.connect(str(self.socket))
            if words:
                client.send(words)
            client.close()
        client = subprocess.Popen([self.tool, "control", "soak", "model=" + self.models[0]], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        time.sleep(0.02)
        client.kill()
        client.wait()

    def round(self):
        for sequence in self.sequences[1:] + self.sequences[:1]:
            self.play(sequence)
            self.frames_go_on()
            for model in self.models[1:] + self.models[:1]:
                run(self.tool, "control", "soak", "model=" + model)
                self.frames_go_on()
            for size in SIZES[1:] + SIZES[:1]:
                run(self.tool, "control", "soak", "output-size=" + size)
                self.frames_go_on()
            self.disturb()
        run(self.tool, "control", "soak", "model=" + self.models[0], "output-size=auto")
        state = self.frames_go_on(10)
        if state["model"] != self.models[0]:
            raise Failed(f"a round ends with {state['model']}")
        sample = {**look_at(state["process"]), "frames": state["frames"], "latencies": self.latencies}
        self.latencies = []
        return sample


def growth(times, values):
    """Of the line through them, from the first time to the last."""
    mean_time, mean = sum(times) / len(times), sum(values) / len(values)
    spread = sum((t - mean_time) ** 2 for t in times)
    slope = sum((t - mean_time) * (v - mean) for t, v in zip(times, values)) / spread
    return slope * (times[-1] - times[0])


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else float("nan")


def latencies_of(samples):
    return [value for sample in samples for value in sample["latencies"]]


def judge(samples, seconds):
    """What grew, in words."""
    warm = max(2, next((i for i, sample in enumerate(samples) if sample["time"] >= seconds / 5), len(samples)))
    rest = samples[warm:]
    if len(rest) < 3:
        raise Failed(f"{len(samples)} rounds are too few to judge; more seconds are needed")
    complaints = []
    for key, allowance in ALLOWANCES.items():
        values = [sample[key] for sample in rest]
        grown = growth([sample["time"] for sample in rest], values)
        if grown > KEPT * values[0] + allowance:
            complaints.append(f"{key} grew by {grown:.0f} from {values[0]}")
    if seconds >= LONG_ENOUGH_FOR_LATENCY:
        third = len(rest) // 3
        for share, kept in LATENCIES_KEPT.items():
            first, last = (percentile(latencies_of(part), share) for part in (rest[:third], rest[-third:]))
            if last > kept * first:
                complaints.append(f"of latencies, {100 * share:g} % were below {first:.1f} ms, and then {last:.1f} ms")
    return complaints


def print_table(samples):
    print("  minute  rounds   frames  memory MB  descriptors  threads  p50 ms  p95 ms  p99 ms")
    lines = min(10, len(samples))
    for line in range(lines):
        part = samples[line * len(samples) // lines:(line + 1) * len(samples) // lines]
        last, latencies = part[-1], latencies_of(part)
        print(f"{last['time'] / 60:8.1f} {len(part):7} {last['frames']:8} {last['memory'] / 1024:10.1f} {last['descriptors']:12} "
              f"{last['threads']:8} {percentile(latencies, .5):7.1f} {percentile(latencies, .95):7.1f} "
              f"{percentile(latencies, .99):7.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0], formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("clarus")
    parser.add_argument("seconds", type=float)
    parser.add_argument("--device", default=os.environ.get("CLARUS_TEST_DEVICE") or "auto")
    parser.add_argument("--models", default=MODELS, help="switched between; every round ends with the first")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("soak: ended by SIGTERM"))
    samples = []
    with tempfile.TemporaryDirectory(prefix="clarus-soak-") as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        try:
            soak = Soak(os.path.abspath(options.clarus), Path(folder), options.device, options.models.split(","))
            try:
                began = told = time.monotonic()
                while time.monotonic() < began + options.seconds or len(samples) < 5:
                    sample = soak.round()
                    samples.append({"time": time.monotonic() - began, **sample})
                    if sys.stderr.isatty() and time.monotonic() > told + 2:
                        told = time.monotonic()
                        left = max(0, options.seconds - samples[-1]["time"])
                        print(f"\r{len(samples)} rounds, {left / 60:.1f} minutes left ", end="", file=sys.stderr)
            finally:
                soak.close()
            complaints = soak.complaints + judge(samples, options.seconds)
        except Failed as failure:
            complaints = [str(failure)]
    if sys.stderr.isatty():
        print(file=sys.stderr)
    if samples:
        print_table(samples)
    if options.output:
        options.output.write_text(json.dumps(samples))
    for complaint in complaints:
        print("soak:", complaint, file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
