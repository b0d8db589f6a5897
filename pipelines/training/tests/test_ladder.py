"""The ladder of trainings: what is left, in which order, and what becomes of an end."""

import contextlib
import io
import json
import os
import sys
import tempfile
import unittest
import unittest.mock

from clarus_training import train

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
import ladder

# Stands for a training: writes its log as one that has run its hours, or fails.
PRETENDED = """
import sys
words = sys.argv[1:]
output = words[words.index("--output") + 1]
if "broken" in output:
    sys.exit(3)
with open(output + "/log.csv", "w") as log:
    log.write("seconds,iteration\\n" + str(3600 * float(words[words.index("--hours") + 1])) + ",5\\n")
"""


class Ladder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.list = os.path.join(self.folder.name, "ladder.json")

    def runs(self, *listed):
        with open(self.list, "w") as file:
            json.dump(listed, file)
        found = ladder.read(self.list, "data", os.path.join(self.folder.name, "runs"), 0.5)
        for run in found:
            run.words = [sys.executable, "-c", PRETENDED, *run.words[3:]]
        return found

    def train(self, runs, processes=2):
        with contextlib.redirect_stdout(io.StringIO()):
            return ladder.train(list(runs), {run.name: run for run in runs}, processes)

    def test_what_grows_from_another_comes_after_it(self):
        small, large = self.runs(
            {"name": "s", "arguments": "--size s", "hours": 2}, {"name": "m", "arguments": "", "hours": 1, "grow": "s"}
        )
        self.assertIn("--grow", large.words)
        self.assertEqual(small.hours, 1)
        self.assertEqual(self.train([small, large]), [])
        self.assertTrue(small.is_finished() and large.is_finished())

    def test_what_fails_is_named_and_what_waits_for_it_is_left_out(self):
        runs = self.runs(
            {"name": "broken", "arguments": "", "hours": 1},
            {"name": "m", "arguments": "", "hours": 1, "grow": "broken"},
            {"name": "other", "arguments": "", "hours": 1},
        )
        self.assertEqual(self.train(runs), ["broken"])
        self.assertEqual([run.is_finished() for run in runs], [False, False, True])

    def test_bad_lists_are_refused(self):
        good = {"name": "s", "arguments": "", "hours": 1}
        for bad in ([good, good], [{**good, "grow": "later"}], [{**good, "hour": 1}]):
            with self.assertRaisesRegex(SystemExit, "ladder.json"):
                self.runs(*bad)

    def test_the_shipped_list_is_of_networks_that_there_are(self):
        path = os.path.join(os.path.dirname(__file__), "..", "ladder.json")
        for run in ladder.read(path, "data", "runs", 1):
            with unittest.mock.patch("sys.argv", ["train", *run.words[3:]]):
                arguments = train.parse()
            self.assertIn(arguments.size, (None, "s", "m", "l", "full", "fast"))
            train.PIPELINES[arguments.pipeline].shape(arguments)


if __name__ == "__main__":
    unittest.main()
