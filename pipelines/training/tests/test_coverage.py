import unittest

import numpy as np

from clarus_training import coverage


def motion_of(x, y, size=(6, 7)):
    return np.full((coverage.FRAMES, *size, 2), (x, y), np.float32)


class CoverageTest(unittest.TestCase):
    def middle(self, motion, jitters, scale):
        """Of a pixel that was inside in all frames."""
        return coverage.sampled(coverage.followed(motion), jitters, scale)[3, 3]

    def test_a_still_pixel_has_a_sub_pixel_for_each_different_jitter(self):
        for scale in (2, 3):
            jitters = coverage.patterns(scale)
            still = motion_of(0, 0)
            self.assertEqual(self.middle(still, jitters["centre"] * 5, scale), 1)
            five = jitters["MNSS"][:5]
            self.assertEqual(self.middle(still, five, scale), len(set(five)))

    def test_motion_moves_the_sample(self):
        third = 1 / 3
        self.assertEqual(self.middle(motion_of(third, 0), [(0, 0)] * 5, 3), 3)  # 0, 1/3, 2/3 and again
        self.assertEqual(self.middle(motion_of(third, third), [(0, 0)] * 5, 3), 3)
        # The jitter goes with the surface: always the same sub-pixel.
        along = [(back * third % 1, 0) for back in range(5)]
        self.assertEqual(self.middle(motion_of(third, 0), along, 3), 1)

    def test_five_frames_of_the_pattern_see_three_sub_pixels_whatever_the_motion(self):
        for scale in (2, 3):
            pattern = coverage.patterns(scale)["MNSS"]
            for first in range(len(pattern)):
                five = [pattern[(first - back) % len(pattern)] for back in range(5)]
                for x in range(scale):
                    for y in range(scale):
                        self.assertGreaterEqual(self.middle(motion_of(x / scale, y / scale), five, scale), 3)

    def test_what_was_not_in_sight_is_not_counted(self):
        seen = coverage.sampled(coverage.followed(motion_of(100, 0)), [(0, 0)] * 5, 3)
        self.assertTrue(np.all(seen == 1))
        invalid = motion_of(0, 0)
        invalid[-1] = np.nan
        self.assertTrue(np.all(coverage.sampled(coverage.followed(invalid), [(-1 / 3, 0), (0, 0), (0, 0), (0, 0), (0, 0)], 3) == 1))

    def test_shares_are_of_all_pixels(self):
        measured = coverage.shares([motion_of(0, 0)], 3)
        self.assertEqual(list(measured["centre"]), [1, 0, 0, 0, 0])
        self.assertEqual(list(measured["MNSS"]), [0, 0, 0, 0, 1])
        for share in measured.values():
            self.assertAlmostEqual(share.sum(), 1)
        self.assertIn("| MNSS | 0.0 % |", coverage.table(measured))
        self.assertIn("<svg", coverage.plot(measured, 3))


if __name__ == "__main__":
    unittest.main()
