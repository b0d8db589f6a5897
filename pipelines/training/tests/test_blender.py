import importlib.util
import os
import sys
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "blender"))
import make_blender  # noqa: E402
import sampling  # noqa: E402


class Sampling(unittest.TestCase):
    def test_jitter_stays_in_the_pixel_and_repeats(self):
        jitters = [sampling.jitter_of(t) for t in range(16)]
        self.assertEqual(len(set(jitters)), 16)
        self.assertTrue(all(abs(value) <= 0.5 for jitter in jitters for value in jitter))
        self.assertEqual(sampling.jitter_of(16), jitters[0])

    def test_an_object_that_came_from_the_left_and_from_above(self):
        now, before = {0: np.eye(4), 1: np.eye(4)}, {0: np.eye(4), 1: np.eye(4)}
        before[1][:3, 3] = (-1, 2, 0)
        points = np.array([[[0, 0, -4], [9, 9, 9]]])
        motion, depth = sampling.motion_and_depth(points, np.array([[1, 0]]), now, before, 8, (6, 4), 100)
        np.testing.assert_allclose(motion, [[[-2, -4], [0, 0]]])
        np.testing.assert_allclose(depth, [[4, 100]])

    def test_depth_is_along_the_axis(self):
        pixel, depth = sampling.project(np.array([[3.0, 0, -4]]), np.eye(4), 8, (6, 4))
        np.testing.assert_allclose(pixel, [[9, 2]])
        np.testing.assert_allclose(depth, [4])

    def test_box_mean(self):
        image = np.arange(2 * 4 * 1, dtype=float).reshape(2, 4, 1)
        np.testing.assert_allclose(sampling.box_mean(image, 2)[..., 0], [[2.5, 4.5]])


class Arguments(unittest.TestCase):
    def test_bad_values_are_refused(self):
        for words in (["--scale", "5"], ["--frames", "0"], ["--samples", "15"], ["--scene", "moon"]):
            with self.assertRaises(SystemExit):
                make_blender.arguments_of(["films", *words])

    def test_segments(self):
        self.assertEqual(make_blender.segments_of(20), [{"frames": [0, 20], "kind": "moving"}])
        self.assertEqual(make_blender.segments_of(32)[1], {"frames": [20, 32], "kind": "still"})


@unittest.skipUnless(importlib.util.find_spec("bpy"), "bpy is not installed")
class Films(unittest.TestCase):
    def test_every_name_has_a_film(self):
        import scenes

        self.assertEqual(tuple(scenes.FILMS), make_blender.NAMES)


if __name__ == "__main__":
    unittest.main()
