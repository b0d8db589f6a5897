"""Checked history and held range against plain loops (docs/history.md), and what networks do with them."""

import math
import unittest

import torch

from clarus_training import enss, history, losses, mnss, nsrr, operators
from clarus_training.frame import Frame

SIZES = ((1, 1), (5, 1), (1, 4), (7, 9))


def scene(size, seed=0):
    """Few depths, so that there are ties and silhouettes; vectors of all kinds."""
    generator = torch.Generator().manual_seed(seed)
    height, width = size
    depth = ((torch.rand(1, 1, height, width, generator=generator) * 4).floor() + 1) / 5
    motion = torch.randn(1, 2, height, width, generator=generator) * 1.5
    motion[torch.rand(motion.shape, generator=generator) < 0.05] = float("nan")
    motion[torch.rand(motion.shape, generator=generator) < 0.03] = float("inf")
    motion[torch.rand(motion.shape, generator=generator) < 0.03] = 1e30
    return motion.double(), depth.double()


def valid(vector):
    return all(math.isfinite(component) for component in vector)


def around(x, y, size):
    """(row, column, weight) of the pixels inside the image around index coordinates that are near it."""
    height, width = size
    for row in (math.floor(y), math.floor(y) + 1):
        for column in (math.floor(x), math.floor(x) + 1):
            if 0 <= row < height and 0 <= column < width:
                yield row, column, (1 - abs(x - column)) * (1 - abs(y - row))


def plain_previous_depth(motion, depth, jitter):
    height, width = depth.shape[2:]
    result = torch.ones_like(depth)
    for y in range(height):
        for x in range(width):
            vector = motion[0, :, y, x].tolist()
            if not valid(vector) or max(map(abs, vector)) > 1e6:
                continue
            for row, column, weight in around(x + jitter[0] + vector[0], y + jitter[1] + vector[1], (height, width)):
                if weight > 0.1:
                    result[0, 0, row, column] = min(result[0, 0, row, column], depth[0, 0, y, x])
    return result


def plain_slope(line, i):
    steps = [abs(line[i] - line[j]) for j in (i - 1, i + 1) if 0 <= j < len(line)]
    return min(steps, default=0)


def plain_depth_before(motion, depth):
    height, width = depth.shape[2:]
    result = torch.zeros_like(depth)
    for y in range(height):
        for x in range(width):
            changes, here = [], depth[0, 0, y, x]
            for right, down in ((1, 0), (0, 1)):
                sides = [s for s in (-1, 1) if 0 <= x + s * right < width and 0 <= y + s * down < height]
                found = [s * (motion[0, :, y + s * down, x + s * right] - motion[0, :, y, x]) for s in sides]
                known = [each for each in found if not each.sum().isnan()] or found
                changes.append(min(known, key=lambda each: each.abs().sum(), default=torch.full((2,), math.nan)))
            (xx, yx), (xy, yy) = changes
            area = ((1 + xx) * (1 + yy) - xy * yx).item()
            area = min(max(area, 0.25), 4) if math.isfinite(area) else 1
            result[0, 0, y, x] = min(here.item() / area ** (1 / 3), 1)
    return result


def plain_neighbors(depth, x, y, radius):
    height, width = depth.shape
    for row in range(max(y - radius, 0), min(y + radius + 1, height)):
        for column in range(max(x - radius, 0), min(x + radius + 1, width)):
            yield row, column, depth[row, column].item()


def plain_companions(motion, depth, x, y):
    return [
        distance
        for row, column, distance in plain_neighbors(depth, x, y, 1)
        if (motion[:, row, column] - motion[:, y, x]).abs().max() <= 0.25
    ]


def plain_checked_motion(motion, depth, previous, jitter):
    height, width = depth.shape[2:]
    result = torch.full_like(motion, float("nan"))
    for y in range(height):
        for x in range(width):
            vector, d = motion[0, :, y, x].tolist(), depth[0, 0, y, x].item()
            if not valid(vector):
                continue
            u, v = x + jitter[0] + vector[0], y + jitter[1] + vector[1]
            if not (-0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5):
                continue
            slope = plain_slope(depth[0, 0, y].tolist(), x) + plain_slope(depth[0, 0, :, x].tolist(), y)
            least = d - (0.02 * d + 2 * slope + 2**-16)
            places = list(around(u, v, (height, width)))
            along = plain_companions(motion[0], depth[0, 0], x, y)
            nearer = 0
            for row, column, weight in places:
                before = previous[0, 0, row, column].item()
                near = any(
                    distance == before
                    and abs(i + jitter[0] + motion[0, 0, j, i] - column) < 1
                    and abs(j + jitter[1] + motion[0, 1, j, i] - row) < 1
                    for j, i, distance in plain_neighbors(depth[0, 0], x, y, 2)
                )
                if before not in along and before < (least if near else d):
                    nearer += weight
            if nearer <= 0.5 * sum(weight for _, _, weight in places):
                result[0, :, y, x] = motion[0, :, y, x]
    return result


def plain_reproject(motion, depth, scale, motion_jitter):
    height, width = depth.shape[2:]
    size = history.output_size(depth, scale)
    result = torch.zeros(1, 2, *size, dtype=motion.dtype)
    for y in range(size[0]):
        for x in range(size[1]):
            u = min(max((x + 0.5) / scale - 0.5 - motion_jitter[0], 0), width - 1)
            v = min(max((y + 0.5) / scale - 0.5 - motion_jitter[1], 0), height - 1)
            taps = []
            for row, wy in ((math.floor(v), 1 - v % 1), (math.floor(v) + 1, v % 1)):
                for column, wx in ((math.floor(u), 1 - u % 1), (math.floor(u) + 1, u % 1)):
                    if wx > 1e-3 and wy > 1e-3:
                        taps.append((motion[0, :, row, column].tolist(), depth[0, 0, row, column].item(), wx * wy))
            known = [tap for tap in taps if valid(tap[0])]
            foremost, largest = min(taps, key=lambda tap: tap[1]), max(taps, key=lambda tap: tap[2])
            apart = any(max(t[0][i] for t in known) - min(t[0][i] for t in known) > 0.25 for i in (0, 1)) if known else False
            if apart and max(t[1] for t in taps) - foremost[1] > 0.1 * foremost[1]:
                vector = foremost[0]
            elif len(known) == len(taps):
                vector = [sum(t[0][i] * t[2] for t in taps) for i in (0, 1)]
            else:
                vector = largest[0]
            result[0, :, y, x] = torch.tensor(vector, dtype=torch.float64) * scale
    return result


def plain_hold(image, color, past, scale):
    height, width = color.shape[2:]

    def around(x, y, reach):
        return slice(max(y - reach, 0), y + reach + 1), slice(max(x - reach, 0), x + reach + 1)

    low, high, outside = torch.zeros_like(color), torch.zeros_like(color), torch.zeros(height, width)
    for y in range(height):
        for x in range(width):
            seen = color[0, :, *around(x, y, 1)].flatten(1)
            low[0, :, y, x], high[0, :, y, x] = seen.amin(dim=1), seen.amax(dim=1)
            mean = past[0, :, y * scale : (y + 1) * scale, x * scale : (x + 1) * scale].mean(dim=(1, 2))
            beyond = torch.maximum(low[0, :, y, x] - mean, mean - high[0, :, y, x])
            outside[y, x] = float(beyond.max() > 2 / 255)
    result = image.clone()
    for y in range(image.shape[2]):
        for x in range(image.shape[3]):
            i, j = x // scale, y // scale
            least, most = low[0, :, j, i], high[0, :, j, i]
            if outside[around(i, j, 2)].mean() <= 0.5:
                least, most = torch.minimum(least, past[0, :, y, x]), torch.maximum(most, past[0, :, y, x])
            result[0, :, y, x] = torch.minimum(torch.maximum(image[0, :, y, x], least), most)
    return result


def same(a, b):
    finite = torch.isfinite(b)
    return torch.equal(torch.isfinite(a), finite) and torch.allclose(a[finite], b[finite], atol=1e-9, rtol=1e-9)


class Operators(unittest.TestCase):
    def test_previous_depth_and_checked_motion(self):
        for size in SIZES:
            for seed in range(4):
                motion, depth = scene(size, seed)
                previous = history.previous_depth(motion, depth, (0.3, -0.4))
                self.assertTrue(torch.equal(previous, plain_previous_depth(motion, depth, (0.3, -0.4))))
                self.assertTrue(same(history.depth_before(motion, depth), plain_depth_before(motion, depth)))
                checked = history.checked_motion(motion, depth, (0.3, -0.4))
                self.assertTrue(same(checked, plain_checked_motion(motion, depth, previous, (0.3, -0.4))))

    def test_each_image_of_a_batch_has_its_own_jitter(self):
        motion, depth = scene((7, 9))
        jitters = ((0.25, -0.5), (-0.125, 0.375))
        together = history.checked(motion.repeat(2, 1, 1, 1), depth.repeat(2, 1, 1, 1), jitters)
        for one, jitter in zip(together, jitters):
            self.assertTrue(same(one[None], history.checked(motion, depth, jitter)))

    def test_reproject(self):
        for size in SIZES:
            for scale in (1, 1.5, 2, 3, 2.7):
                motion, depth = scene(size, seed=3)
                for jitter in ((0.0, 0.0), (0.31, -0.27)):
                    found = history.reproject(motion, depth, scale, jitter)
                    self.assertTrue(same(found, plain_reproject(motion, depth, scale, jitter)), (size, scale, jitter))

    def test_hold(self):
        generator = torch.Generator().manual_seed(1)
        for size in SIZES:
            for scale in (1, 2, 3):
                color = torch.rand(1, 3, *size, generator=generator)
                output = history.output_size(color, scale)
                image, past = (torch.randn(1, 3, *output, generator=generator) for _ in range(2))
                held = history.hold(image, color, past, scale)
                self.assertTrue(torch.equal(held, plain_hold(image, color, past, scale)))


def moving_box():
    """A box before a wall that moved six pixels to the right: what was behind its left part is uncovered."""
    depth = torch.full((1, 1, 16, 32), 0.5)
    motion = torch.zeros(1, 2, 16, 32)
    depth[..., 4:12, 14:22], motion[:, 0, 4:12, 14:22] = 0.2, -6
    return motion, depth


class Meaning(unittest.TestCase):
    def test_what_a_box_uncovers_has_no_history_and_all_else_has(self):
        motion, depth = moving_box()
        expected = torch.ones(16, 32)
        expected[4:12, 8:14] = 0
        validity = history.validity(history.checked(motion, depth, (0.0, 0.0)))[0, 0]
        self.assertTrue(torch.equal(validity, expected))

    def test_a_silhouette_follows_the_nearer_surface(self):
        motion, depth = moving_box()
        followed = history.reproject(motion, depth, 2, (0.0, 0.0))[0, 0]
        self.assertTrue((followed[8:24, 27:45] == -12).all())  # a pixel more than the box's own 28 … 43
        self.assertTrue((followed[8:24, :26] == 0).all())

    def test_a_camera_that_moves_back_uncovers_nothing_of_a_floor(self):
        y = torch.arange(24.0)[:, None].expand(24, 32)
        depth = 1 / (y + 4)
        motion = torch.zeros(1, 2, 24, 32)
        motion[0, 1] = 0.02 * (y + 4)
        validity = history.validity(history.checked(motion, depth[None, None], (0.1, 0.2)))
        self.assertTrue((validity[..., :-1, :] == 1).all())

    def test_new_pixels_at_the_border_have_no_history(self):
        motion = torch.zeros(1, 2, 8, 8)
        motion[:, 0] = 3
        validity = history.validity(history.checked(motion, torch.full((1, 1, 8, 8), 0.5), (0.0, 0.0)))
        self.assertTrue((validity[..., :5] == 1).all() and (validity[..., 5:] == 0).all())


def networks():
    yield enss.create(2, 8, 1, 16, checked=True, held=True)
    yield mnss.create(2, checked=True, held=True)
    yield nsrr.create(scale=2, previous_frames=2, width=4, checked=True, held=True)


def flat_frames(colors, size=(8, 12)):
    motion, depth = torch.zeros(1, 2, *size), torch.full((1, 1, *size), 0.5)
    return [
        Frame(torch.full((1, 3, *size), c), depth, motion, j) for c, j in zip(colors, operators.halton_jitter())
    ]


class Networks(unittest.TestCase):
    def test_flat_pictures_stay_what_they_are(self):
        for network in networks():
            state = None
            for frame in flat_frames([0.25] * 4):
                output, state = network.step(frame, state)
                self.assertLess((output - 0.25).abs().max().item(), 1e-6, network.pipeline)

    def test_output_is_within_frame_and_history(self):
        for network in networks():
            state = None
            for frame in flat_frames([0.25, 0.75, 0.5]):
                output, state = network.step(frame, state)
                self.assertTrue(0.25 - 1e-6 < output.min() and output.max() < 0.75 + 1e-6, network.pipeline)

    def test_metadata_comes_back(self):
        for network in networks():
            self.assertEqual(history.options_of(history.metadata_of(network)), dict(checked=True, held=True))
        with self.assertRaisesRegex(SystemExit, "history is sometimes; known: plain, checked"):
            history.options_of({"history": "sometimes"})

    def test_nsrr_learns_from_clips_of_any_length(self):
        for checked in (False, True):
            network = nsrr.create(scale=2, previous_frames=2, width=4, checked=checked, held=checked)
            for length in (1, 2, 3):
                frames = flat_frames([0.25, 0.5, 0.75][:length])
                reference = torch.stack([frame.color.repeat_interleave(2, 2).repeat_interleave(2, 3) for frame in frames])
                value = nsrr.loss(network, frames, reference)
                self.assertTrue(torch.isfinite(value), (checked, length))

    def test_they_learn(self):
        for network in networks():
            frames = flat_frames([0.25, 0.5, 0.5, 0.75])
            reference = torch.stack([frame.color.repeat_interleave(2, 2).repeat_interleave(2, 3) for frame in frames])
            windows = list(losses.followed(network, frames, reference * 0.9, 3))
            self.assertEqual(len(windows), 2)
            sum(windows).backward()
            self.assertTrue(any(p.grad is not None and p.grad.abs().max() > 0 for p in network.parameters()))

    def test_hard_clips_count_as_much_as_easy_ones(self):
        fine = torch.zeros(1, 3, 8, 12)
        fine[..., ::2] = 1
        color = torch.cat((fine, 0.1 * fine, 0 * fine))
        frames = [Frame(color, color[:, :1], 0 * color[:, :2], (0.0, 0.0))]
        weight = losses.evenness(frames, torch.full((1, 3, 3, 16, 24), 0.0))
        error = torch.tensor([0.5, 0.05, 0.0])
        self.assertLess((weight - 0.04 / (error + 0.01)).abs().max().item(), 0.02)


if __name__ == "__main__":
    unittest.main()
