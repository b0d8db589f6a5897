"""Model files, starting weights and the recurrence: python3 -m unittest discover tests, in this folder's parent."""

import os
import tempfile
import unittest

import torch
import torch.nn.functional as F

from clarus_training import enss, enss_growth, model_file, operators, safetensors
from clarus_training.frame import Frame


def frames(count, scale, height=8, width=12):
    """Noise seen at rest: one colour, depth and (zero) motion for all frames."""
    color, depth = torch.rand(1, 3, height, width), torch.rand(1, 1, height, width)
    motion = torch.zeros(1, 2, height, width)
    return [Frame(color, depth, motion, jitter) for jitter in operators.halton_jitter(count)]


class Model(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)

    def run_through_file(self, network, **options):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "model.safetensors")
            model_file.save(path, network, **options)
            return model_file.load(path), safetensors.load(path)

    def test_a_file_holds_the_network(self):
        network = enss.create(scale=3, features=8, middle=2, hidden=16)
        jitters = operators.halton_jitter()
        table = dict(jitters=jitters)
        for options in (table, dict(), dict(table, half=True), dict(table, mlp=True)):
            loaded, (tensors, metadata) = self.run_through_file(network, **options)
            self.assertEqual(metadata, {"pipeline": "enss", "scale": "3", "features": "8"})
            self.assertEqual("first.weight" in tensors, "jitters" in options)
            self.assertEqual("mlp.6.weight" in tensors, "jitters" not in options or "mlp" in options)
            tolerance = 5e-3 if options.get("half") else 1e-6
            ours = theirs = None
            for frame in frames(3, 3):
                with torch.no_grad():
                    (output, ours), (other, theirs) = network.step(frame, ours), loaded.step(frame, theirs)
                self.assertLess((output - other).abs().max().item(), tolerance)

    def test_one_entry_needs_no_jitter(self):
        network = enss.create(scale=2, features=4, middle=0, hidden=8)
        _, (tensors, _) = self.run_through_file(network, jitters=operators.halton_jitter(1))
        self.assertNotIn("jitter", tensors)
        self.assertEqual(tensors["first.weight"].shape, (1, 4, 22, 3, 3))

    def test_training_starts_near_the_upsampled_colour(self):
        network = enss.create(scale=2, features=16, middle=1, hidden=128)
        inside = {}
        for frame in frames(16, 2):
            with torch.no_grad():
                network.step(frame, inside=inside)
            upsampled = operators.upsample(frame.color, 2, frame.jitter)
            # Away from the border, where the convolution's zeros show.
            error = (inside["candidate"] - upsampled)[:, :, 4:-4, 4:-4].square().mean().sqrt()
            self.assertLess(error.item(), 0.15)

    def outputs(self, network, clip):
        state, outputs = None, []
        for frame in clip:
            with torch.no_grad():
                output, state = network.step(frame, state)
            outputs.append(output)
        return torch.stack(outputs)

    def test_a_grown_network_computes_the_same(self):
        small = enss.create(scale=2, features=4, middle=1, hidden=16)
        for layer in small.body:
            torch.nn.init.normal_(layer.weight, std=0.3)
            torch.nn.init.normal_(layer.bias, std=0.3)
        large = enss.create(scale=2, features=7, middle=3, hidden=16)
        enss_growth.grow(large, small)
        clip = frames(4, 2)
        self.assertLess((self.outputs(large, clip) - self.outputs(small, clip)).abs().max().item(), 1e-5)

    def test_a_network_of_another_scale_starts_as_good(self):
        small = enss.create(scale=2, features=16, middle=1, hidden=64)
        # Something smooth, which every scale can show.
        ramp = torch.linspace(0, 6, 12)
        for scale in (3, 4):
            large = enss.create(scale=scale, features=16, middle=1, hidden=64)
            enss_growth.grow(large, small)
            color = (0.5 + 0.3 * torch.sin(ramp)).expand(1, 3, 12, 12)
            clip = [frame._replace(color=color) for frame in frames(3, 2, 12, 12)]
            outputs = [self.outputs(network, clip).flatten(0, 1) for network in (large, small)]
            pooled = [F.avg_pool2d(image, s) for image, s in zip(outputs, (scale, 2))]
            self.assertLess((pooled[0] - pooled[1])[..., 2:-2, 2:-2].abs().mean().item(), 0.02)

    def test_resampling_keeps_sums_and_interpolation_keeps_lines(self):
        matrix = enss_growth.resampling(6, 9)
        torch.testing.assert_close(matrix.sum(dim=0), torch.ones(6, dtype=torch.float64))
        self.assertEqual([round(v, 9) for v in matrix[1].tolist()], [round(1 / 3, 9)] * 2 + [0] * 4)
        centres = lambda n: (torch.arange(n, dtype=torch.float64) + 0.5) / n
        for finer in (2, 3, 4):
            torch.testing.assert_close(enss_growth.interpolation(2, finer) @ centres(2), centres(finer))

    def test_a_network_does_not_grow_into_one_that_does_not_fit(self):
        small = enss.create(scale=2, features=4, middle=1, hidden=16)
        for shape, widths in (
            (dict(features=3, middle=1, hidden=16), "3 features, the checkpoint 4"),
            (dict(features=4, middle=0, hidden=16), "0 middle layers, the checkpoint 1"),
            (dict(features=4, middle=1, hidden=24), "24 hidden units, the checkpoint's 16: --hidden 16"),
        ):
            with self.assertRaisesRegex(SystemExit, widths):
                enss_growth.grow(enss.create(scale=2, **shape), small)


if __name__ == "__main__":
    unittest.main()
