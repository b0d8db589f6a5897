"""NSS's operators against plain loops of docs/nss.md: python3 -m unittest discover tests."""

import math
import os
import tempfile
import unittest

import torch

from clarus_training import frame, import_nss, model_file, nss, operators, safetensors
from clarus_training.frame import Frame


def random_frame(height, width, batch=1, jitter=(0.2, -0.3)):
    depth = (torch.rand(batch, 1, height, width) * 6).floor() / 7 + 0.05
    motion = torch.randn(batch, 2, height, width) * 2
    motion[:, :, ::3] *= 0.01
    motion[:, :, :, 1::4] = float("nan")
    return Frame(torch.rand(batch, 3, height, width), depth, motion, jitter)


def vector(motion, y, x):
    """From the previous frame; None where invalid."""
    v = [-motion[0, c, y, x].item() for c in (0, 1)]
    return v if all(map(math.isfinite, v)) else None


def moving(v):
    return v if math.hypot(*v) > 0.1 else [0.0, 0.0]


def around(y, x):
    for dy in (0, 1):
        for dx in (0, 1):
            row, column = math.floor(y) + dy, math.floor(x) + dx
            yield row, column, (1 - abs(y - row)) * (1 - abs(x - column))


def scattered(depth, motion):
    height, width = depth.shape[-2:]
    rows, columns = max(1, height // 2), max(1, width // 2)
    result = [[1.0] * columns for _ in range(rows)]
    for j in range(rows):
        for i in range(columns):
            top, left = ((2 * k + 1) * n - m for k, n, m in ((j, height, rows), (i, width, columns)))
            top, left = top // (2 * rows), left // (2 * columns)
            best = None
            for dy in (0, 1):
                for dx in (0, 1):
                    y, x = min(max(top + dy, 0), height - 1), min(max(left + dx, 0), width - 1)
                    if best is None or depth[0, 0, y, x].item() <= best[0]:
                        best = (depth[0, 0, y, x].item(), y, x)
            v = vector(motion, *best[1:])
            if v is None:
                continue
            v = moving([v[0] * columns / width, v[1] * rows / height])
            for row, column, weight in around(j - v[1], i - v[0]):
                if weight > 0.1 and 0 <= row < rows and 0 <= column < columns:
                    result[row][column] = min(result[row][column], best[0])
    return result


def guided(depth, motion):
    """Each pixel's vector (None where invalid) and disocclusion."""
    height, width = depth.shape[-2:]
    before = scattered(depth, motion)
    rows, columns = len(before), len(before[0])
    tolerance, exponent = nss.depth_tolerance(height, width)
    for y in range(height):
        for x in range(width):
            best = None
            for dy, dx in nss.AROUND:
                row, column = y + dy, x + dx
                if 0 <= row < height and 0 <= column < width:
                    d = depth[0, 0, row, column].item()
                    if best is None or d < best[0]:
                        best = (d, row, column)
            raw = vector(motion, *best[1:])
            if raw is None:
                yield y, x, None, 1.0
                continue
            v, kept, weights = moving(raw), 0.0, 0.0
            for row, column, weight in around(y // 2 - v[1] * rows / height, x // 2 - v[0] * columns / width):
                if not (0 <= row < rows and 0 <= column < columns):
                    weights += weight
                elif weight > 0.1 and best[0] > before[row][column]:
                    share = tolerance * max(best[0], before[row][column]) / (best[0] - before[row][column])
                    kept += min(share, 1) ** exponent * weight
                    weights += weight
            yield y, x, raw, min(max(1 - kept / weights, 0), 1) if weights > 0 else 0.0


class Nss(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)
        torch.set_grad_enabled(False)

    def tearDown(self):
        torch.set_grad_enabled(True)

    def test_guide_is_what_loops_say(self):
        for height, width in ((9, 13), (8, 6), (1, 1), (2, 5)):
            each = random_frame(height, width)
            depth, motion = each.depth.double(), each.motion.double()
            found = nss.scatter_depth(depth, -motion)
            self.assertLess((found[0, 0] - torch.tensor(scattered(depth, motion)).double()).abs().max().item(), 1e-6)
            guide = nss.Guide(depth, motion)
            for y, x, raw, mask in guided(depth, motion):
                there = guide.motion[0, :, y, x].tolist()
                self.assertEqual(raw is None, not all(map(math.isfinite, there)))
                if raw is not None:
                    self.assertLess(max(abs(a - b) for a, b in zip(raw, there)), 1e-9)
                self.assertAlmostEqual(guide.disocclusion[0, 0, y, x].item(), mask, 6)

    def test_kernels_weigh_the_nearest_samples(self):
        for low, high, jitter in (
            ((4, 6), (8, 12), (0.3, -0.4)),
            ((4, 4), (6, 6), (-0.2, 0.1)),
            ((3, 5), (9, 15), (-0.15, 0.0)),
            ((5, 5), (5, 5), (0.45, -0.45)),
            ((10, 20), (17, 34), (0.1, 0.2)),
        ):
            place, channel, known, shown, shows = nss.kernel_taps(low, high, jitter)
            scale = [b / a for a, b in zip(low, high)]
            cells = [
                {math.floor((i + jitter[1 - axis] + 0.5) * scale[axis] + 1e-6): i for i in range(-9, low[axis] + 9)}
                for axis in (0, 1)
            ]
            for y in range(high[0]):
                for x in range(high[1]):
                    wanted = []
                    for k in range(36):
                        dy, dx = k % 6 - 2, k // 6 - 2
                        if y + dy in cells[0] and x + dx in cells[1]:
                            row, column = (
                                min(max(cells[axis][p], 0), low[axis] - 1) for axis, p in ((0, y + dy), (1, x + dx))
                            )
                            wanted.append((dy * dy + dx * dx, k, row * low[1] + column))
                    wanted = sorted(wanted)[:9]
                    count = int(known[:, y, x].sum())
                    self.assertEqual(count, len(wanted))
                    there = list(zip(channel[:count, y, x].tolist(), place[:count, y, x].tolist()))
                    self.assertEqual(there, [each[1:] for each in wanted])
                    own = wanted[0][0] == 0
                    self.assertEqual(bool(shows[y, x]), own or count < 9)
                    if count < 9:
                        under = [int((p + 0.5) / s + 1e-3) for p, s in zip((y, x), scale)]
                        self.assertEqual(shown[y, x].item(), under[0] * low[1] + under[1])
                    elif own:
                        self.assertEqual(shown[y, x].item(), wanted[0][2])

    def test_catmull_rom(self):
        image = torch.rand(1, 3, 9, 11).double()
        y, x = torch.meshgrid(torch.arange(9.0), torch.arange(11.0), indexing="ij")
        y, x = y[None].double(), x[None].double()
        self.assertLess((nss.catmull_rom(image, y, x) - image).abs().max().item(), 1e-12)
        ramp = (0.3 + 0.02 * y - 0.01 * x)[:, None].expand(-1, 3, -1, -1)
        inner = (slice(None), slice(None), slice(2, -3), slice(2, -3))
        moved = nss.catmull_rom(ramp, y + 0.4, x + 0.7)
        self.assertLess((moved - ramp - 0.02 * 0.4 + 0.01 * 0.7)[inner].abs().max().item(), 1e-3)
        spike = torch.zeros(1, 3, 9, 11).double()
        spike[..., 4, 5] = 1
        self.assertGreaterEqual(nss.catmull_rom(spike, y + 0.5, x).min().item(), 0)

    def test_radiance(self):
        color = torch.rand(1, 3, 4, 5).double()
        self.assertLess((nss.radiance(color, 1.0) - operators.srgb_decode(color)).abs().max().item(), 1e-12)
        for white in (1.0, 8.0, float("inf")):
            self.assertLess((nss.display(nss.radiance(color, white), white) - color).abs().max().item(), 1e-6)
        radiance = nss.radiance(color, float("inf"))
        tone_mapped = radiance / (1 + radiance.amax(dim=1, keepdim=True))
        self.assertLess((tone_mapped - operators.srgb_decode(color)).abs().max().item(), 1e-9)

    def test_a_still_flat_picture_stays(self):
        for white in (1.0, float("inf")):
            network, state = nss.create(2, white), None
            for t in range(4):
                still = torch.zeros(1, 2, 9, 10)
                flat = Frame(torch.full((1, 3, 9, 10), 0.6), torch.full((1, 1, 9, 10), 0.5), still, (0.1 * t, -0.2))
                output, state = network.step(flat, state)
                self.assertLess((output - 0.6).abs().max().item(), 1e-4)

    def test_gradients_reach_every_tensor(self):
        torch.set_grad_enabled(True)
        network = nss.create(1.5)
        clip = [random_frame(8, 12, 2) for _ in range(3)]
        nss.loss(network, clip, torch.rand(3, 2, 3, 12, 18)).backward()
        for name, parameter in network.named_parameters():
            self.assertTrue(torch.isfinite(parameter.grad).all(), name)
            self.assertGreater(parameter.grad.abs().max().item(), 0, name)

    def test_published_names(self):
        names = [f"conv2d_{i}" for i in range(12)] + ["kpn_params", "temporal_params_out_conv"]
        wanted = {f"autoencoder.{name}.conv2d.{part}" for name in names for part in ("weight", "bias")}
        self.assertEqual(set(nss.create(2).state_dict()), wanted)

    def test_a_published_checkpoint_is_imported(self):
        network = nss.create(2)
        each = random_frame(9, 10)
        with tempfile.TemporaryDirectory() as folder:
            published, model = (os.path.join(folder, name) for name in ("high.pt", "model.safetensors"))
            torch.save({"model_state_dict": network.state_dict(), "epoch": 3}, published)
            import_nss.convert(published, model, scale=1.5, white=float("inf"))
            _, metadata = safetensors.load(model)
            self.assertEqual(metadata, {"pipeline": "nss", "scale": "1.5", "white": "inf"})
            network.scale, network.white = 1.5, float("inf")
            self.assertTrue(torch.equal(model_file.load(model).step(each)[0], network.step(each)[0]))
            torch.save({"model_state_dict": {"other": torch.zeros(1)}}, published)
            with self.assertRaisesRegex(SystemExit, "high.pt: .*autoencoder"):
                import_nss.convert(published, model, scale=2.0, white=1.0)

    def test_sizes(self):
        for scale, size, wanted in ((1.5, (5, 7), (8, 11)), (2, (1, 1), (2, 2)), (1.0, (9, 8), (9, 8))):
            network = nss.create(scale)
            clip = [random_frame(*size) for _ in range(2)]
            for output in frame.run(network, clip):
                self.assertEqual(output.shape[-2:], wanted)
                self.assertTrue(torch.isfinite(output).all())


if __name__ == "__main__":
    unittest.main()
