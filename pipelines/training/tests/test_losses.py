"""Losses against their definitions: python3 -m unittest discover tests."""

import math
import unittest

import torch

from clarus_training import losses, mlaa, mnss, nsrr, operators, srpo
from clarus_training.frame import Frame


def plain_ssim(x, y, row, column):
    """Of the 11×11 window whose top left corner is given, one channel."""
    weights = {(i, j): math.exp(-((i - 5) ** 2 + (j - 5) ** 2) / (2 * 1.5**2)) for i in range(11) for j in range(11)}
    total = sum(weights.values())

    def mean(value):
        return sum(w / total * value(row + i, column + j) for (i, j), w in weights.items())

    mean_x, mean_y = mean(lambda i, j: x[i][j]), mean(lambda i, j: y[i][j])
    variance_x = mean(lambda i, j: (x[i][j] - mean_x) ** 2)
    variance_y = mean(lambda i, j: (y[i][j] - mean_y) ** 2)
    covariance = mean(lambda i, j: (x[i][j] - mean_x) * (y[i][j] - mean_y))
    luminance = (2 * mean_x * mean_y + 1e-4) / (mean_x**2 + mean_y**2 + 1e-4)
    return luminance * (2 * covariance + 9e-4) / (variance_x + variance_y + 9e-4)


class Losses(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)

    def test_steady(self):
        reference = torch.rand(4, 2, 3, 5, 7)
        reference[1:, 0] = reference[0, 0]  # one clip stands still
        output = torch.rand(4, 2, 3, 5, 7)
        changes = sum((output[t, 0] - output[t - 1, 0]).abs().sum() for t in range(1, 4)) / output.numel()
        wanted = (output - reference).abs().mean() + changes
        torch.testing.assert_close(losses.l1_steady(output, reference), wanted)
        torch.testing.assert_close(losses.l1_steadier(output, reference), wanted + 3 * changes)
        torch.testing.assert_close(losses.l1_steady(output[:1], reference[:1]), losses.l1(output[:1], reference[:1]))

    def test_ssim(self):
        x, y = torch.rand(2, 3, 12, 14, dtype=torch.float64), torch.rand(2, 3, 12, 14, dtype=torch.float64)
        result = losses.ssim_map(x, y)
        self.assertEqual(result.shape, (2, 3, 2, 4))
        for n, c, i, j in ((0, 0, 0, 0), (1, 2, 1, 3), (0, 1, 1, 2)):
            wanted = plain_ssim(x[n, c].tolist(), y[n, c].tolist(), i, j)
            self.assertAlmostEqual(result[n, c, i, j].item(), wanted, 10)
        self.assertAlmostEqual(losses.ssim(x, x).item(), 0, 5)
        self.assertAlmostEqual(losses.ssim(x, y).item(), 1 - result.mean().item(), 5)

    def test_pointwise(self):
        x, y = torch.rand(2, 3, 4, 4), torch.rand(2, 3, 4, 4)
        differences = (x - y).flatten().tolist()
        l1 = sum(map(abs, differences)) / len(differences)
        l2 = sum(d * d for d in differences) / len(differences)
        self.assertAlmostEqual(losses.l1(x, y).item(), l1, 5)
        self.assertAlmostEqual(losses.l1_l2(x, y).item(), l1 + 10 * l2, 5)
        self.assertAlmostEqual(losses.ssim_l1(torch.zeros(1, 3, 11, 11), torch.ones(1, 3, 11, 11)).item(), 2, 3)

    def clip(self, number):
        still = torch.zeros(1, 2, 8, 8)
        jitters = operators.halton_jitter(number)
        frames = [Frame(torch.rand(1, 3, 8, 8), torch.rand(1, 1, 8, 8), still, jitter) for jitter in jitters]
        return frames, torch.rand(number, 1, 3, 16, 16)

    def test_nsrr_looks_at_the_last_frame_in_its_colours(self):
        frames, reference = self.clip(3)
        for color, convert in (("ycbcr", operators.ycbcr), ("rgb", lambda image: image)):
            network = nsrr.create(scale=2, previous_frames=1, width=4, network_color=color)
            state = None
            for frame in frames:
                inside = {}
                _, state = network.step(frame, state, inside=inside)
            wanted = losses.l1(inside["network_output"], convert(reference[-1])).item()
            self.assertAlmostEqual(nsrr.loss(network, frames, reference, losses.l1).item(), wanted, 5)

    def test_mnss_sum_and_guidance(self):
        frames, reference = self.clip(3)
        network = mnss.create(2)
        for progress in (0.0, 0.5):
            total, state = 0, None
            for t, frame in enumerate(frames):
                inside = {}
                output, (_, depth) = network.step(frame, state, inside=inside)
                state = (reference[t] if progress == 0.0 else output, depth)
                qx, qy = operators.sample_position(2, frame.jitter)
                samples = reference[t][:, :, qy::2, qx::2]
                total += losses.ssim(output, reference[t]) + 5 * (inside["antialiased"] - samples).abs().mean()
            self.assertAlmostEqual(mnss.loss(network, frames, reference, None, progress).item(), total.item() / 3, 4)

    def test_srpo_learns_from_what_is_shown_in_the_end(self):
        (frame,), reference = self.clip(1)
        network = srpo.create(2)
        with torch.no_grad():
            network.conv[-1].weight.mul_(300)
        raw = network.offsets(frame.color)
        early, late = (srpo.loss(network, [frame], reference, losses.l1, progress) for progress in (0.25, 0.26))
        self.assertAlmostEqual(early.item(), losses.l1(srpo.project(frame.color, raw, 2), reference[0]).item(), 6)
        shown, wanted = (mlaa.antialiased(image) for image in (network.step(frame)[0], reference[0]))
        self.assertAlmostEqual(late.item(), losses.l1(shown, wanted).item(), 6)
        late.backward()
        self.assertGreater(network.conv[-1].weight.grad.abs().max().item(), 0)

    def test_soft_rounding_is_near_rounding_and_steepest_where_that_jumps(self):
        offsets = torch.linspace(-2, 2, 401).requires_grad_()
        soft = srpo.softly_rounded(offsets)
        self.assertTrue((soft.diff() >= 0).all())
        off_jumps = (offsets - offsets.round()).abs() < 0.25
        self.assertLess((soft - srpo.rounded(offsets)).abs()[off_jumps].max().item(), 0.001)
        soft.sum().backward()
        at_jump, beside, far = (offsets.grad[place].item() for place in (250, 240, 225))  # 0.5, 0.4 and 0.25
        self.assertGreater(at_jump, 5)
        self.assertGreater(at_jump, 10 * beside)
        self.assertGreater(beside, 10 * far)
        self.assertGreater(far, 0)


if __name__ == "__main__":
    unittest.main()
