#!/usr/bin/env python3
"""clarus_share.py against the C library, record.py and judge_motion.py: share_python_test.py LIBRARY TINY_RENDERER"""

import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import unittest

TREE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
INTEGRATIONS = os.path.join(TREE, "integrations")
sys.path.insert(0, INTEGRATIONS)

import clarus_share  # noqa: E402
import judge_motion  # noqa: E402
import numpy as np  # noqa: E402

WIDTH, HEIGHT = 6, 4


def description():
    described = clarus_share.library().clarus_share_default_description()
    for kind, type_, channels in ((clarus_share.COLOR, 0, 4), (clarus_share.DEPTH, 1, 1), (clarus_share.MOTION, 2, 2)):
        image = clarus_share.Resource(clarus_share.Format(type_, channels), WIDTH, HEIGHT, 0)
        described.resources[kind] = image
    described.depth_projective = 1
    described.motion_scale_x, described.motion_scale_y = -WIDTH, HEIGHT
    described.scale = 1.5
    return described


def image_of(frame, kind):
    image = frame.images[kind].array()
    return np.arange(image.size).reshape(image.shape) + frame.number


class Test(unittest.TestCase):
    def test_every_field_arrives(self):
        arrived = []

        def read():
            with clarus_share.Reader("python") as reader:
                described = reader.description
                arrived.append((described.scale, described.motion_scale_x, described.motion_scale_y))
                self.assertEqual(described.resources[clarus_share.MOTION].width, WIDTH)
                for frame in reader:
                    same = [np.array_equal(frame.images[k].array(), image_of(frame, k)) for k in range(3)]
                    said = frame.number, frame.jitter_x, frame.near_plane, frame.far_plane, frame.reset
                    arrived.append((all(same), *said, frame.has_matrices, frame.projection[15]))

        with clarus_share.Stream("python", description()) as stream:
            reader = threading.Thread(target=read)
            reader.start()
            for number in (3, 4, 5):
                frame = stream.begin()
                frame.number = number
                for kind in range(3):
                    frame.images[kind].array()[:] = image_of(frame, kind)
                frame.jitter_x, frame.near_plane, frame.far_plane = 0.25, 0.5, math.inf
                frame.reset = number == 4
                frame.has_matrices = 1
                frame.projection[15] = 7
                stream.end(frame)
        reader.join(30)
        self.assertEqual(arrived[0], (1.5, -WIDTH, HEIGHT))
        # The first frame of a connection resets in any case.
        expected = [(True, n, 0.25, 0.5, math.inf, int(n < 5), 1, 7) for n in (3, 4, 5)]
        self.assertEqual(arrived[1:], expected)

    def test_errors_are_told(self):
        with clarus_share.Stream("taken", description()) as stream:
            with self.assertRaisesRegex(clarus_share.ShareError, "taken"):
                clarus_share.Stream("taken", description())
            frame = stream.begin()
            frame.jitter_x = 5
            with self.assertRaisesRegex(clarus_share.ShareError, "jitter"):
                stream.end(frame)
        with self.assertRaises(clarus_share.ShareError):
            clarus_share.Reader("nobody", 10)

    def test_what_is_recorded_is_what_was_shared(self):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, os.path.join(INTEGRATIONS, "record.py"), "exact", folder]
            described = description()
            described.linear_color, described.dynamic_resolution, described.depth_projective = 1, 1, 0
            for kind in (clarus_share.COLOR, clarus_share.MOTION):
                described.resources[kind].format.type = 2
            described.resources[clarus_share.DEPTH].width = 0
            third = np.float32(1) / np.float32(3)
            with clarus_share.Stream("exact", described) as stream:
                recorder = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
                for number in (3, 4, 6):
                    frame = stream.begin()
                    if number == 6:
                        frame.width, frame.height = WIDTH - 2, HEIGHT - 1
                    for kind in (clarus_share.COLOR, clarus_share.MOTION):
                        frame.images[kind].array()[:] = third * (number + 1)
                    frame.number, frame.exposure, frame.frame_seconds = number, 0.5, 0.04
                    stream.end(frame)
            self.assertIn("3 frames in", recorder.communicate(timeout=60)[0])
            with open(os.path.join(folder, "sequence.json")) as file:
                sequence = json.load(file)
            self.assertNotIn("depth", sequence)
            self.assertNotIn("mip_bias", sequence)
            self.assertAlmostEqual(sequence["frame_rate"], 25, 4)
            frames = sequence["frames"]
            self.assertEqual([frame["reset"] for frame in frames], [True, False, True])
            self.assertEqual([frame["exposure"] for frame in frames], [0.5] * 3)
            self.assertEqual(frames[2]["render_size"], [WIDTH - 2, HEIGHT - 1])
            for number, frame in zip((3, 4, 6), frames):
                size = frame.get("render_size", [WIDTH, HEIGHT])
                color = judge_motion.read(folder, frame["color"])
                self.assertEqual(color.shape, (size[1], size[0], 3))
                self.assertTrue(np.all(color == third * (number + 1)))
                expected = third * (number + 1) * np.float32([-WIDTH, HEIGHT])
                self.assertTrue(np.all(judge_motion.read(folder, frame["motion"]) == expected))

    def test_a_stream_is_recorded_and_its_motion_judged(self):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, os.path.join(INTEGRATIONS, "record.py"), "tiny", folder, "--frames", "5", "--mip-bias", "-1"]
            with subprocess.Popen([TINY_RENDERER, "tiny", "8"], stderr=subprocess.DEVNULL) as renderer:
                subprocess.run([*command, "--skip", "2"], check=True, stdout=subprocess.DEVNULL, timeout=60)
                renderer.kill()
            with open(os.path.join(folder, "sequence.json")) as file:
                sequence = json.load(file)
            self.assertEqual(sequence["render_size"], [320, 180])
            self.assertEqual(sequence["mip_bias"], -1)
            self.assertEqual([frame["reset"] for frame in sequence["frames"]], [True] + [False] * 4)
            depth = judge_motion.read(folder, "depth/0004.exr")
            self.assertEqual((depth < 0.5).sum(), 39 * 180)
            np.testing.assert_allclose(judge_motion.read(folder, "motion/0000.exr")[0, 3], [-1, 0])
            # A bar moves by a pixel a frame over what stands still: warped it fits, but for what it uncovers.
            for _, _, (share, still, warped) in judge_motion.compare(folder):
                self.assertGreater(share, 0.9)
                self.assertGreater(warped, still + 20)


if __name__ == "__main__":
    os.environ["CLARUS_SHARE_LIBRARY"], TINY_RENDERER = sys.argv[1:]
    with tempfile.TemporaryDirectory() as runtime:
        os.environ["XDG_RUNTIME_DIR"] = runtime
        unittest.main(argv=sys.argv[:1])
