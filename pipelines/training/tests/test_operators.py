"""Operators against docs/pipelines.md, "Operators", written as plain loops: python3 -m unittest discover tests."""

import math
import unittest

import torch
import torch.nn.functional as F

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
        padded = F.pad(image, (20, 20, 20, 20))[0, 0]  # a border of zeros wide enough for any of the vectors
        for border in ("clamp", "zero"):
            result = operators.warp(image, motion, border, 0.5)
            for y in range(6):
                for x in range(7):
                    u, v = x + motion[0, 0, y, x].item(), y + motion[0, 1, y, x].item()
                    if (y, x) == (2, 3):
                        wanted = 0.5
                    elif border == "zero":
                        wanted = plain_bilinear(padded, u + 20, v + 20).item()
                    else:
                        wanted = plain_bilinear(image[0, 0], u, v).item()
                    self.assertAlmostEqual(result[0, 0, y, x].item(), wanted, 12)

    def test_warp_blocks(self):
        for height, width in ((16, 24), (9, 13), (3, 3)):
            image = torch.rand(2, 3, height, width, dtype=torch.float64, requires_grad=True)
            blocks = torch.randn(2, 2, -(-height // 8), -(-width // 8), dtype=torch.float64) * 6
            blocks[0, :, 0, 0] = torch.tensor((-200.0, 300.5))
            result = operators.WarpBlocks.apply(image, *operators.block_patches(blocks, (height, width)))
            wanted = operators.warp(image, operators.expand_blocks(blocks, (height, width)), "clamp", 0)
            self.assertTrue(torch.allclose(result, wanted, atol=1e-12))
            weight = torch.rand_like(result)
            gradients = [torch.autograd.grad((each * weight).sum(), image)[0] for each in (result, wanted)]
            self.assertTrue(torch.allclose(*gradients, atol=1e-12))

    def test_upsample_motion(self):
        motion = torch.randn(1, 2, 5, 6)
        motion[0, 1, 2, 3] = float("nan")
        for scale, jitter in ((2, (0.0, 0.0)), (3, (0.25, -0.4)), (2, (0.25, 0.25))):
            result = operators.upsample_motion(motion, scale, jitter)
            for y in range(5 * scale):
                for x in range(6 * scale):
                    u = min(max((x + 0.5) / scale - 0.5 - jitter[0], 0), 5)
                    v = min(max((y + 0.5) / scale - 0.5 - jitter[1], 0), 4)
                    # The invalid pixel's weight is the product of these; each has to exceed 10⁻³.
                    invalid = 1 - abs(u - 3) > 1e-3 and 1 - abs(v - 2) > 1e-3
                    self.assertEqual(torch.isnan(result[0, :, y, x]).all().item(), invalid)
                    if not invalid:
                        wanted = scale * plain_bilinear(torch.nan_to_num(motion[0, 0]), u, v).item()
                        self.assertAlmostEqual(result[0, 0, y, x].item(), wanted, 4)

    def test_samples_go_where_they_lie(self):
        image = torch.rand(1, 2, 3, 4)
        for scale, jitter, q in ((2, (-0.5, 0.49), (0, 1)), (3, (-1 / 6, 1 / 6), (1, 2)), (4, (0.9, -0.9), (3, 0))):
            self.assertEqual(operators.sample_position(scale, jitter), q)
            up = operators.zero_upsample(image, scale, jitter)
            self.assertTrue(torch.equal(up[:, :, q[1] :: scale, q[0] :: scale], image))
            self.assertAlmostEqual(up.sum().item(), image.sum().item(), 4)
            self.assertTrue(torch.equal(operators.pick(up, scale, jitter), image))
            placed = operators.place(torch.ones_like(up), image, scale, jitter)
            self.assertTrue(torch.equal(placed, torch.where(up == 0, torch.ones_like(up), up)))

    def test_ycbcr(self):
        image = torch.rand(1, 3, 4, 4, dtype=torch.float64)
        converted = operators.ycbcr(image)
        red, green, blue = image[0, :, 1, 2].tolist()
        luma = 0.299 * red + 0.587 * green + 0.114 * blue
        wanted = (luma, 0.5 + (blue - luma) / 1.772, 0.5 + (red - luma) / 1.402)
        for value, expected in zip(converted[0, :, 1, 2].tolist(), wanted):
            self.assertAlmostEqual(value, expected, 12)
        self.assertTrue(torch.allclose(operators.rgb(converted), image, atol=1e-12))

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
