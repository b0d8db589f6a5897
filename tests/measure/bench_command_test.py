"""`clarus bench` as a program: TOOL, the schema and a model are given; the device is CLARUS_TEST_DEVICE."""

import copy
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import jsonschema

TOOL, SCHEMA, MODEL = sys.argv[1:4]
DEVICE = os.environ.get("CLARUS_TEST_DEVICE", "auto")
SMALL = ["--devices", DEVICE, "--sizes", "64x36", "--seconds", "0.001"]


def run(*arguments):
    return subprocess.run([TOOL, "bench", *arguments], capture_output=True, text=True)


class BenchCommand(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.checks = str(cls.folder / "checks.json")
        cls.result = cls.folder / "results" / "bench.json"
        models = [*SMALL, "--models", f"{MODEL},bicubic"]
        written = run(*models, "--write-checks", cls.checks)
        assert written.returncode == 0, written.stderr
        cls.outcome = run(*models, "--without-start", "--checks", cls.checks, "-o", str(cls.result))
        assert cls.outcome.returncode == 0, cls.outcome.stderr
        cls.json = json.loads(cls.result.read_text())
        cls.validator = jsonschema.Draft202012Validator(json.loads(pathlib.Path(SCHEMA).read_text()))

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_the_result_is_as_the_schema_says(self):
        jsonschema.Draft202012Validator.check_schema(self.validator.schema)
        self.validator.validate(self.json)
        self.assertEqual(len(self.json["items"]), 2)
        for item in self.json["items"]:
            self.assertEqual(item["check"]["result"], "passed")
            self.assertEqual(item["output_size"], [64, 36])
            self.assertIsNone(item["start"])
            stages = sum(stage["operations"] for stage in item["score"]["stages"])
            self.assertEqual(item["score"]["operations"], stages)
        self.assertIsNotNone(self.json["items"][0]["model"]["checksum"])
        self.assertIsNone(self.json["items"][1]["model"]["checksum"])

    def test_starts_and_sustained_load(self):
        result = self.folder / "sustained.json"
        outcome = run(*SMALL, "--models", "nearest", "--profile", "sustained", "--precision", "fp16", "-o", str(result))
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertIn("in the first fifth", outcome.stdout)
        written = json.loads(result.read_text())
        self.validator.validate(written)
        (item,) = written["items"]
        self.assertGreater(item["start"]["cold_seconds"], 0)
        self.assertGreater(item["start"]["warm_seconds"], 0)
        self.assertGreater(item["start"]["programs"], 0)
        self.assertGreater(item["start"]["other_size_seconds"], 0)
        self.assertEqual(item["start"]["other_size_programs"], 0)
        self.assertEqual(item["precision"], "fp16")

    def test_sharing_is_measured_beside_upscaling_in_process(self):
        sharing = ["share", "--models", "bicubic", "--device", DEVICE, "--size", "64x36", "--turns", "1"]
        outcome = run(*sharing, "--frames", "2")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertEqual(outcome.stdout.count("in-process"), 9)  # beside each of eight ways, and in the head
        for word in ("bicubic, 32x18 to 64x36", "copied, 3 slots", "in-place, 4 slots", "renders for 0.5", "4 games"):
            self.assertIn(word, outcome.stdout)
        missing = run(*sharing, "--models", "no-such-model")
        self.assertEqual(missing.returncode, 1)
        self.assertIn("no-such-model", missing.stderr)

    def test_the_schema_refuses_a_score_for_a_wrong_image(self):
        wrong = copy.deepcopy(self.json)
        wrong["items"][0]["check"]["result"] = "failed"
        self.assertFalse(self.validator.is_valid(wrong))
        del wrong["items"][0]["check"]
        self.assertFalse(self.validator.is_valid(wrong))

    def test_the_table_names_what_was_measured(self):
        for word in ("bicubic", "64x36", "fp32", "compute peak", "copy bandwidth", "ok", str(self.result)):
            self.assertIn(word, self.outcome.stdout)

    def test_a_wrong_image_has_no_score(self):
        checks = json.loads(pathlib.Path(self.checks).read_text())
        for check in checks["checks"]:
            if check["model"] == "bicubic":
                check["sketch"][9] += 0.1
        wrong = self.folder / "wrong.json"
        wrong.write_text(json.dumps(checks))
        result = self.folder / "wrong-result.json"
        outcome = run(*SMALL, "--models", "bicubic,bilinear", "--without-start", "--checks", str(wrong), "-o", str(result))
        self.assertEqual(outcome.returncode, 1)
        self.assertIn("1 of 2 have no score", outcome.stderr)
        self.assertIn("not the expected one", outcome.stdout)
        written = json.loads(result.read_text())
        self.validator.validate(written)
        self.assertIsNone(written["items"][0]["score"])
        self.assertEqual(written["items"][0]["check"]["result"], "failed")
        self.assertEqual(written["items"][1]["check"]["result"], "unchecked")
        self.assertIsNotNone(written["items"][1]["score"])

    def test_compare(self):
        slower = copy.deepcopy(self.json)
        slower["suite"]["commit"] = "another"
        for item in slower["items"]:
            for key in ("median", "low", "high"):
                item["score"]["latency"][key] *= 1000
        other = self.folder / "slower.json"
        other.write_text(json.dumps(slower))
        outcome = run("compare", str(self.result), str(other))
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertIn("slower", outcome.stdout)
        self.assertIn("another", outcome.stdout)
        outcome = run("compare", str(self.result), str(other), "--json")
        changes = json.loads(outcome.stdout)
        self.assertEqual([item["latency"]["verdict"] for item in changes["items"]], ["slower", "slower"])
        self.assertAlmostEqual(changes["items"][0]["latency"]["ratio"], 1000)
        self.assertEqual(changes["items"][0]["frames_per_second"]["verdict"], "within the noise")
        self.assertEqual(changes["facts"], [{"what": "commit", "a": self.json["suite"]["commit"] or "", "b": "another"}])

    def test_compare_whose_words_do_not_arrive_fails(self):
        with open("/dev/full", "w") as full:
            outcome = subprocess.run([TOOL, "bench", "compare", str(self.result), str(self.result)], stdout=full,
                                     stderr=subprocess.PIPE, text=True)
        self.assertEqual(outcome.returncode, 1)
        self.assertIn("cannot write to standard output", outcome.stderr)

    def test_what_nests_without_end_is_refused(self):
        deep = self.folder / "deep.json"
        deep.write_text('{"schema": ' + "[" * 200_000)
        outcome = run("compare", str(deep), str(self.result))
        self.assertEqual(outcome.returncode, 1, outcome.stderr)
        self.assertIn("deep.json", outcome.stderr)

    def test_placement_measures_ten_streams_on_one_device(self):
        outcome = run("placement", "--devices", DEVICE, "--model", "bicubic", "--size", "64x36", "--turns", "3",
                      "--streams", "10")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        *_, titles, row = outcome.stdout.splitlines()
        self.assertIn("10 streams      fair", titles)
        together, fair = map(float, row.split()[3:5])
        self.assertGreater(together, 0)
        # How fair turns are is tested by counts of frames (tests/api/several_devices_test.cpp): these are times.
        self.assertGreater(fair, 0)
        self.assertLessEqual(fair, 1)

    def test_errors(self):
        nowhere = str(self.folder / "checks.json" / "result.json")
        for arguments, code, message in (
            (["--profile", "slow"], 2, "quick|full|sustained"),
            (["--sizes", "big"], 2, "1080x1200"),
            (["--sizes", "0x5"], 2, "1080x1200"),
            (["--sizes", "99999x5", "--models", "bicubic"], 1, "every side must be"),
            (["--precision", "int8"], 2, "fp32|fp16"),
            (["--seconds", "-1"], 2, "--seconds"),
            (["--models", "none-such"], 1, "none-such"),
            (["--devices", "none-such"], 1, "none-such"),
            (["--checks", str(self.folder / "none.json")], 1, "none.json"),
            (["-o", str(self.folder)], 1, "is a folder"),
            (["-o", nowhere], 1, "cannot make the folder"),
            (["compare", str(self.result)], 2, "B is required"),
            (["compare", str(self.result), self.checks], 1, "clarus-bench"),
            (["compare", str(self.result), str(self.result), "--sizes", "720p"], 2, "--sizes"),
        ):
            with self.subTest(arguments=arguments):
                outcome = run(*arguments)
                self.assertEqual(outcome.returncode, code, outcome.stderr)
                self.assertIn(message, outcome.stderr)
        self.assertEqual(list(self.folder.glob("bench-*.json")), [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
