"""Quality over time as a picture: python3 -m unittest discover tests."""

import json
import os
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

from clarus_training import trade_off

FIGURES = {
    "a-x2": {"psnr": 26.0, "ssim": 0.80},
    "a-x2-int8": {"psnr": 25.5, "ssim": 0.79},
    "b-x2": {"psnr": 27.0, "ssim": 0.81},
    "untimed": {"psnr": 20.0, "ssim": 0.5},
}
TIMES = {"a-x2": 20.0, "a-x2-int8": 8.0, "b-x2": 200.0}


def item(name, milliseconds, width=1920, device="0:0"):
    score = {"latency": {"median": milliseconds / 1e3}} if milliseconds else None
    return {"device": device, "model": {"name": name}, "output_size": [width, 1080], "score": score}


class TradeOff(unittest.TestCase):
    def circles(self, figures, times):
        root = ElementTree.fromstring(trade_off.plot(figures, times))
        marks = [each for each in root.iter("{http://www.w3.org/2000/svg}circle") if "stroke" in each.attrib]
        return [(float(each.get("cx")), float(each.get("cy")), each.get("fill")) for each in marks]

    def test_better_is_higher_and_slower_is_farther_right(self):
        psnr = self.circles(FIGURES, TIMES)[:3]
        (a, quantized, b) = psnr
        self.assertTrue(quantized[0] < a[0] < b[0])
        self.assertTrue(quantized[1] > a[1] > b[1])
        self.assertEqual(a[2], "#fff")
        self.assertNotEqual(quantized[2], "#fff")
        self.assertEqual(len(self.circles(FIGURES, TIMES)), 6)  # two panels, without what has no time

    def test_an_axis_of_any_length_has_a_few_ticks(self):
        for length in (0.011, 0.05, 0.93, 1.0, 3.3, 9.9, 61.0):
            with self.subTest(length=length):
                self.assertIn(len(trade_off.ticks(20.0, 20.0 + length, False)), range(3, 8))

    def test_one_model_alone_can_be_drawn(self):
        self.assertEqual(len(self.circles({"a": FIGURES["a-x2"]}, {"a": 3.0})), 2)

    def test_times_are_those_of_the_first_device_at_the_largest_size(self):
        items = [item("a", 5), item("a", 2, width=1280), item("a", 7, device="1:0"), item("b", None)]
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "bench.json")
            with open(path, "w") as file:
                json.dump({"devices": [{"profile": {"selector": "0:0"}}], "items": items}, file)
            self.assertEqual(trade_off.times_of(path), {"a": 5.0})
