"""The networks against docs/pipelines.md and the papers: python3 -m unittest discover tests."""

import math
import os
import tempfile
import unittest

import torch

from clarus_training import (
    clarus,
    enss,
    frame,
    fsr2,
    golden,
    history,
    mnss,
    model_file,
    nsrr,
    nsrr_growth,
    nss,
    operators,
    srpo,
    stack,
    stack_training,
)
from clarus_training.frame import Frame


def count(network):
    return sum(parameter.numel() for parameter in network.parameters())


def frames(number, height=6, width=9, batch=2, still=False):
    result = []
    for t in range(number):
        motion = torch.randn(batch, 2, height, width) * (0 if still else 1)
        image = torch.rand(batch, 4, height, width)
        result.append(Frame(image[:, :3], image[:, 3:], motion, operators.halton_jitter()[t], (0.1 * t, -0.2)))
    return result


def networks(scale=2):
    """All of them, not as they start but with noise in their weights."""
    every = {
        "clarus": clarus.create(scale, 8, 1),
        "enss": enss.create(scale, 8, 1, 16),
        "nsrr": nsrr.create(scale=scale, previous_frames=2, width=4),
        "nsrr alone": nsrr.create(scale=scale, previous_frames=0, width=4, network_color="rgb"),
        "mnss": mnss.create(scale),
        "nss": nss.create(scale),
        "srpo": srpo.create(scale),
        **{size: stack_training.create(scale, size) for size in stack_training.SIZES},
    }
    for name in ("nsrr", "nsrr alone", "clarus"):
        for parameter in every[name].parameters():
            parameter.add_(0.05 * torch.randn_like(parameter))
    return every


def fsr2_alone(clip, scale):
    outputs, state = [], None
    for each in clip:
        state, _ = fsr2.step(each, state, scale)
        outputs.append(state[:, :3])
    return outputs


class Networks(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)
        torch.set_grad_enabled(False)

    def tearDown(self):
        torch.set_grad_enabled(True)

    def test_parameters(self):
        def layers(*widths, size=3):
            return sum(size * size * a * b + b for a, b in zip(widths, widths[1:]))

        self.assertEqual(count(srpo.create(2)), 8434)
        self.assertEqual(count(mnss.create(3)), layers(4, 1) + layers(6, 8, 3) + layers(3, 16, 32, 32, 3))
        # SRPO's table 1: 12.64K, 8.10K, 1.57K, 0.6K and 0.036K.
        for wanted, layers_and_widths in (
            (12637, stack.fsrcnn(2, 1)),
            (8096, stack.espcn(2, 1)),
            (1568, stack.edge_sr("tm", 2, 4, 7)),
            (600, stack.edge_sr("tr", 2, 2, 5)),
            (36, stack.edge_sr("max", 2, 1, 3)),
        ):
            network = stack.Stack(2, *layers_and_widths, "luma")
            slopes = sum(count(module) for module in network.modules() if isinstance(module, torch.nn.PReLU))
            self.assertEqual(count(network) - slopes, wanted)
        features, reweighting = layers(4, 32, 32, 8), layers(20, 32, 32, 4)
        for width in (32, 16):
            unet = layers(60, 2 * width, width) + layers(width, 2 * width, 2 * width)
            unet += layers(2 * width, 4 * width, 4 * width)
            unet += layers(6 * width, 2 * width, 2 * width) + layers(3 * width, width, 3)
            self.assertEqual(count(nsrr.create(scale=4, width=width)), 2 * features + reweighting + unet)
        self.assertEqual(count(nsrr.create(scale=4, previous_frames=0)), features + count(nsrr.UNet(12, 32)))

    def test_shapes_and_range(self):
        for scale in (2, 3):
            for name, network in networks(scale).items():
                for output in frame.run(network, frames(3)):
                    self.assertEqual(output.shape, (2, 3, 6 * scale, 9 * scale), name)
                    self.assertTrue(((output >= 0) & (output <= 1)).all(), name)

    def test_ahead_changes_nothing(self):
        clip = frames(4)
        for name, network in networks().items():
            state = None
            for t, output in enumerate(frame.run(network, clip)):
                alone, state = network.step(clip[t], state)
                self.assertLess((alone - output).abs().max().item(), 1e-5, name)

    def test_invalid_motion_everywhere_is_a_reset(self):
        first, second = frames(2)
        nowhere = second._replace(motion=torch.full_like(second.motion, float("nan")))
        half = second._replace(motion=torch.cat((nowhere.motion[:1], second.motion[1:])))
        for name, network in networks().items():
            _, state = network.step(first)
            reset, _ = network.step(second)
            continued, _ = network.step(second, state)
            self.assertLess((network.step(nowhere, state)[0] - reset).abs().max().item(), 1e-5, name)
            mixed, _ = network.step(half, state)
            self.assertLess((mixed[0] - reset[0]).abs().max().item(), 1e-5, name)
            self.assertLess((mixed[1] - continued[1]).abs().max().item(), 1e-5, name)
            if name not in ("srpo", "nsrr alone", *stack_training.SIZES):
                self.assertGreater((continued - reset).abs().max().item(), 1e-4, name)

    def test_clarus_starts_as_fsr2_and_its_history_never_sees_what_is_shown(self):
        clip, network = frames(4), clarus.create(2, 8, 1)
        noisy, state, states = networks()["clarus"], None, [None, None]
        for each in clip:
            state, trust = fsr2.step(each, state, 2)
            inside, outputs = {}, []
            for i, one in enumerate((network, noisy)):
                output, states[i] = one.step(each, states[i], inside=inside)
                outputs.append(output)
                self.assertTrue(torch.equal(states[i], state))
                self.assertTrue(torch.equal(inside["trust"], trust))
            self.assertTrue(torch.equal(outputs[0], history.hold(state[:, :3], each.color, state[:, :3], 2)))
            self.assertGreater((outputs[1] - outputs[0]).abs().max().item(), 1e-3)

    def test_clarus_learns_weights_of_differences_and_keeps_plain_ones(self):
        for scale in (2, 3):
            layer = clarus.create(scale, 4, 0).layers[0]
            plain = torch.randn(4, 6 + 4 * scale * scale, 3, 3)
            layer.set_plain(plain)
            self.assertLess((layer.plain - plain).abs().max().item(), 1e-5)
            # What all colours have in common reaches no feature but by their mean.
            torch.nn.init.normal_(layer.weight)
            layer.weight[:, -3:] = 0
            x = torch.rand(1, plain.shape[1], 5, 5)
            shifted = x.clone()
            shifted[:, :3] += 0.3
            shifted[:, 6 : 6 + 3 * scale * scale] += 0.3
            self.assertLess((layer(shifted) - layer(x))[..., 1:-1, 1:-1].abs().max().item(), 1e-4)

    def test_clarus_takes_at_every_scale_the_network_of_the_grid_that_reaches_it(self):
        trained = [clarus.create(grid, 4, middle) for grid, middle in ((3, 0), (2, 1), (4, 0))]
        for each in trained:
            each.layers[-1].weight.normal_(std=0.05)
        every = clarus.joined(trained)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "model.safetensors")
            model_file.save(path, every)
            loaded = model_file.load(path)
        clip = frames(3, height=8, width=12)
        for scale, grid in ((1, 2), (1.5, 2), (2, 2), (2.5, 3), (3, 3), (3.01, 3), (3.25, 4), (4, 4)):
            every.scale = loaded.scale = scale
            (own,) = (each for each in trained if each.scale == grid)
            self.assertEqual((every.grid, len(every.layers)), (grid, len(own.layers)))
            outputs = frame.run(every, clip)
            self.assertEqual(outputs[0].shape, (2, 3, round(8 * scale), round(12 * scale)))
            for ours, theirs in zip(outputs, frame.run(loaded, clip)):
                self.assertLess((ours - theirs).abs().max().item(), 1e-5, scale)
            if scale == grid:
                for ours, theirs in zip(outputs, frame.run(own, clip)):
                    self.assertTrue(torch.equal(ours, theirs), scale)
            # What is added changes what is shown, and a flat picture stays one.
            self.assertGreater((outputs[1] - fsr2_alone(clip, scale)[1]).abs().max().item(), 1e-3, scale)
            flat = [each._replace(color=torch.full_like(each.color, 0.25)) for each in clip]
            for output in frame.run(every, flat):
                self.assertLess((output - 0.25).abs().max().item(), 1e-5, scale)
        # A network that has learned on goes into a model file's in place of the one that was there.
        with torch.no_grad():
            trained[0].layers[-1].bias += 0.01
        replaced = clarus.joined([trained[0], loaded])
        for each in ("x2", "x3", "x4"):
            source = trained[0] if each == f"x{trained[0].grid}" else loaded
            self.assertTrue(torch.equal(getattr(replaced, each)[-1].bias, getattr(source, each)[-1].bias), each)
        for wrong in (trained[:2], [*trained, trained[0]]):
            with self.assertRaisesRegex(SystemExit, "--join: "):
                clarus.joined(wrong)

    def test_a_network_of_clarus_learns_of_scales_up_to_its_grid(self):
        self.assertEqual([clarus.serves(3, scale) for scale in (2, 2.5, 3, 4)], [False, True, True, False])

    def test_ablations(self):
        clip = frames(3)
        network = enss.create(2, 8, 1, 16)

        def outputs(clip, *without):
            network.without = without
            return torch.stack(frame.run(network, clip))

        still = [each._replace(motion=torch.zeros_like(each.motion)) for each in clip]
        for name in enss.ABLATIONS:
            self.assertGreater((outputs(clip, name) - outputs(clip)).abs().max().item(), 1e-3, name)
        self.assertTrue(torch.equal(outputs(clip, "warping"), outputs(still)))
        self.assertLess((outputs(still, "dilation") - outputs(still)).abs().max().item(), 1e-5)
        self.assertTrue(torch.equal(outputs(clip, "dilation", "warping"), outputs(still, "dilation")))
        network.without = ("blending",)
        inside = {}
        output, _ = network.step(clip[0], inside=inside)
        self.assertTrue(torch.equal(output, inside["candidate"].clamp(0, 1)))

        network = networks()["mnss"]
        alone = torch.stack([network.step(each)[0] for each in clip])
        self.assertTrue(torch.equal(outputs(clip, "history"), alone))
        _, (kept, _) = network.step(clip[0])
        network.without = ("recurrence",)
        self.assertTrue(torch.equal(network.step(clip[0])[1][0], operators.upsample(clip[0].color, 2, clip[0].jitter)))
        self.assertGreater((kept - network.step(clip[0])[1][0]).abs().max().item(), 1e-3)

        network = networks()["clarus"]
        for name in clarus.ABLATIONS[1:]:
            self.assertGreater((outputs(clip, name) - outputs(clip)).abs().max().item(), 1e-3, name)
        self.assertNotIsInstance(clarus.create(2, 4, 0, ["differences"]).layers[0], clarus.Conditioned)

        network = networks()["nsrr"]
        for name in nsrr.ABLATIONS:
            self.assertGreater((outputs(clip, name) - outputs(clip)).abs().max().item(), 1e-4, name)
        inside = {}
        network.without = nsrr.ABLATIONS
        network.step(clip[1], network.step(clip[0])[1], inside=inside)
        self.assertEqual((inside["features"].abs().max().item(), inside["weights"].std().item()), (0, 0))

    def test_a_file_holds_the_network(self):
        clip = frames(3)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "model.safetensors")
            for name, network in networks().items():
                model_file.save(path, network)
                loaded = model_file.load(path)
                for ours, theirs in zip(frame.run(network, clip), frame.run(loaded, clip)):
                    self.assertTrue(torch.equal(ours, theirs), name)

    def test_a_file_holds_a_stack_of_every_layer(self):
        clip = frames(1, height=4, width=6)
        cases = ("rgb", golden.EVERY_LAYER), ("luma", stack.fsrcnn(2, 1)), ("luma", stack.edge_sr("tr", 2, 2, 5))
        for color, layers in cases:
            network = stack.Stack(2, *layers, color)
            with tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, "model.safetensors")
                model_file.save(path, network)
                self.assertTrue(torch.equal(frame.run(network, clip)[0], frame.run(model_file.load(path), clip)[0]))

    def test_layers(self):
        x = torch.rand(1, 6, 2, 2)

        def result(*layers, widths={}):
            return stack.Stack(1, list(layers), widths).run_layers(x)

        a, b = x.chunk(2, dim=1)
        self.assertTrue(torch.equal(result({"type": "product"}), a * b))
        part = result({"type": "product", "channels": [1, 2]})
        self.assertTrue(torch.equal(part, torch.cat((x[:, :1], x[:, 1:2] * x[:, 2:3], x[:, 3:]), dim=1)))
        most = torch.cat([half.amax(dim=1, keepdim=True) for half in (a, b)], dim=1)
        self.assertTrue(torch.equal(result({"type": "maximum", "groups": 2}), most))
        self.assertTrue(torch.allclose(result({"type": "sum"}), x.sum(dim=1, keepdim=True)))
        softmax = result({"type": "softmax", "channels": [2, 4], "groups": 2})
        self.assertTrue(torch.equal(softmax[:, :2], x[:, :2]))
        self.assertTrue(torch.allclose(softmax[:, 2:4], x[:, 2:4].softmax(dim=1)))

    def test_tensor_names(self):
        names = {name.rsplit(".", 1)[0] for name in nsrr.create(scale=2).state_dict()}
        wanted = {f"{group}.{i}" for group in ("features_current", "features_previous", "reweight") for i in range(3)}
        wanted |= {f"unet.{part}.{i}" for part in ("enc1", "enc2", "bottleneck", "dec2", "dec1") for i in range(2)}
        self.assertEqual(names, wanted)
        names = {name.rsplit(".", 1)[0] for name in mnss.create(2).state_dict()}
        self.assertEqual(names, {"inpaint", "antialias.0", "antialias.1"} | {f"reconstruct.{i}" for i in range(4)})
        self.assertEqual(srpo.create(2).state_dict()["conv.2.weight"].shape, (2, 16, 5, 5))

    def test_nsrr_state_is_warped_once_a_frame(self):
        network = nsrr.create(scale=2, previous_frames=2, width=4)
        clip = frames(3)
        maps = [
            operators.zero_upsample(previous, 2, each.jitter)
            for each, ((_, previous), _) in zip(clip, network.ahead(clip))
        ]
        motions = [operators.upsample_motion(each.motion, 2, each.motion_jitter) for each in clip]
        state = None
        for each in clip:
            _, state = network.step(each, state)
        self.assertLess((state[0] - maps[2]).abs().max().item(), 1e-6)
        once = operators.warp(maps[1], motions[2], "zero", 0)
        self.assertLess((state[1] - once).abs().max().item(), 1e-5)

    def test_nsrr_starts_near_the_upsampled_colour(self):
        x, y = torch.meshgrid(torch.linspace(0, 1, 24), torch.linspace(0, 1, 16), indexing="xy")
        color = torch.stack((x, y, 1 - x)).expand(2, -1, -1, -1)
        for scale in (2, 4):
            for colors in ("rgb", "ycbcr"):
                network = nsrr.create(scale=scale, previous_frames=2, width=4, network_color=colors)
                frame = frames(1, 16, 24)[0]._replace(color=color)
                output, _ = network.step(frame)
                self.assertLess((output - operators.upsample(color, scale)).abs().mean().item(), 0.05)

    def test_a_grown_nsrr_computes_the_same(self):
        small = networks()["nsrr"]
        large = nsrr.create(scale=2, previous_frames=2, width=7)
        nsrr_growth.grow(large, small)
        state = other = None
        for frame in frames(3, 8, 12):
            output, state = small.step(frame, state)
            same, other = large.step(frame, other)
            self.assertGreater(output.std().item(), 1e-3)
            self.assertLess((same - output).abs().max().item(), 1e-5)
        # What is new is there to be learned with.
        self.assertGreater(large.unet.enc1[0].weight[4 * 2 :].abs().max().item(), 0)
        with self.assertRaises(SystemExit):
            nsrr_growth.grow(nsrr.create(scale=2, previous_frames=3, width=7), small)

    def test_nsrr_pads_by_replication(self):
        unet = nsrr.UNet(3, 4)
        image = torch.rand(1, 3, 6, 9)
        padded = torch.cat((image, image[..., -1:].expand(-1, -1, -1, 3)), dim=3)
        padded = torch.cat((padded, padded[..., -1:, :].expand(-1, -1, 2, -1)), dim=2)
        self.assertLess((unet(image) - unet(padded)[:, :, :6, :9]).abs().max().item(), 1e-6)

    def test_mnss_first_frame(self):
        network, (clip,) = mnss.create(2), frames(1)
        inside = {}
        output, (state, depth) = network.step(clip, inside=inside)
        self.assertTrue(torch.equal(inside["history"], operators.upsample(clip.color, 2, clip.jitter)))
        self.assertTrue(torch.equal(state, output))
        self.assertTrue(torch.equal(depth, operators.upsample(clip.depth, 2, clip.jitter)))

    def test_srpo(self):
        network = srpo.create(3)
        network.conv[-1].weight.mul_(300)
        (clip,) = frames(1)
        inside = {}
        output, _ = network.step(clip, inside=inside)
        raw, mask = inside["raw"], inside["mask"]
        moved = 0
        for n, y, x in ((0, 0, 0), (0, 7, 11), (1, 17, 26), (1, 9, 3), (0, 4, 20)):
            ox, oy = (math.floor(raw[n, c, y, x].item() + 0.5) for c in (0, 1))
            column, row = min(max(x // 3 + ox, 0), 8), min(max(y // 3 + oy, 0), 5)
            self.assertLess((inside["projected"][n, :, y, x] - clip.color[n, :, row, column]).abs().max().item(), 1e-5)
            weights = [math.exp(-d * d / 2) for d in range(-3, 4)]
            moving, total = 0, sum(weights) ** 2
            for dy in range(-3, 4):
                for dx in range(-3, 4):
                    if 0 <= y + dy < 18 and 0 <= x + dx < 27:
                        there = [math.floor(raw[n, c, y + dy, x + dx].item() + 0.5) for c in (0, 1)]
                        moving += weights[dy + 3] * weights[dx + 3] / total * (there != [0, 0])
            self.assertAlmostEqual(mask[n, 0, y, x].item(), moving, 5)
            moved += moving > 0
        self.assertGreater(moved, 0)
        flat = srpo.lanczos_upsample(torch.full((1, 3, 4, 4), 0.3), 3)
        self.assertLess((flat - 0.3).abs().max().item(), 1e-6)
        line = torch.zeros(1, 1, 1, 9)
        line[..., 4] = 1
        both = srpo.lanczos_upsample(line, 2)[0, 0, 0]

        def kernel(d):
            return math.prod(math.sin(math.pi * d / e) / (math.pi * d / e) for e in (1, 3))

        total = sum(kernel(0.25 + k) for k in range(-3, 3))
        self.assertAlmostEqual(both[8].item(), kernel(0.25) / total, 5)
        self.assertAlmostEqual(both[10].item(), kernel(0.75) / total, 5)


if __name__ == "__main__":
    unittest.main()
