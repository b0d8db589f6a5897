import contextlib
import io
import os
import random
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))

import make_shapes
from clarus_training import dataset, sequence


class Shapes(unittest.TestCase):
    def test_both_resolutions_show_the_same_picture(self):
        for seed, varied in ((0, False), (1, False), (2, True), (3, True)):
            low, high = (make_shapes.picture((seed, 0), n, n, 20, varied).astype(int) for n in (40, 120))
            # At ×3, a render pixel's middle is that of its middle output pixel; only rounding may decide otherwise.
            same = np.abs(high[1::3, 1::3] - low).max(axis=2) <= 1
            self.assertGreater(same.mean(), 0.999)
            self.assertGreater(low.std(axis=(0, 1)).min(), 1)

    def test_a_shape_lies_in_its_box(self):
        chance = np.random.default_rng(1)
        points = chance.random((4000, 2))
        covered = 0
        for i in range(60):
            shape = make_shapes.Shape(chance, make_shapes.Style.varied(chance) if i % 2 else make_shapes.Style())
            inside = shape.inside(points)
            outside_box = (points < shape.low).any(axis=1) | (points > shape.high).any(axis=1)
            self.assertFalse((inside & outside_box).any())
            covered += inside.sum()
        self.assertGreater(covered, 1000)

    def test_varied_images_are_busier_and_paler(self):
        changes, spreads = [], []
        for seed in range(12):
            images = [make_shapes.picture((seed, 0), 160, 160, 20, varied).astype(int) for varied in (False, True)]
            spreads.append([image.std(axis=(0, 1)).mean() for image in images])
            edges = (np.abs(np.diff(image, axis=0)).max(axis=2) for image in images)
            changes.append([(edge > spread / 2).mean() for edge, spread in zip(edges, spreads[-1])])
        (plain, varied), (wide, narrow) = np.mean(changes, axis=0), np.mean(spreads, axis=0)
        self.assertGreater(varied, 1.5 * plain)
        self.assertLess(narrow, 0.8 * wide)

    def test_distance_to_a_path(self):
        path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
        points = np.array([[0.5, 0.25], [-3.0, 4.0], [1.5, 0.5], [1.0, 2.0]])
        np.testing.assert_allclose(make_shapes.distance_to_path(points, path), [0.25, 5, 0.5, 1])

    def test_the_sequence(self):
        with tempfile.TemporaryDirectory() as work, contextlib.redirect_stderr(io.StringIO()):
            folder = os.path.join(work, "shapes")
            words = ["make_shapes.py", folder, "--count", "3", "--size", "24", "--scale", "2"]
            with mock.patch.object(sys, "argv", words):
                make_shapes.main()
                with self.assertRaises(SystemExit):
                    make_shapes.main()
            shapes = sequence.Sequence(folder)
            self.assertEqual(shapes.reset, [True] * 3)
            self.assertTrue((shapes.color[1] == make_shapes.picture((0, 1), 24, 24, 60)).all())
            self.assertTrue((shapes.reference[1] == make_shapes.picture((0, 1), 48, 48, 60)).all())
            # Neither depth nor motion: all is far, nothing has a history.
            (frame,), reference = dataset.Clips([shapes], 1, 16).batch(2, random.Random(0))
            self.assertEqual((frame.depth.min().item(), reference.shape), (1, (1, 2, 3, 32, 32)))
            self.assertTrue(frame.motion.isnan().all())


if __name__ == "__main__":
    unittest.main()
