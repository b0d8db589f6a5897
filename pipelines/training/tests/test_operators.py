"""Operators against the specification's definitions, written as plain loops: python3 -m unittest discover tests."""

import math
import unittest

import torch

from clarus_training import operators


def plain_bilinear(image, u, v):
    """One channel [h, w] at one place, border clamp."""
    height, width = image.shape
    u, v = min(max(u, 0), width - 1), min(max(v, 0), height - 1)
    x, y = math.floor(u), math.floor(v)
    x1, y1 = min(x + 1, width - 1), min(y + 1, height - 1)
    top = image[y, x] * (1 - (u - x)) + image[y, x1] * (u - x)
    bottom = image[y1, x] * (1 - (u - x)) + image[y1, x1] * (u - x)
    return top * (1 - (v - y)) + bottom * (v - y)


class Operators(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)

    def test_upsample(self):
        for scale, size in ((2, (5, 4)), (3, (1, 1)), (4, (3, 2))):
            image, jitter = torch.rand(1, 1, *size, dtype=torch.float64), (0.3, -0.45)
            result = operators.upsample(image, scale, jitter)
            for y in range(scale * size[0]):
                for x in range(scale * size[1]):
                    u, v = (x + 0.5) / scale - 0.5 - jitter[0], (y + 0.5) / scale - 0.5 - jitter[1]
                    self.assertAlmostEqual(result[0, 0, y, x].item(), plain_bilinear(image[0, 0], u, v).item(), 12)

    def test_keys_reproduces_a_plane_and_its_own_samples(self):
        plane = 0.2 + 0.05 * torch.arange(8.0)[None, :] + 0.03 * torch.arange(7.0)[:, None]
        result = operators.keys_upsample(plane[None, None], 2, (0.25, -0.25))[0, 0]
        self.assertAlmostEqual(result[7, 9].item(), 0.2 + 0.05 * 4.0 + 0.03 * (3.25 + 0.25), 5)
        image = torch.rand(1, 3, 5, 5)
        sampled = operators.keys_upsample(image, 2, (0.25, 0.25))[:, :, 1::2, 1::2]
        self.assertTrue(torch.allclose(sampled, image, atol=1e-6))

    def test_dilate(self):
        for scale in (2, 3, 4):
            height, width = 11, 13
            depth = (torch.rand(1, 1, height, width) * 5).floor() / 5
            motion = torch.randn(1, 2, height, width)
            result = operators.dilate(motion, depth, scale)
            for y in range(scale * height):
                for x in range(scale * width):
                    bx, by = x // 8, y // 8
                    pixels = [
                        (j, i)
                        for j in range(8 * by // scale, min((8 * by + 7) // scale, height - 1) + 1)
                        for i in range(8 * bx // scale, min((8 * bx + 7) // scale, width - 1) + 1)
                    ]
                    j, i = min(pixels, key=lambda pixel: depth[0, 0, pixel[0], pixel[1]].item())
                    self.assertTrue(torch.equal(result[0, :, y, x], scale * motion[0, :, j, i]))

    def test_warp(self):
        image = torch.rand(1, 1, 6, 7, dtype=torch.float64)
        motion = torch.randn(1, 2, 6, 7, dtype=torch.float64) * 4
        motion[0, 0, 2, 3] = float("nan")
        result = operators.warp(image, motion, 0.5)
        for y in range(6):
            for x in range(7):
                u, v = x + motion[0, 0, y, x].item(), y + motion[0, 1, y, x].item()
                wanted = 0.5 if (y, x) == (2, 3) else plain_bilinear(image[0, 0], u, v).item()
                self.assertAlmostEqual(result[0, 0, y, x].item(), wanted, 12)

    def test_mark_invalid(self):
        motion = torch.tensor([[3.0, 4.1, float("inf"), 1e30], [4.0, 4.0, 0.0, 1e30]]).view(1, 2, 1, 4)
        marked = operators.mark_invalid(torch.cat((motion, motion, motion), dim=2))  # 4×3: the diagonal is 5
        self.assertEqual(torch.isfinite(marked[0, :, 0]).all(dim=0).tolist(), [True, False, False, False])

    def test_space_to_depth(self):
        image = torch.rand(1, 2, 6, 9)
        result = operators.space_to_depth(image, 3)
        self.assertEqual(result[0, 1 * 9 + 2 * 3 + 1, 1, 2].item(), image[0, 1, 3 * 1 + 2, 3 * 2 + 1].item())
        self.assertTrue(torch.equal(operators.depth_to_space(result, 3), image))

    def test_halton(self):
        self.assertEqual(operators.halton_jitter()[1], (0.25 - 0.5, 2 / 3 - 0.5))


if __name__ == "__main__":
    unittest.main()
