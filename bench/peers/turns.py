"""Processes that wait until it is their turn."""

import contextlib
import json
import os
import select
import subprocess
import tempfile

PATIENCE = 600  # seconds until a process that does not answer is given up

# Waiting threads sleep: a peer that spins would slow down whoever is next.
NO_SPINNING = {"OMP_WAIT_POLICY": "passive", "KMP_BLOCKTIME": "0", "GOMP_SPINCOUNT": "0"}


class Process:
    """Answers each command with a line of JSON; its first line, `about`, comes unasked."""

    def __init__(self, command, threads):
        environment = {**os.environ, **NO_SPINNING, "OMP_NUM_THREADS": str(threads), "MKL_NUM_THREADS": str(threads)}
        self.said = tempfile.TemporaryFile()  # a pipe that nobody empties would block it
        self.process = subprocess.Popen(
            [str(part) for part in command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.said,
            env=environment,
        )
        self.about = self.answer()

    def answer(self):
        """The next line, or what went wrong as `error`."""
        ready, _, _ = select.select([self.process.stdout], [], [], PATIENCE)
        line = self.process.stdout.readline() if ready else b""
        if line:
            return json.loads(line)
        self.process.kill()
        self.said.seek(0)
        said = self.said.read().decode(errors="replace").strip().splitlines()
        reason = said[-1] if said else f"exit status {self.process.wait()}"
        return {"error": reason if ready else f"no answer within {PATIENCE} s"}

    def ask(self, command):
        try:
            self.process.stdin.write(f"{command}\n".encode())
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # `answer` says why it has ended
        return self.answer()

    def close(self):
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()
        self.said.close()


def take_turns(processes, seconds, clock, least_rounds=3, most_rounds=15):
    """Answers to "frame" by process name, from rounds of turns until `seconds` have passed. Empty after an error.

    A turn of a process with short frames is three of them, after one that does not count: it wakes threads and fills
    caches.
    """
    answers = {name: [] for name in processes}
    failed = {}
    start = clock()
    for done in range(most_rounds):
        if done >= least_rounds and clock() - start > seconds:
            break
        for name, process in processes.items():
            for answer in turn(process):
                if "error" in answer:
                    failed[name] = answer
                answers[name].append(answer)
        processes = {name: process for name, process in processes.items() if name not in failed}
    return answers, failed


LONG_FRAME = 0.5  # seconds


def turn(process):
    first = process.ask("frame")
    if "error" in first or first["seconds"] > LONG_FRAME:
        return [first]
    answers = []
    while len(answers) < 3 and not (answers and "error" in answers[-1]):
        answers.append(process.ask("frame"))
    return answers
