"""python3 -m unittest test_table"""

import unittest

import numpy as np

import table
from compare import agrees, difference
from turns import take_turns

RIGHT = {"typical": 1e-6, "largest": 1e-5}
WRONG = {"typical": 1e-3, "largest": 1e-2}


def timed(*milliseconds, difference=RIGHT):
    return {"seconds": [each / 1e3 for each in milliseconds], "difference": difference, "version": "Some 1.0"}


def result(part, clarus, **peers):
    return {"model": "m", "part": part, "numbers": "fp32", "clarus": clarus, "peers": peers}


class TableTest(unittest.TestCase):
    def test_scores_are_medians_with_half_of_what_lies_between_the_quartiles(self):
        median, spread = table.score(timed(10, 30, 20, 50, 40), "fp32")
        self.assertAlmostEqual(median, 0.030)
        self.assertAlmostEqual(spread, 0.010)
        self.assertEqual(table.score(timed(7), "fp32"), (0.007, 0.0))

    def test_the_fastest_peer_is_the_judge(self):
        judged = table.verdict(result("network", timed(10), a=timed(16), b=timed(15), c={"error": "no"}))
        self.assertEqual((judged["fastest"], judged["met"]), ("b", True))
        self.assertAlmostEqual(judged["ratio"], 1.5)
        self.assertFalse(table.verdict(result("frame", timed(10), a=timed(15)))["met"])
        self.assertTrue(table.verdict(result("frame", timed(10), a=timed(20)))["met"])

    def test_a_ratio_is_to_clarus_in_the_same_rounds(self):
        judged = table.verdict(result("network", timed(10), a=timed(30), b={**timed(20), "beside": [0.008, 0.009, 0.008]}))
        self.assertEqual(judged["fastest"], "b")
        self.assertAlmostEqual(judged["ratio"], 2.5)

    def test_whole_numbers_may_be_rounded_otherwise_and_have_a_bar_of_their_own(self):
        off = {"typical": 0.009, "largest": 0.05}
        result = {"model": "m", "part": "network", "numbers": "fp32", "clarus": {"seconds": [0.01], "difference": off},
                  "peers": {"OpenVINO": {"seconds": [0.014], "difference": off}}}  # fmt: skip
        self.assertFalse(table.verdict(result)["met"])
        result["numbers"] = "int8"
        judged = table.verdict(result)
        self.assertAlmostEqual(judged["ratio"], 1.4)
        self.assertTrue(judged["met"])
        self.assertEqual(table.rows([result])[1][2:], ["14.00 ± 0.00", "10.00 ± 0.00", "1.40 (OpenVINO)", "1.3× met"])

    def test_a_wrong_result_has_no_score(self):
        quick_but_wrong = result("network", timed(10), a=timed(1, difference=WRONG), b=timed(40))
        self.assertEqual(table.verdict(quick_but_wrong)["fastest"], "b")
        wrong_itself = result("network", timed(10, difference=WRONG), a=timed(40))
        self.assertEqual(table.verdict(wrong_itself), {"ratio": None, "fastest": None, "met": False})
        self.assertIn("wrong", table.rows([quick_but_wrong])[1])
        self.assertTrue(any("WRONG" in line for line in table.remarks([quick_but_wrong])))

    def test_what_could_not_run_is_said(self):
        results = [result("frame", timed(10), a={"error": "has no layer for Where"}, b=timed(30))]
        row = ["m", "frame", "–", "30.00 ± 0.00", "10.00 ± 0.00", "3.00 (b)", "2× met"]
        self.assertEqual(table.rows(results)[1], row)
        self.assertIn("has no layer for Where", table.text(results))
        self.assertIn("| m | frame | – |", table.markdown(results))
        nobody = table.verdict(result("frame", timed(10), a={"error": "no"}))
        self.assertEqual((nobody["ratio"], nobody["met"]), (None, False))

    def test_differences_are_shares_of_the_largest_value(self):
        expected = np.linspace(-4, 4, 10000, dtype=np.float32)
        actual = expected + 4e-5
        actual[7] += 0.4
        off = difference([(actual, expected)])
        self.assertAlmostEqual(off["typical"], 1e-5, delta=1e-6)
        self.assertAlmostEqual(off["largest"], 0.1, delta=1e-3)
        self.assertTrue(agrees(off))
        half = difference([(expected.astype(np.float16).astype(np.float32), expected)])
        self.assertFalse(agrees(half))
        self.assertTrue(agrees(half, "bf16"))

    def test_what_is_not_finite_or_of_another_shape_differs(self):
        expected = np.ones((2, 3), np.float32)
        for actual in (np.full((2, 3), np.nan, np.float32), np.ones((3, 2), np.float32)):
            self.assertFalse(agrees(difference([(actual, expected)])))


class Recorder:
    def __init__(self, name, log, seconds, fails_at=None):
        self.name, self.log, self.seconds, self.fails_at = name, log, seconds, fails_at

    def ask(self, command):
        self.log.append(self.name)
        if self.fails_at is not None and self.log.count(self.name) > self.fails_at:
            return {"error": "gone"}
        return {"seconds": self.seconds}


class TurnsTest(unittest.TestCase):
    def run_turns(self, rounds, **processes):
        log = []
        made = {name: Recorder(name, log, *arguments) for name, arguments in processes.items()}
        answers, failed = take_turns(made, 1e9, lambda: 0, rounds, rounds)
        return log, answers, failed

    def test_turns_go_round(self):
        log, answers, failed = self.run_turns(2, a=(0.01,), b=(1.0,))
        self.assertEqual("".join(log), "aaaabaaaab")  # a short frame's first run does not count
        self.assertEqual([len(given) for given in answers.values()], [6, 2])
        self.assertEqual(failed, {})

    def test_a_process_that_ends_loses_its_turns(self):
        log, _, failed = self.run_turns(3, a=(1.0, 1), b=(1.0,))
        self.assertEqual("".join(log), "ababb")
        self.assertEqual(failed, {"a": {"error": "gone"}})


if __name__ == "__main__":
    unittest.main()
