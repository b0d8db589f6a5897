"""What judge.py runs: python3 -m unittest discover tests."""

import contextlib
import glob
import io
import os
import sys
import unittest
from unittest import mock

import judge


def commands(*words, code=0):
    """What is run for these arguments, each as a list of words."""
    result = mock.Mock(returncode=code)
    with mock.patch.object(sys, "argv", ["judge.py", *words]), mock.patch("subprocess.run", return_value=result) as run:
        with mock.patch("os.makedirs"):
            judge.main()
    return [call.args[0][1:] for call in run.call_args_list]


class Judge(unittest.TestCase):
    def test_whatever_works_in_time_is_judged(self):
        weights = glob.glob(os.path.join(judge.HERE, "..", "*", "weights", "*.safetensors"))
        shipped = {os.path.basename(path).removesuffix(".safetensors") for path in weights}
        wanted = {name for name in shipped if not name.startswith(("srpo", "espcn")) and not name.endswith("-int8")}
        self.assertEqual({name for names in judge.SHIPPED.values() for name in names} - {"fsr2"}, wanted)
        for kind, names in judge.SHIPPED.items():
            for name in set(names) - set(judge.ANY):
                self.assertTrue(name.endswith(kind.split("-")[-1]), name)

    def test_scenes_are_rendered_and_models_evaluated(self):
        rendered, judged = commands("clarus", "data", "out", "--sequences", "mnss-x3", "--device", "cpu/1")
        self.assertEqual(rendered[1:4], ["clarus", judge.HELD_OUT, os.path.join("data", "held_out-mnss-x3")])
        self.assertEqual(rendered[4:], ["--scale", "3", "--size", "256x144", "--jitter", "mnss"])
        self.assertEqual(judged[:2], ["-m", "clarus_training.evaluate"])
        self.assertEqual(judged[5:], ["mnss-x3", "--device", "cpu/1", "--results", os.path.join("out", "quality-mnss-x3.json")])

    def test_models_choose_their_sequences(self):
        run = commands("clarus", "data", "out", "--models", "enss-s-x3", "bicubic", "nsrr-x4")
        self.assertEqual([words[5:-4] for words in run[1::2]], [["bicubic"], ["enss-s-x3"], ["nsrr-x4"]])
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()) as said:
            commands("clarus", "data", "out", "--models", "srpo-x2")
        self.assertIn("srpo-x2: none of ", said.getvalue())

    def test_a_failure_ends_it(self):
        with self.assertRaisesRegex(SystemExit, "failed: .*make_data.py clarus"):
            commands("clarus", "data", "out", code=1)


if __name__ == "__main__":
    unittest.main()
