"""The README's commands, from nothing to a model's figures, on a tiny scene: needs CLARUS_TOOL, the program's path."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
TOOL = os.environ.get("CLARUS_TOOL")


def run(*words):
    command = [sys.executable, *map(str, words)]
    result = subprocess.run(command, cwd=HERE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    if result.returncode:
        raise AssertionError(f"{words}: {result.stderr.decode()}")
    return result.stdout.decode()


@unittest.skipUnless(TOOL, "CLARUS_TOOL does not name the program")
class Recipe(unittest.TestCase):
    def test_from_nothing_to_figures(self):
        with tempfile.TemporaryDirectory() as work:
            at = lambda *names: os.path.join(work, *names)
            segments = [{"frames": [0, 2], "kind": "moving"}]
            with open(at("list.json"), "w") as file:
                json.dump([{"name": "one", "scene": "demo", "frames": 3, "size": "48x32", "segments": segments}], file)
            run("make_data.py", TOOL, at("list.json"), at("data"), "--output-buffers")
            self.assertIn("left alone", run("make_data.py", TOOL, at("list.json"), at("data")))
            train = ["-m", "clarus_training.train", "--scale", 2, "--data", at("data"), "--clip", 2, "--crop", 16]
            train += ["--batch", 2, "--threads", 1, "--steps", 2, "--amp"]
            run(*train, "--size", "s", "--output", at("s"))
            run(*train, "--size", "m", "--grow", at("s", "checkpoint.pt"), "--output", at("m"))
            steadier = ["--start", at("m", "checkpoint.pt"), "--loss", "l1-steadier"]
            run(*train, "--size", "m", *steadier, "--output", at("m2"))
            mix = ["--mix", at("m2", "checkpoint.pt"), 0.25]
            run("-m", "clarus_training.export", at("m", "checkpoint.pt"), at("m.safetensors"), "--jitters", 16, *mix)
            evaluate = ["-m", "clarus_training.evaluate", TOOL, at("list.json"), at("data"), at("m.safetensors")]
            tables = run(*evaluate, "--json", at("figures.json"), "--results", at("results.json"), "--markdown")
            self.assertIn("worse blocks in moving frames (%): ", tables)
            with open(at("figures.json")) as file:
                (figures,) = json.load(file).values()
            # Training starts near the upsampled colour, and two steps do not lead far away.
            self.assertGreater(figures["mean"]["psnr"], figures["mean"]["bicubic_psnr"] - 3)
            self.assertIsNotNone(figures["mean"]["moving_gain"])
            self.assertIsNotNone(figures["scenes"][0]["in_disoccluded_4_gain"])
            with open(at("results.json")) as file:
                results = json.load(file)
            self.assertEqual((results["format"], results["scenes"]), ("clarus-quality", ["one"]))
            (kept,) = results["models"].values()
            self.assertEqual(sorted(kept), ["date", "mean", "program", "scenes"])
            self.assertEqual(kept["mean"]["psnr"], round(figures["mean"]["psnr"], 5))
            psnr = run("-m", "clarus_training.validation", at("m.safetensors"), at("data", "one"))
            self.assertIn(f"{figures['mean']['psnr']:.1f}"[:3], psnr)

    def test_srpo_beside_other_upscalers(self):
        with tempfile.TemporaryDirectory() as work:
            at = lambda *names: os.path.join(work, *names)
            with open(at("list.json"), "w") as file:
                json.dump([{"name": "one", "scene": "demo", "frames": 3, "size": "48x32", "segments": []}], file)
            make = ["make_data.py", TOOL, at("list.json")]
            run(*make, at("data"), "--jitter", "none", "--reference-samples", 1)
            compare = ["-m", "clarus_training.rasterized", TOOL, at("data"), "--every", 2]
            table = run(*compare, "--srpo", "srpo-x2", "--others", "bilinear", "--keep", at("kept")).splitlines()
            names = ["upscaler", "nearest", "bicubic", "lanczos", "fsr1", "bilinear", "srpo-x2"]
            self.assertEqual([line.split()[0] for line in table], names)
            for line in table[1:]:
                self.assertTrue(10 < float(line.split()[1]) < 40, line)
            for folder in ("antialiased", "outputs/srpo-x2", "outputs/fsr1"):
                self.assertEqual(sorted(os.listdir(at("kept", "data", "one", folder))), ["0000.png", "0002.png"])
            with self.assertRaisesRegex(AssertionError, "is there already"):
                run(*compare, "--srpo", "srpo-x2", "--keep", at("kept"))
            with self.assertRaisesRegex(AssertionError, "one name"):
                run(*compare, "--srpo", "srpo-x2", at("srpo-x2.safetensors"))
            run(*make, at("jittered"))
            with self.assertRaisesRegex(AssertionError, "is jittered"):
                run("-m", "clarus_training.rasterized", TOOL, at("jittered"), "--srpo", "srpo-x2")


if __name__ == "__main__":
    unittest.main()
