"""The page of `clarus report` in a headless Chromium. TOOL and a model that has views are given; the device is
CLARUS_TEST_DEVICE. Ends with 77 where there is no Chromium."""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

from selenium import webdriver
from selenium.common.exceptions import JavascriptException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions import interaction
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.pointer_input import PointerInput
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.select import Select
from selenium.webdriver.support.ui import WebDriverWait

if not shutil.which("chromium") or not shutil.which("chromedriver"):
    sys.exit(77)

TOOL, MODEL = sys.argv[1:3]
DEVICE = os.environ.get("CLARUS_TEST_DEVICE") or "auto"
AWKWARD = "<!--<script>\"&'é"  # a folder's name


def model_name(model):
    return "bicubic" if model == "bicubic" else "network"


# The page's background, and [contrast, text] of what shows text of its own.
CONTRASTS = """
const luminance = (rgb) => {
  const [r, g, b] = rgb.map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const channels = (color) => color.match(/[0-9.]+/g).map(Number);
const background = (element) => {
  for (; element; element = element.parentElement) {
    const color = channels(getComputedStyle(element).backgroundColor);
    if (color.length === 3 || color[3] > 0.99) return color.slice(0, 3);
  }
  return [255, 255, 255];
};
const found = [];
for (const element of document.querySelectorAll("body *")) {
  const text = [...element.childNodes].filter((n) => n.nodeType === Node.TEXT_NODE).map((n) => n.data.trim()).join("");
  if (!text || !element.checkVisibility() || element.closest("script, style, canvas, select:disabled")) continue;
  const style = getComputedStyle(element);
  const front = channels(element instanceof SVGElement ? style.fill : style.color).slice(0, 3);
  const pair = [luminance(front), luminance(background(element))].sort((a, b) => b - a);
  found.push([(pair[0] + 0.05) / (pair[1] + 0.05), text]);
}
return [background(document.body), found];
"""


# What a bench file says beyond what the page shows or `clarus bench compare` reckons with.
UNREAD = (
    *("top.seconds", "host.memory", "suite.tuning", "suite.confidence", "suite.steady_within"),
    *("profile.vendor", "profile.platform", "model.pipeline", "model.scale", "model.checksum", "model.parameters"),
    *("memory.arena", "memory.weights", "check.largest_difference", "check.tolerance", "start.programs"),
    "start.other_size_programs",
    *("latency.frames", "score.turns", ".relative_interval"),
)


def members(value, place="top"):
    """Every object's members, in all depths: (object, its place, key)."""
    if isinstance(value, list):
        for index, each in enumerate(value):
            yield from members(each, f"{place}[{index}]")
    elif isinstance(value, dict):
        for key, each in list(value.items()):
            yield value, place, key
            yield from members(each, key if place == "top" else f"{place}.{key}")


def run(*arguments, fails=False):
    outcome = subprocess.run([TOOL, *map(str, arguments)], capture_output=True, text=True)
    assert (outcome.returncode != 0) == fails, outcome.stderr
    return outcome.stderr if fails else outcome.stdout


def figure(median, spread=0.04):
    return {
        "median": median,
        "low": median * (1 - spread),
        "high": median * (1 + spread),
        "turns": 7,
        "relative_interval": spread,
        "steady": True,
    }


def bench(device_name, seconds):
    """What `clarus bench` would write of one device: a model with two stages, one whose output was wrong, and one
    without arithmetic."""

    def item(name, stages, precision="fp32"):
        total = sum(stage["seconds"]["median"] for stage in stages)
        latency = {**figure(total * 1.1), "p95": total * 1.2, "p99": total * 1.3, "frames": 50}
        score = {
            "latency": latency,
            "frames_per_second": figure(1 / total),
            "device_seconds": figure(total),
            "operations": 3e9,
            "bytes": 2e8,
            "roofline_seconds": total / 2,
            "roofline_share": 0.5,
            "stages": stages,
            "turns": [{"at": 1.5, "latency": total, "clock_mhz": None}],
        }
        return {
            "device": "0:0",
            "render_size": [960, 540],
            "output_size": [1920, 1080],
            "precision": precision,
            "model": {"name": name, "pipeline": name, "scale": 2, "checksum": None, "parameters": 0},
            "memory": {"arena": 1 << 20, "weights": 0, "total": 3 << 20},
            "check": {"result": "passed", "largest_difference": 0.0, "tolerance": 0.01, "reason": None},
            "start": {
                "cold_seconds": 2.5,
                "warm_seconds": 0.25,
                "programs": 3,
                "other_size_seconds": 0.125,
                "other_size_programs": 0,
            },
            "score": score,
            "no_score": None,
        }

    stages = [
        {
            "name": f"</script><i>{name}",
            "kernel": "plain 8x8",
            "seconds": figure(seconds * share),
            "operations": operations,
            "bytes": 1e8,
            "compute_share": 0.5,
            "bandwidth_share": 0.25,
        }
        for name, share, operations in (("convolution 1", 0.75, 3e9), ("reorder", 0.25, 0.0))
    ]
    wrong = item("bilinear", stages)
    wrong.update(
        score=None,
        no_score="differs by 0.3",
        check={**wrong["check"], "result": "failed", "reason": "differs by 0.3"},
        memory=None,
        start=None,
    )
    profile = {
        "selector": "0:0",
        "name": device_name,
        "vendor": "v",
        "platform": "p",
        "driver_version": "1.2",
        "opencl_version": "3.0",
        "class": "gpu",
        "compute_units": 4,
        "clock_mhz": 1500,
        "global_memory": 1 << 32,
        "half_storage": True,
        "half_arithmetic": False,
    }
    return {
        "format": "clarus-bench",
        "version": 1,
        "date": "2026-01-02T03:04:05Z",
        "seconds": 60.0,
        "suite": {
            "version": "0.1.0",
            "commit": None,
            "profile": "quick",
            "tuning": "stored",
            "confidence": 0.95,
            "steady_within": 0.03,
        },
        "host": {
            "cpu": None,
            "cores": 2,
            "memory": None,
            "os": None,
            "kernel": "Linux",
            "governor": None,
            "clock_mhz": [None, None],
            "load_average": None,
        },
        "devices": [
            {
                "profile": profile,
                "platform_version": "OpenCL 3.0",
                "opencl_c_version": "OpenCL C 1.2",
                "compute_peak": figure(1e12),
                "copy_bandwidth": figure(5e10),
            }
        ],
        "items": [item("bicubic", stages), wrong, item("nearest", stages[1:], "fp16")],
    }


class ReportPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.sequence = cls.folder / "sequence"
        run(
            "render",
            "--scene",
            "demo",
            "--size",
            "64x36",
            "--scale",
            "2",
            "--frames",
            "5",
            "--reference-samples",
            "1",
            "--output-buffers",
            "-o",
            cls.sequence,
        )
        cls.results = {}
        for name, model, options in (("bicubic", "bicubic", []), (AWKWARD, MODEL, ["--view", "alpha"])):
            folder = cls.results[name] = cls.folder / name
            run(
                "upscale",
                cls.sequence,
                "--model",
                model,
                "--device",
                DEVICE,
                "--output",
                folder,
                "--profile",
                "--report",
                folder / "report.json",
                "--trace",
                cls.folder / f"{model_name(model)}.trace.json",
                *options,
            )
        cls.names = list(cls.results)
        cls.quality = json.loads(run("compare", *cls.results.values(), cls.sequence, "--json"))
        for name, seconds in (("this", 0.02), ("that", 0.005)):
            (cls.folder / f"{name}.json").write_text(json.dumps(bench(f"device of {name}", seconds)))
        cls.page = cls.folder / "report.html"
        run(
            "report",
            cls.folder / "this.json",
            *cls.results.values(),
            cls.folder / "that.json",
            "--sequence",
            cls.sequence,
            "--pictures",
            "3",
            "--trace",
            f"{cls.folder}/bicubic.trace.json,{cls.folder}/network.trace.json",
            "-o",
            cls.page,
        )

        options = webdriver.ChromeOptions()
        for argument in ("headless=new", "no-sandbox", "disable-dev-shm-usage", "disable-gpu", "window-size=1200,900"):
            options.add_argument(f"--{argument}")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        options.binary_location = shutil.which("chromium")
        cls.browser = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()
        cls.temporary.cleanup()

    def setUp(self):
        self.open(self.page)

    def tearDown(self):
        self.assertEqual([entry for entry in self.browser.get_log("browser") if entry["level"] == "SEVERE"], [])

    def open(self, page):
        self.browser.get(page.as_uri())
        self.wait(lambda: self.script("return document.readyState") == "complete")
        self.wait(
            lambda: not self.shown("pictures")
            or self.script(
                "const c = document.getElementById('canvas');"
                "return c.width > 0 && c.getContext('2d').getImageData(c.width / 4, c.height / 2, 1, 1).data[3] === 255"
            )
        )

    def wait(self, condition):
        WebDriverWait(self.browser, 60).until(lambda _: condition())

    def script(self, text, *arguments):
        return self.browser.execute_script(text, *arguments)

    def at(self, identifier):
        return self.browser.find_element(By.ID, identifier)

    def shown(self, identifier):
        return self.at(identifier).is_displayed()

    def text(self, selector):
        return [element.text for element in self.browser.find_elements(By.CSS_SELECTOR, selector)]

    def choose(self, identifier, text):
        Select(self.at(identifier)).select_by_visible_text(text)

    def color(self, x, y=0.5):
        """Of the canvas, at shares of its width and height."""
        return self.script(
            "const c = document.getElementById('canvas');"
            "return Array.from(c.getContext('2d').getImageData(arguments[0] * c.width, arguments[1] * c.height, 1, 1).data)",
            x,
            y,
        )

    def picture(self):
        return self.script("return document.getElementById('canvas').toDataURL()")

    def press(self, keys, identifier="split"):
        self.at(identifier).send_keys(keys)

    def test_every_section_is_there_and_the_network_is_not_asked(self):
        for section in ("pictures", "worst", "over-time", "what-to-pick", "stages", "timeline", "roofline", "devices"):
            self.assertTrue(self.shown(section), section)
        self.assertEqual(len(self.text("nav a")), 8)
        self.assertEqual(
            self.script(
                "return performance.getEntriesByType('resource').filter(e => !e.name.startsWith('data:')).length"
            ),
            0,
        )
        self.assertEqual(self.browser.title, "sequence – Clarus")
        self.assertEqual(
            self.text("#subtitle"),
            [f"Clarus · 5 frames · 64×36 to 128×72 · {self.device_name()} · device of this · device of that"],
        )

    def device_name(self):
        return json.loads((self.results["bicubic"] / "report.json").read_text())["devices"][0]["name"]

    def test_traces_of_one_run_share_a_timeline(self):
        self.choose("timeline-of", "bicubic.trace, network.trace")
        lanes = self.text("#timeline-chart text")
        for file in ("bicubic", "network"):
            for track in ("main", "writer 1"):
                self.assertIn(f"{file}.trace: {track}", lanes)
        spans = [
            event
            for name in ("bicubic", "network")
            for event in json.loads((self.folder / f"{name}.trace.json").read_text())["traceEvents"]
            if event["ph"] == "X"
        ]
        self.assertEqual({span["args"]["frame"] for span in spans}, {f"{frame:04}" for frame in range(5)})
        self.assertEqual(len(self.text("#timeline-chart rect")), len(spans))
        self.assertIn("frame 0000", self.text("#timeline-readout")[0])

    def test_names_are_text(self):
        self.assertEqual(
            self.script("return document.querySelectorAll('body script:not([type]), .stage i:not([style])').length"), 1
        )
        options = [option.text for option in Select(self.at("left")).options]
        self.assertEqual(options, ["input", *self.names, f"{self.names[1]}: alpha", "reference"])

    def test_the_slider_moves(self):
        self.choose("left", "input")
        self.choose("right", "reference")
        self.wait(lambda: len({tuple(self.color(x)) for x in (0.1, 0.4, 0.6, 0.9)}) > 1)
        before = self.picture()
        self.assertEqual(self.at("split").get_attribute("aria-valuenow"), "50")
        self.press(Keys.ARROW_RIGHT * 5)
        self.assertEqual(self.at("split").get_attribute("aria-valuenow"), "60")
        self.assertNotEqual(self.picture(), before)
        self.press(Keys.ARROW_LEFT * 5)
        self.assertEqual(self.picture(), before)
        width = self.at("stage").size["width"]
        ActionChains(self.browser).drag_and_drop_by_offset(self.at("split"), -width // 4, 0).perform()
        self.assertAlmostEqual(int(self.at("split").get_attribute("aria-valuenow")), 25, delta=1)
        self.press(Keys.HOME)
        right_only = self.picture()
        self.press("x" + Keys.END)
        self.assertEqual(self.picture(), right_only)

    def test_frames_and_zoom(self):
        self.assertEqual(self.text("#frame-name"), ["0002"])
        first = self.picture()
        self.press("[")
        self.assertEqual(self.text("#frame-name"), ["0000"])
        self.wait(lambda: self.picture() != first)
        self.press("[]]]")
        self.assertEqual(self.text("#frame-name"), ["0004"])
        self.press("[")
        self.assertEqual(self.text("#frame-name"), ["0002"])
        self.wait(lambda: self.picture() == first)
        self.press("++")
        self.assertEqual(self.text("#zoom-fit"), ["×4"])
        zoomed = self.picture()
        self.assertNotEqual(zoomed, first)
        stage = self.at("stage")
        ActionChains(self.browser).move_to_element_with_offset(stage, 200, 60).click_and_hold().move_by_offset(
            80, 40
        ).release().perform()
        self.assertNotEqual(self.picture(), zoomed)
        self.press("0")
        self.assertEqual(self.picture(), first)

    def test_the_difference(self):
        self.choose("left", "reference")
        self.choose("right", "reference")
        self.press("d")
        self.wait(lambda: self.shown("heat-legend"))
        self.wait(lambda: all(self.color(x)[:3] == [0, 0, 4] for x in (0.1, 0.5, 0.9)))
        self.choose("right", "input")
        self.wait(lambda: any(self.color(x)[:3] != [0, 0, 4] for x in (0.1, 0.3, 0.5, 0.7, 0.9)))
        self.at("show-slider").click()
        self.assertFalse(self.shown("heat-legend"))

    def test_a_mask_lies_over_the_pictures(self):
        """Where the mask's own picture is white, and nowhere else."""
        self.choose("left", "reference")
        self.choose("right", "reference")
        options = [option.text for option in Select(self.at("mask")).options]
        self.assertEqual(options[0], "none")
        self.assertIn("disoccluded 4", options)
        bare = self.picture()
        points = [((x + 0.5) / 128, (y + 0.5) / 72) for x in range(2, 128, 9) for y in range(2, 72, 7)]
        before = [self.color(*point)[:3] for point in points]
        for name in options[1:]:
            self.choose("mask", name)
            inside = self.browser.execute_async_script(
                """
                const [name, points, done] = arguments, picture = new Image();
                picture.onload = () => {
                  const context = new OffscreenCanvas(128, 72).getContext('2d');
                  context.drawImage(picture, 0, 0);
                  done(points.map(([x, y]) => context.getImageData(x * 128, y * 72, 1, 1).data[0] === 255));
                };
                picture.src = report.masks.find((mask) => mask.name === name).images[1];
                """,
                name.replace(" ", "_"),
                points,
            )
            tinted = [[(a + b) / 2 for a, b in zip(color, (255, 0, 160))] for color in before]
            expected = [tint if white else color for tint, color, white in zip(tinted, before, inside)]

            def as_expected():
                shown = [self.color(*point)[:3] for point in points]
                return all(abs(a - b) <= 3 for one, other in zip(shown, expected) for a, b in zip(one, other))

            self.wait(as_expected)
        self.choose("mask", "none")
        self.assertEqual(self.picture(), bare)

    def test_what_is_worst_comes_first_and_is_shown(self):
        quality = self.quality[0]
        self.choose("worst-of", self.names[0])
        for heading, key in (("SSIM", "ssim"), ("PSNR", "psnr")):
            self.choose("worst-by", heading)
            order = sorted(quality["frames"], key=lambda frame: frame[key])
            self.assertEqual(
                [line.split("\n")[0] for line in self.text("#worst-frames li")],
                [f"Frame {frame['name']}" for frame in order],
            )
        last = self.browser.find_elements(By.CSS_SELECTOR, "#worst-frames button")[-1]
        last.click()
        self.assertEqual(self.text("#time-readout .muted"), [f"Frame {order[-1]['name']}"])
        self.assertEqual(self.text("#zoom-fit"), ["×1"])

        self.choose("left", "input")
        worst = min((frame for frame in quality["frames"][::2]), key=lambda frame: frame["worst_blocks_psnr"])
        places = self.text("#worst-places li")
        self.assertEqual(len(places), 3 * 6)  # blocks of 48×48 in 128×72
        figures = [float(re.search(r"([0-9.]+) dB", place)[1]) for place in places]
        self.assertEqual(figures, sorted(figures))
        self.assertAlmostEqual(figures[0], worst["worst_blocks_psnr"], delta=0.006)
        frame, x, y = re.search(r"Frame (\d+) at (\d+), (\d+)", places[0]).groups()
        self.assertEqual(frame, worst["name"])
        self.browser.find_element(By.CSS_SELECTOR, "#worst-places button").click()
        self.assertEqual(self.text("#frame-name"), [frame])
        self.assertEqual(self.text("#zoom-fit"), ["×2"])
        shown = [Select(self.at(side)).first_selected_option.text for side in ("left", "right")]
        self.assertEqual(shown, [self.names[0], "reference"])
        # The place's frame is where the place is, unless the picture's edge keeps it from the middle.
        left = min(max(int(x) + 24, 32), 96) - 32
        top = min(max(int(y) + 24, 18), 54) - 18
        yellow = lambda color: abs(color[0] - 255) < 40 and abs(color[1] - 200) < 40 and color[2] < 60
        self.wait(
            lambda: any(yellow(self.color((int(x) - left + d) / 64, (int(y) + 24 - top) / 36)) for d in (-0.1, 0, 0.1))
            or any(yellow(self.color((int(x) + 48 - left + d) / 64, (int(y) + 24 - top) / 36)) for d in (-0.1, 0, 0.1))
        )
        self.press("0")
        self.assertEqual(self.text("#zoom-fit"), ["×1"])

    def test_figures_are_those_of_compare(self):
        self.choose("pick-time", f"{self.device_name()}, 128×72, fp32")
        rows = [
            [cell.text for cell in row.find_elements(By.CSS_SELECTOR, "th, td")]
            for row in self.browser.find_elements(By.CSS_SELECTOR, "#pick-table tbody tr")
        ]
        self.assertEqual(
            self.text("#pick-table thead th")[:5], ["Result", "PSNR (dB)", "Pooled PSNR (dB)", "SSIM", "IF-SSIM"]
        )
        expected = sorted(zip(self.names, self.quality), key=lambda pair: -pair[1]["psnr"])
        self.assertEqual(
            [row[:5] for row in rows],
            [
                [name, f"{q['psnr']:.2f}", f"{q['pooled_psnr']:.2f}", f"{q['ssim']:.4f}", f"{q['if_ssim']:.4f}"]
                for name, q in expected
            ],
        )
        headings = self.text("#pick-table thead th")
        self.assertEqual(
            headings[5:], ["Disoccluded 4 (dB)", "Worst 1 % (dB)", "STRRED", "Time (ms)", "●"], headings
        )
        for (name, quality), row in zip(expected, rows):
            self.assertEqual(row[5:7], [f"{quality[key]:.2f}" for key in ("disoccluded_4_psnr", "worst_blocks_psnr")])
            stages = json.loads((self.results[name] / "report.json").read_text())["stages"]
            self.assertAlmostEqual(
                float(row[8]), 1e3 * sum(stage["seconds"] for stage in stages), delta=0.006 * float(row[8])
            )

        chart = self.browser.find_element(By.CSS_SELECTOR, "#time-charts svg")
        chart.send_keys(Keys.END)
        self.assertEqual(self.text("#time-readout > span"), ["Frame 0004", *self.names])
        for figure, values in zip(
            ("psnr", "ssim", "if_ssim"), self.browser.find_elements(By.CSS_SELECTOR, "#time-charts .values")
        ):
            self.assertEqual(
                values.text.split("\n"),
                [f"{quality['frames'][4][figure]:.{2 if figure == 'psnr' else 4}f}" for quality in self.quality],
            )

    def test_figures_are_those_of_bench(self):
        self.choose("stages-of", "bicubic, 1920×1080, fp32")
        rows = [row.split("\n") for row in self.text(".stage")]
        self.assertEqual(rows[0][0], "</script><i>convolution 1")
        self.assertIn("15.0", rows[0])
        self.assertIn("75 %", rows[0])
        self.assertIn("200", rows[0])  # 3e9 operations in 15 ms
        cells = self.text("#device-times tbody td")
        self.assertEqual(cells[0], "22.0 ms (21.1–22.9)\n50.0 fps, 4.00 times as long")
        self.assertEqual(cells[1], "5.50 ms (5.28–5.72)\n200 fps")
        self.assertEqual(cells[2], "no score: differs by 0.3")
        self.choose("roofline-device", "device of this")
        self.assertIn("15.0 ms, 200 GFLOP/s at 30.0 FLOP/byte, 20 % of the roof", self.text("#roofline-readout")[0])
        self.choose("pick-time", "device of that, 1920×1080, fp32")
        row = next(row for row in self.text("#pick-table tbody tr") if row.startswith("bicubic"))
        self.assertIn("5.50", row)

    def names_on_the_roofline(self):
        """Of its kernels, in the order of the keys."""
        names = []
        chart = "#roofline-chart svg"
        for _ in self.browser.find_elements(By.CSS_SELECTOR, f"{chart} circle:not(.ring)"):
            names.append(self.text("#roofline-readout > span")[0])
            self.browser.find_element(By.CSS_SELECTOR, chart).send_keys(Keys.ARROW_RIGHT)
        return names

    def test_every_kernel_is_on_the_roofline(self):
        computes, moves = "</script><i>convolution 1 plain 8x8", "</script><i>reorder plain 8x8"
        self.choose("roofline-device", "device of this")
        self.assertEqual(self.names_on_the_roofline(), [computes, moves, moves])
        self.assertIn("single precision's, for fp16 too", self.at("roofline-note").text)
        self.choose("roofline-of", "bicubic, 1920×1080, fp32")
        self.assertEqual(self.names_on_the_roofline(), [computes, moves])
        self.assertNotIn("fp16", self.at("roofline-note").text)
        self.choose("roofline-of", "nearest, 1920×1080, fp16")
        self.assertEqual(self.names_on_the_roofline(), [moves])
        self.assertEqual(
            self.text("#roofline-readout > span")[1:],
            ["nearest, 1920×1080, fp16", "5.00 ms, 20.0 GB/s without arithmetic, 40 % of the roof"],
        )
        self.assertIn("single precision's, for fp16 too", self.at("roofline-note").text)
        self.choose("roofline-device", self.device_name())
        for name in self.names:
            self.choose("roofline-of", f"{name}, 128×72, fp32")
            stages = json.loads((self.results[name] / "report.json").read_text())["stages"]
            drawn = sorted((stage for stage in stages if stage["bytes"]), key=lambda stage: -stage["seconds"])
            self.assertEqual(self.names_on_the_roofline(), [f"{stage['name']} {stage['kernel']}" for stage in drawn])
            for stage in stages:
                self.assertEqual(f" {stage['name']}" in self.at("roofline-note").text, stage not in drawn)

    def test_a_roofline_without_roofs_or_arithmetic(self):
        folder = self.folder / "moved"
        shutil.copytree(self.results["bicubic"], folder)
        report = json.loads((folder / "report.json").read_text())
        for stage in report["stages"]:
            stage.update(operations=0, bytes=1000)
        (folder / "report.json").write_text(json.dumps(report))
        page = self.folder / "moved.html"
        run("report", folder, "--sequence", self.sequence, "-o", page)
        self.open(page)
        self.assertEqual(len(self.names_on_the_roofline()), len(report["stages"]))
        self.assertNotIn("NaN", self.at("roofline-chart").get_attribute("innerHTML"))

    def test_stages_that_take_no_time(self):
        """As a device's coarse clock may say. And the browser logs no error."""
        folder = self.folder / "timeless"
        shutil.copytree(self.results["bicubic"], folder)
        report = json.loads((folder / "report.json").read_text())
        for stage in report["stages"]:
            stage.update(seconds=0)
        (folder / "report.json").write_text(json.dumps(report))
        page = self.folder / "timeless.html"
        run("report", folder, "--sequence", self.sequence, "-o", page)
        self.open(page)
        self.assertFalse(self.shown("roofline"))
        for identifier in ("what-to-pick", "stages"):
            self.assertNotIn("NaN", self.at(identifier).get_attribute("innerHTML"))

    def test_every_choice_can_be_made(self):
        """And the browser logs no error."""
        for select in self.browser.find_elements(By.CSS_SELECTOR, "select"):
            for option in Select(select).options if select.is_displayed() else []:
                option.click()
                if select.get_attribute("id") == "roofline-device":
                    for profile in Select(self.at("roofline-of")).options:
                        profile.click()

    def test_the_keyboard_is_enough(self):
        self.press("d")
        self.assertFalse(self.shown("split"))
        self.press_where_the_focus_is("]")
        self.assertEqual(self.text("#frame-name"), ["0004"])
        self.press_where_the_focus_is("d")
        self.assertTrue(self.shown("split"))
        self.press_where_the_focus_is(Keys.ARROW_RIGHT)
        self.assertEqual(self.at("split").get_attribute("aria-valuenow"), "52")
        self.press_where_the_focus_is("++")
        zoomed = self.picture()
        for there, back in ((Keys.ARROW_RIGHT, Keys.ARROW_LEFT), (Keys.ARROW_UP, Keys.ARROW_DOWN)):
            self.press_where_the_focus_is(there, Keys.SHIFT)
            self.assertNotEqual(self.picture(), zoomed)
            self.assertEqual(self.at("split").get_attribute("aria-valuenow"), "52")
            self.press_where_the_focus_is(back, Keys.SHIFT)
            self.assertEqual(self.picture(), zoomed)
        self.assertIn("Shift", self.text("kbd"))

    def press_where_the_focus_is(self, keys, held=Keys.NULL):
        ActionChains(self.browser).key_down(held).send_keys(keys).key_up(held).perform()

    def tap(self, selector, x, y=0.5):
        """At shares of the element's width and height."""
        element = self.browser.find_element(By.CSS_SELECTOR, selector)
        self.script("arguments[0].scrollIntoView({block: 'center'})", element)
        box = self.script(
            "const {x, y, width, height} = arguments[0].getBoundingClientRect(); return [x, y, width, height]", element
        )
        action = ActionBuilder(self.browser, mouse=PointerInput(interaction.POINTER_TOUCH, "finger"))
        finger = action.pointer_action
        finger.move_to_location(int(box[0] + x * box[2]), int(box[1] + y * box[3])).pointer_down().pointer_up()
        action.perform()

    def test_a_finger_reads_the_charts(self):
        self.choose("roofline-device", "device of this")
        self.choose("roofline-of", "bicubic, 1920×1080, fp32")
        for dot, name in ((2, "reorder"), (1, "convolution 1")):
            self.tap(f"#roofline-chart circle:nth-of-type({dot})", 0.5)
            self.wait(lambda: name in self.text("#roofline-readout")[0])
        self.tap("#time-charts svg", 0.3)
        self.wait(lambda: "Frame 0001" in self.text("#time-readout")[0])  # of which there is no picture
        self.assertIn(self.text("#frame-name")[0], ("0000", "0002"))

    def test_a_phone(self):
        self.browser.set_window_size(390, 844)
        self.addCleanup(self.browser.set_window_size, 1200, 900)
        self.wait(lambda: self.script("return document.documentElement.scrollWidth <= window.innerWidth"))

    def test_text_is_readable_in_light_and_dark(self):
        self.addCleanup(self.browser.execute_cdp_cmd, "Emulation.setEmulatedMedia", {"features": []})
        backgrounds = {}
        for scheme in ("light", "dark"):
            media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
            self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
            self.open(self.page)
            backgrounds[scheme], contrasts = self.script(CONTRASTS)
            self.assertGreater(len(contrasts), 50)
            self.assertEqual([each for each in contrasts if each[0] < 4.5], [], scheme)  # WCAG's AA for text
        self.assertNotEqual(backgrounds["light"], backgrounds["dark"])

    def test_a_page_that_is_viewed_grows_at_the_same_place(self):
        """clarus view: frames come while somebody looks at a frame, enlarged."""
        growing = self.folder / "growing"
        growing.mkdir()
        images = sorted(self.results["bicubic"].glob("*.png"))
        for image in images[:2]:
            shutil.copy(image, growing)
        command = [TOOL, "view", growing, "--sequence", self.sequence, "--pictures", "3"]
        with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True) as view:
            try:
                self.browser.get(view.stdout.readline().split()[0])
                figures = "return report.results[0].quality.frames.map(({name, psnr}) => psnr && name)"

                def has(count):
                    try:
                        return self.script(figures) == [image.stem for image in images[:count]]
                    except JavascriptException:  # the page comes anew
                        return False

                self.wait(lambda: has(2))
                self.assertEqual(self.at("frame-name").text, images[1].stem)  # the last
                shutil.copy(images[2], growing)
                self.wait(lambda: has(3))
                self.assertEqual(self.at("frame-name").text, images[2].stem)
                self.choose("left", "input")
                self.at("zoom-in").click()
                self.press("[")
                self.press(Keys.ARROW_LEFT)
                kept = self.script("return report.picture()")
                self.assertEqual((kept["frame"], kept["zoom"]), (images[1].stem, 2))
                for image in images[3:]:
                    shutil.copy(image, growing)
                self.wait(lambda: has(5))
                now = self.script("return report.picture()")
                now["frame"] = kept["frame"] = None  # the nearest of those that are pictured
                self.assertEqual(now, kept)
                self.assertTrue(self.shown("over-time"))
            finally:
                view.send_signal(signal.SIGINT)
        self.assertEqual(view.returncode, 0)
        self.wait(lambda: "lost" in (self.at("subtitle").get_attribute("class") or ""))
        self.browser.get_log("browser")  # which says that the server is gone

    def test_devices_alone(self):
        page = self.folder / "devices.html"
        run("report", self.folder / "this.json", "-o", page)
        self.open(page)
        for section in ("pictures", "worst", "over-time", "what-to-pick"):
            self.assertFalse(self.shown(section), section)
        self.assertTrue(self.shown("devices"))

    def test_results_alone(self):
        page = self.folder / "results.html"
        run("report", self.results[AWKWARD], "--sequence", self.sequence, "--lossless", "-o", page)
        self.open(page)
        self.assertFalse(self.shown("devices"))
        self.assertIn("clarus bench measures them", self.at("roofline-note").text)

    def test_what_is_refused_leaves_no_page(self):
        other = self.folder / "other.json"
        other.write_text("{}")
        page = self.folder / "none.html"
        self.assertIn("other.json", run("report", other, "-o", page, fails=True))
        torn = bench("a device", 0.02)
        torn["items"][0]["score"]["stages"][0]["seconds"]["median"] = "fast"
        other.write_text(json.dumps(torn))
        refusal = run("report", other, "-o", page, fails=True)
        self.assertIn("items[0].score.stages[0].seconds.median", refusal)
        torn = bench("a device", 0.02)
        torn["items"][0]["device"] = "7:7"
        other.write_text(json.dumps(torn))
        self.assertIn("items[0].device", run("report", other, "-o", page, fails=True))
        torn = bench("a device", 0.02)
        torn["items"][0]["score"]["stages"] = []
        other.write_text(json.dumps(torn))
        self.assertIn("items[0].score.stages", run("report", other, "-o", page, fails=True))
        shutil.copytree(self.results["bicubic"], self.folder / "odd")
        (self.folder / "odd" / "report.json").write_text('{"model": {"name": 1}}')
        refusal = run("report", self.folder / "odd", "--sequence", self.sequence, "-o", page, fails=True)
        self.assertIn("model.name", refusal)
        self.assertIn("--sequence", run("report", self.results["bicubic"], "-o", page, fails=True))
        for trace, words in (
            ({"traceEvents": []}, "otherData"),
            ({"traceEvents": [{"ph": "X"}], "otherData": {"began": 1}}, "traceEvents[0] lacks the field \"name\""),
            ({"traceEvents": [], "otherData": {"began": 1}}, "no span says of which frame it is"),
        ):
            other.write_text(json.dumps(trace))
            self.assertIn(words, run("report", "--trace", other, "-o", page, fails=True))
        self.assertFalse(page.exists())

    def test_what_the_page_reads_of_a_bench_file_must_be_there(self):
        whole = json.loads(json.dumps(bench("a device", 0.02)))
        torn, page = self.folder / "torn.json", self.folder / "torn.html"
        seen = set()
        for holder, place, key in list(members(whole)):
            if any(unread in f"{place}.{key}" for unread in UNREAD):
                del holder[key]
                continue
            kind = key if key in figure(1) else re.sub(r"\d+", "", f"{place}.{key}")  # one of each is enough
            if kind in seen:
                continue
            seen.add(kind)
            value = holder.pop(key)
            torn.write_text(json.dumps(whole))
            refusal = run("report", torn, "-o", page, fails=True)
            self.assertIn(f'{"the top level" if place == "top" else place} lacks the field "{key}"', refusal)
            holder[key] = value
        self.assertFalse(page.exists())
        torn.write_text(json.dumps(whole))
        run("report", torn, "-o", page)
        self.open(page)
        self.assertTrue(self.shown("devices"))

    def test_what_is_read_is_not_replaced(self):
        bench_file, result, images = self.folder / "this.json", self.results[AWKWARD], self.sequence / "reference"
        for file, why in (
            (bench_file, "would replace what clarus bench wrote"),
            (result / "report.json", "would replace what clarus upscale wrote"),
            (result / "0001.png", "would replace an image of a result"),
            (next((result / "views").glob("*/*")), "would replace a picture of a view"),
            (next((self.sequence / "color").iterdir()), "would replace an image of the sequence"),
            (self.sequence / "sequence.json", "would lie among the sequence's own files"),
        ):
            before = file.read_bytes()
            refusal = run("report", bench_file, result, "--sequence", self.sequence, "-o", file, fails=True)
            self.assertIn(f"{file} {why}", refusal)
            self.assertEqual(file.read_bytes(), before)
        file = next(images.iterdir())
        refusal = run("report", result, "--sequence", images, "-o", file, fails=True)
        self.assertIn(f"{file} would replace a reference", refusal)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
