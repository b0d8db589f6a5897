"""The project's own network against docs/clarus.md: python3 -m unittest discover tests."""

import os
import tempfile
import unittest

import torch

from clarus_training import clarus, frame, history, losses, model_file, operators, safetensors
from clarus_training.frame import Frame


def frames(number, height=6, width=8, batch=2, flat=None):
    """Of random colours, or of one; with motion of a few pixels, some of it none."""
    result = []
    for t in range(number):
        color = torch.rand(batch, 3, height, width) if flat is None else flat[:, None, None].expand(batch, 3, height, width)
        motion = torch.randn(batch, 2, height, width)
        motion[torch.rand(batch, 1, height, width).expand_as(motion) < 0.1] = float("nan")
        depth = torch.rand(batch, 1, height, width)
        result.append(Frame(color, depth, motion, operators.halton_jitter()[t], (0.1 * t, -0.2)))
    return result


def noisy(scale=2, width=8, middle=1):
    """A network that does not start as an accumulation."""
    network = clarus.create(width, middle)
    network.scale = scale
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.2 * torch.randn_like(parameter))
    return network


def nearest(image, scale, size, jitter):
    """Every output pixel's nearest sample."""
    u, v = history.output_coordinates(image, scale, size, jitter)
    column, row = history.nearest_index(u, image.shape[3]), history.nearest_index(v, image.shape[2])
    return image[:, :, row[0, 0, :, 0]][:, :, :, column[0, 0, 0]]


class Clarus(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)

    def test_any_scale_and_jitter(self):
        network = noisy()
        for scale, size in ((1.3, (8, 10)), (1.5, (9, 12)), (2, (12, 16)), (3, (18, 24)), (4, (24, 32))):
            network.scale = scale
            for output in frame.run(network, frames(3)):
                self.assertEqual(output.shape, (2, 3, *size))
                self.assertTrue(torch.isfinite(output).all())

    def test_flat_stays_flat(self):
        color = torch.tensor([0.2, 0.7, 0.4])
        for scale in (1.5, 2, 3):
            for output in frame.run(noisy(scale), frames(4, flat=color)):
                self.assertLess((output - color[:, None, None]).abs().max().item(), 1e-5)

    def test_it_shows_what_the_frame_and_the_history_show(self):
        network, state = noisy(), None
        for each in frames(4):
            place = history.places([each], network.scale)[0]
            low, high = (nearest(e, 2, (12, 16), each.jitter) for e in history.extremes(each.color))
            if state is not None:
                past = clarus.warp_sharply(state[0], place.grid)[:, :3]
                known = place.has_history() > 0
                low = torch.where(known, torch.minimum(low, past), low)
                high = torch.where(known, torch.maximum(high, past), high)
            output, state = network.step(each, state)
            self.assertTrue((output > low - 1e-5).all() and (output < high + 1e-5).all())
            self.assertTrue((state[0][:, 3] > 0).all() and (state[0][:, 3] <= clarus.MOST).all())

    def test_sharp_warp_is_the_twelve_taps(self):
        image = torch.rand(1, 4, 7, 9, dtype=torch.float64)
        x = 2 + torch.rand(20, dtype=torch.float64) * 4
        y = 2 + torch.rand(20, dtype=torch.float64) * 2
        grid = operators.grid_at(x[None, None], y[None, None], (7, 9))
        result = clarus.warp_sharply(image, grid)[0, :, 0]

        def cubic(distance):
            d = abs(distance)
            return 1.5 * d**3 - 2.5 * d**2 + 1 if d <= 1 else -0.5 * d**3 + 2.5 * d**2 - 4 * d + 2

        for k in range(20):
            u, v = x[k].item(), y[k].item()
            column, row, total, norm = int(u), int(v), 0, 0
            for j in range(-1, 3):
                for i in range(-1, 3):
                    if i in (-1, 2) and j in (-1, 2):
                        continue
                    weight = cubic(u - column - i) * cubic(v - row - j)
                    total, norm = total + weight * image[0, :3, row + j, column + i], norm + weight
            self.assertLess((result[:3, k] - (total / norm).clamp(0, 1)).abs().max().item(), 1e-9)
            bilinear = operators.bilinear(image[:, 3:], x[None, None, k : k + 1], y[None, None, k : k + 1])
            self.assertLess((result[3, k] - bilinear).abs().max().item(), 1e-9)

    def test_no_history_is_a_reset(self):
        network = noisy()
        first, second = frames(2)
        nowhere = second._replace(motion=torch.full_like(second.motion, float("nan")))
        with torch.no_grad():
            _, state = network.step(first)
            reset, _ = network.step(second)
            self.assertLess((network.step(nowhere, state)[0] - reset).abs().max().item(), 1e-5)
            self.assertGreater((network.step(second, state)[0] - reset).abs().max().item(), 1e-3)

    def test_gradients_reach_all_layers(self):
        for scale in (1.5, 3):
            network = noisy(scale)
            reference = torch.rand(3, 2, 3, int(6 * scale), int(8 * scale))
            sum(clarus.loss(network, frames(3), reference)).backward()
            for name, parameter in network.named_parameters():
                self.assertTrue(torch.isfinite(parameter.grad).all(), name)
                self.assertGreater(parameter.grad.abs().max().item(), 0, name)
            # Every parameter and feature is of use.
            self.assertTrue((network.layers[-1].bias.grad != 0).all())

    def test_a_file_holds_the_network_for_any_scale(self):
        network = noisy(width=6, middle=2)
        with tempfile.TemporaryDirectory() as folder, torch.no_grad():
            path = os.path.join(folder, "model.safetensors")
            model_file.save(path, network)
            tensors, metadata = safetensors.load(path)
            self.assertEqual((metadata["pipeline"], metadata["scale"]), ("clarus", "any"))
            self.assertEqual(tensors["layers.3.weight"].shape, (clarus.PARAMETERS + clarus.FEATURES, 6, 3, 3))
            loaded = model_file.load(path)
            for scale in (2, 1.5):
                network.scale = loaded.scale = scale
                clip = frames(3)
                for ours, theirs in zip(frame.run(network, clip), frame.run(loaded, clip)):
                    self.assertTrue(torch.equal(ours, theirs))


if __name__ == "__main__":
    unittest.main()
