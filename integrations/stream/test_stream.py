"""The stream, from the game to the page: CLARUS_TOOL is the program, CLARUS_TEST_DEVICE the device. It needs the virtual
environment of `./run stream` and Debian's Chromium; figures.py needs neither."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import figures
import timeline

HERE = Path(__file__).resolve().parent
VENV = Path(os.environ.get("CLARUS_STREAM_VENV", HERE.parent.parent / "build/stream-venv"))
TOOL = os.environ.get("CLARUS_TOOL", HERE.parent.parent / "build/bin/clarus")


def pictures(shown, numbers=None):
    numbers = numbers or range(1, len(shown) + 1)
    return [{"number": number, "made": at - 20, "arrived": at - 5, "shown": at, "bytes": 1000}
            for number, at in zip(numbers, shown)]


class Figures(unittest.TestCase):
    def test_steady(self):
        measured = figures.of(pictures([100 * i / 3 for i in range(200)]))
        self.assertAlmostEqual(measured["a_second"], 30)
        self.assertEqual((measured["in_order"], measured["missing"]), (True, 0))
        self.assertAlmostEqual(measured["to_arrival"][0], 15)
        self.assertAlmostEqual(measured["to_picture"][1], 20)
        self.assertTrue(figures.goal(measured, 30))
        self.assertFalse(figures.goal(measured, 31))

    def test_stutter(self):
        shown, at = [], 0
        for i in range(400):
            at += 100 if i % 10 == 0 else 25
            shown.append(at)
        measured = figures.of(pictures(shown))
        self.assertAlmostEqual(measured["gaps_below_50_ms"], 0.9, places=2)
        self.assertEqual(measured["shown_gaps"][3], 100)
        self.assertFalse(figures.goal(measured, 30))

    def test_lost_and_out_of_order(self):
        shown = [33 * i for i in range(100)]
        lost = figures.of(pictures(shown, [*range(1, 80), *range(81, 102)]))
        self.assertEqual((lost["in_order"], lost["missing"]), (True, 1))
        turned = figures.of(pictures(shown, [*range(1, 80), 81, 80, *range(82, 101)]))
        self.assertEqual((turned["in_order"], turned["missing"]), (False, 0))
        self.assertFalse(figures.goal(lost, 10) or figures.goal(turned, 10))


class Timeline(unittest.TestCase):
    def test_clocks_are_brought_together(self):
        def trace(began, start):
            return {"otherData": {"began": began},
                    "traceEvents": [{"name": "x", "ph": "X", "pid": 1, "ts": start, "dur": 5, "args": {"frame": "0000"}}]}

        together = timeline.of({"game": trace(2_000_000, 10), "upscaler": trace(1_000_000, 20)},
                               [{"number": 1, "arrived": 2500, "shown": 2503}])
        spans = {(event["pid"], event["ts"], event["dur"]) for event in together["traceEvents"] if event["ph"] == "X"}
        self.assertEqual(spans, {(1, 1_000_010, 5), (2, 20, 5), (3, 1_500_000, 3000)})


    def test_steps_of_a_way(self):
        events = []
        for frame in range(3):
            starts = {"render": (0, 30), "copy into the slot": (30, 2), "submit": (33, 1), "wait for device": (34, 4),
                      "encode": (39, 5), "decode and show": (46, 3 + frame)}
            for name, (start, length) in starts.items():
                events.append({"name": name, "ph": "X", "pid": 1, "ts": 1000 * (100 * frame + start),
                               "dur": 1000 * length, "args": {"frame": f"{frame:04}"}})
        events.append({"name": "render", "ph": "X", "pid": 1, "ts": 0, "dur": 1, "args": {"frame": "0009"}})
        self.assertEqual(timeline.steps({"traceEvents": events}),
                         {"render, or read": 30, "copy into the slot": 2, "to the upscaler": 1, "upscale": 6,
                          "encode": 5, "to the page": 2, "decode and show": 4})
        self.assertEqual(timeline.steps({"traceEvents": []}), {})


class Stream(unittest.TestCase):
    def setUp(self):
        if not (VENV / "complete").exists():
            self.skipTest(f"no {VENV}, which ./run stream makes")
        if not shutil.which("chromium"):
            self.skipTest("no Chromium")

    def run_stream(self, *arguments):
        return subprocess.run([VENV / "bin/python", HERE / "stream.py", "--tool", TOOL, "--device",
                               os.environ.get("CLARUS_TEST_DEVICE") or "auto", *map(str, arguments)],
                              capture_output=True, text=True, timeout=180)

    def test_every_frame_arrives_in_order(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "log.json"
            trace = Path(folder) / "trace.json"
            result = self.run_stream("--model", "bicubic", "--size", "96x54", "--measure", 3, "--log", file,
                                     "--trace", trace)
            self.assertTrue(file.exists(), result.stderr)
            log = json.loads(file.read_text())
            spans = [event for event in json.loads(trace.read_text())["traceEvents"] if event["ph"] == "X"]
        self.assertEqual(log["failure"], "")
        measured = figures.of(log["pictures"])
        self.assertEqual((measured["in_order"], measured["missing"]), (True, 0), result.stdout)
        self.assertGreater(measured["pictures"], 10)  # of 90: how fast it is tells ./run stream --measure 60
        for picture in log["pictures"]:
            self.assertLess(picture["made"], picture["arrived"])
            self.assertLess(picture["arrived"], picture["shown"])
        for picture in log["pictures"][:20]:  # one frame's way
            frame = f"{picture['number'] - 1:04}"
            at = {span["name"]: span["ts"] for span in spans if span["args"]["frame"] == frame}
            way = ["render", "copy into the slot", "submit", "encode", "decode and show"]
            self.assertEqual([name for name in sorted(at, key=at.get) if name in way], way)

    def test_what_ends_is_named(self):
        result = self.run_stream("--model", "no-such-model", "--measure", 3)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("no-such-model", result.stderr)
        self.assertIn("stream: clarus serve has ended", result.stderr)

    def test_no_relay_is_named(self):
        environment = os.environ | {"PATH": f"{VENV / 'bin'}:{os.environ['PATH']}"}
        for url, words in (("https://127.0.0.1:1/live", "no relay"), ("http://x/live", "not of the form"),
                           ("https://127.0.0.1:1", "not of the form")):
            result = subprocess.run([TOOL, "serve", "nobody", "--model", "bicubic", "--output", f"moq:{url}"],
                                    capture_output=True, text=True, timeout=60, env=environment)
            self.assertEqual(result.returncode, 1)
            self.assertIn(f"cannot publish moq:{url}: ", result.stderr)
            self.assertIn(words, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2 if sys.stdout.isatty() else 1)
