import os
import sys
import tempfile
import unittest

import numpy as np
import torch

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))

import make_shapes
from clarus_training import mlaa, sequence, single_images

TOOL = os.environ.get("CLARUS_TOOL")


def image_of(rows):
    return torch.tensor(rows, dtype=torch.float32).expand(1, 3, -1, -1)


class Mlaa(unittest.TestCase):
    def test_a_step_becomes_a_slanted_edge(self):
        low = image_of([[0.0] * 8, [0.0] * 4 + [1.0] * 4, [1.0] * 8])
        # Half a pixel at the step, a line of four to each side of it, down to nothing at the middle of each.
        shares = [[0.0] * 4 + [0.375, 0.125, 0, 0], [0, 0, 0.125, 0.375] + [0.0] * 4]
        wanted = low.clone()
        wanted[:, :, 1] += torch.tensor(shares[1]) - torch.tensor(shares[0])
        # The lines' other ends are at the border, where nothing goes on.
        self.assertLess((mlaa.antialiased(low) - wanted).abs().max().item(), 1e-6)
        turned = mlaa.antialiased(low.transpose(2, 3)).transpose(2, 3)
        self.assertLess((turned - wanted).abs().max().item(), 1e-6)

    def test_corners_and_thin_lines_stay(self):
        image = torch.full((1, 3, 12, 12), 0.2)
        image[:, :, 3:8, 2:9] = 0.9
        image[:, :, 10] = 0.5
        self.assertTrue(torch.equal(mlaa.antialiased(image), image))

    def test_gradients_go_to_the_colours_that_are_mixed(self):
        image = image_of([[0.0] * 8, [0.0] * 4 + [1.0] * 4, [1.0] * 8]).clone().requires_grad_()
        mlaa.antialiased(image)[0, 0, 1, 3].backward()
        self.assertAlmostEqual(image.grad[0, 0, 1, 3].item(), 0.625, 6)
        self.assertAlmostEqual(image.grad[0, 0, 2, 3].item(), 0.375, 6)

    @unittest.skipUnless(TOOL, "CLARUS_TOOL does not name the program")
    def test_it_is_what_the_program_does(self):
        with tempfile.TemporaryDirectory() as work:
            pixels = [make_shapes.picture((i, 1), 90, 70, 30, varied=i > 0) for i in range(3)]
            pixels.append(np.zeros_like(pixels[0]))
            pixels[-1][35, 10:] = pixels[-1][36:] = 255  # a line that is longer than what is looked at
            files = [os.path.join(work, f"{i}.png") for i in range(len(pixels))]
            for file, each in zip(files, pixels):
                make_shapes.write_image(file, each)
            single_images.antialias(TOOL, files, os.path.join(work, "smooth"))
            for i, each in enumerate(pixels):
                theirs = sequence.read_pixels(os.path.join(work, "smooth", f"{i}.png")).astype(float)
                ours = 255 * mlaa.antialiased(torch.tensor(each / 255.0).permute(2, 0, 1)[None])[0].permute(1, 2, 0)
                self.assertLess(np.abs(ours.numpy() - theirs).max(), 0.501)
                self.assertGreater(np.abs(theirs - each).max(), 5)


if __name__ == "__main__":
    unittest.main()
