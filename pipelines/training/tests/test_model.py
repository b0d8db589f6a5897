"""Model files, starting weights and the recurrence: python3 -m unittest discover tests, in this folder's parent."""

import os
import tempfile
import unittest

import torch

from clarus_training import enss, model_file, operators, safetensors
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


if __name__ == "__main__":
    unittest.main()
