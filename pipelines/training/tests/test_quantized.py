"""Whole numbers against exact arithmetic: python3 -m unittest discover tests."""

import argparse
import glob
import os
import tempfile
import unittest
from fractions import Fraction

import numpy as np
import torch

from clarus_training import export, golden, mnss, model_file, onnx, operators, quantized, safetensors, srpo, train
from clarus_training.frame import Frame, run

PIPELINES = os.path.join(os.path.dirname(__file__), "../..")
ENSS = f"{PIPELINES}/enss/weights/enss-s-x2-int8.safetensors"


def halves_up(value):
    return (2 * value + 1) // 2


class Numbers(unittest.TestCase):
    def test_values_are_rounded_to_even_and_clamped(self):
        nan, infinity = float("nan"), float("inf")
        values = torch.tensor([nan, infinity, -infinity, 0.25, 0.75, -0.25, 1e30, 0.5])
        self.assertEqual(quantized.numbers(values, 0.5, 100).tolist(), [0, 255, 0, 100, 102, 100, 255, 101])

    def test_numbers_survive_what_they_stand_for(self):
        for scale, zero_point in ((0.0123, 0), (3.3e-4, 255), (7.7, 31)):
            all_numbers = torch.arange(256).double()
            values = (all_numbers - zero_point) * quantized.single(scale)
            self.assertTrue(torch.equal(quantized.numbers(values, np.float32(scale), zero_point), all_numbers))

    def test_factors_are_multiplied_with_one_rounding(self):
        for factor in (0.2499999999, 0.1, 0.125, 3.7e-3, 1e-6, 2.4e-10, 1e-12, 0.0):
            multiplier, shift = (int(each) for each in quantized.requantization(factor))
            self.assertTrue(33 <= shift <= 62 and 0 <= multiplier < 2**31)
            error = abs(Fraction(multiplier, 2**shift) - Fraction(factor))
            self.assertLessEqual(error, max(Fraction(factor) / 2**30, Fraction(1, 2**63)))

    def test_a_layer_is_what_whole_numbers_make_of_it(self):
        rng = np.random.default_rng(1)
        layer = quantized.QuantizedConv2d(
            dict(
                weight=rng.integers(-127, 128, (3, 4, 1, 1)).astype(np.int8),
                weight_scale=np.array([0.001, 0.02, 0.003], np.float32),
                bias=rng.integers(-5000, 5000, 3).astype(np.int32),
                input_scale=np.array([0.02], np.float32),
                input_zero_point=np.array([40], np.int32),
            )
        )
        layer.hands_on = (np.float32(0.011), 9)
        image = torch.from_numpy(rng.uniform(-1, 5, (1, 4, 1, 50)))
        result = quantized.numbers(layer(image), *layer.hands_on)[0, :, 0]
        read = quantized.numbers(image, *layer.reads)[0, :, 0].long().tolist()
        multipliers, shifts = quantized.requantization(
            np.float64(layer.tensors["input_scale"][0]) * layer.tensors["weight_scale"] / np.float64(np.float32(0.011))
        )
        for o in range(3):
            for x in range(50):
                total = int(layer.tensors["bias"][o])
                for i in range(4):
                    total += (read[i][x] - 40) * int(layer.tensors["weight"][o, i, 0, 0])
                number = halves_up(Fraction(total * int(multipliers[o]), 2 ** int(shifts[o]))) + 9
                self.assertEqual(int(result[o, x]), min(max(number, 0), 255))


def arguments_for(start, **others):
    """Of a training of ENSS-S in whole numbers."""
    arguments = dict(pipeline="enss", size="s", scale=2, hidden=8, without=[], checked=False, held=True, int8=True)
    arguments.update(start=start, device="cpu", rate=None, seed=0, teacher=None, decay=0, ema=0.9, no_turns=False)
    return argparse.Namespace(**{**arguments, **others})


def changed(folder, change):
    """The path of ENSS-S in whole numbers with other tensors, which `change(tensors)` returns."""
    tensors, metadata = safetensors.load(ENSS)
    path = os.path.join(folder, "changed.safetensors")
    safetensors.save(path, change(tensors), metadata)
    return path


class Files(unittest.TestCase):
    def test_a_quantized_file_is_the_same_network(self):
        case = golden.CASES["stack"]["stack_int8_x2"]
        generator = torch.Generator().manual_seed(2)
        network = golden.random_stack(generator, **case)
        image = torch.rand((1, 3, 10, 14), generator=generator)
        frame = Frame(image, image[:, :1], image[:, :2], (0.0, 0.0), (0.0, 0.0))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "model.safetensors")
            model_file.save(path, network, half=True)
            loaded = model_file.load(path)
        self.assertTrue(torch.equal(network.step(frame)[0].double(), loaded.step(frame)[0].double()))

    def test_kernels_that_depend_on_the_jitter_are_layers_one_after_the_other(self):
        tensors, network = safetensors.load(ENSS)[0], model_file.load(ENSS)
        chain = ("first", "body.0", "last")
        for entry in (0, 5, 31):
            layers = []
            for name in chain:
                own = {key: tensors[f"{name}.{key}"] for key in quantized.TENSORS}
                if name != "body.0":
                    own.update({key: own[key][entry] for key in ("weight", "weight_scale", "bias")})
                layers.append(quantized.QuantizedConv2d(own))
            for layer, reader in zip(layers, layers[1:]):
                layer.hands_on = reader.reads
            x = torch.rand(1, 22, 7, 9, generator=torch.Generator().manual_seed(entry))
            with torch.no_grad():
                result = network.layers(x, {"entry": entry})
            self.assertTrue(torch.equal(result, layers[2](torch.relu(layers[1](torch.relu(layers[0](x)))))))

    def test_a_file_that_goes_on_learning_starts_with_the_same_bits_and_is_saved_as_it_was(self):
        training = train.Training(arguments_for(ENSS))
        tensors, metadata = safetensors.load(ENSS)
        with tempfile.TemporaryDirectory() as folder:
            training.save(os.path.join(folder, "checkpoint.pt"))
            network = export.load_checkpoint(os.path.join(folder, "checkpoint.pt"))
            model_file.save(os.path.join(folder, "model.safetensors"), network, operators.halton_jitter(2), half=True)
            saved, facts = safetensors.load(os.path.join(folder, "model.safetensors"))
        files = ({name: (each.dtype, each.tolist()) for name, each in file.items()} for file in (saved, tensors))
        self.assertEqual(*files)
        self.assertEqual(facts, metadata)
        jitters = network.kernels.jitters.tolist()[:3]
        frames = [onnx.smooth_frame(network, (24, 18))._replace(jitter=tuple(jitter)) for jitter in jitters]
        with torch.no_grad():
            for ours, loaded in zip(run(network, frames), run(model_file.load(ENSS), frames)):
                self.assertTrue(torch.equal(ours, loaded.float()))

    def test_a_jitter_has_its_own_set_of_kernels(self):
        whole = model_file.load(ENSS)
        for entry in (0, 7, 31):
            with tempfile.TemporaryDirectory() as folder:
                tables = [f"{name}.{key}" for name in ("first", "last") for key in ("weight", "weight_scale", "bias")]
                alone = model_file.load(changed(folder, lambda tensors: {
                    name: array[entry : entry + 1] if name in tables else array
                    for name, array in tensors.items() if name != "jitter"}))
            frame = onnx.smooth_frame(whole, (24, 18))._replace(jitter=tuple(whole.kernels.jitters[entry].tolist()))
            with torch.no_grad():
                self.assertTrue(torch.equal(whole.step(frame)[0], alone.step(frame)[0]))

    def test_layers_in_floating_point_may_be_among_those_in_whole_numbers(self):
        for kept in (("first", "last"), ("body.0",), ("last",)):
            with tempfile.TemporaryDirectory() as folder:
                def in_part(tensors):
                    floats = quantized.in_floats(tensors)[0]
                    others = {key: array for key, array in tensors.items() if not key.startswith(kept)}
                    return {**others, **{key: array for key, array in floats.items() if key.startswith(kept)}}
                path = changed(folder, in_part)
                network = model_file.load(path)
                learns = train.Training(arguments_for(path))
            frame = onnx.smooth_frame(network, (24, 18))
            with torch.no_grad():
                output = network.step(frame)[0]
                self.assertTrue(torch.equal(output, learns.network.step(frame)[0]))
                self.assertLess(float((output - model_file.load(ENSS).step(frame)[0]).abs().quantile(0.9)), 0.02)

    def test_every_shipped_file_runs(self):
        for path in glob.glob(f"{PIPELINES}/*/weights/*-int8.safetensors"):
            with self.subTest(os.path.basename(path)), torch.no_grad():
                network, plain = model_file.load(path), model_file.load(path.replace("-int8", ""))
                frame, states = onnx.smooth_frame(network, (24, 20)), [None, None]
                for _ in range(2):
                    (ours, states[0]), (theirs, states[1]) = (
                        each.step(frame, state) for each, state in zip((network, plain), states))
                self.assertLess(float((ours - theirs).abs().quantile(0.9)), 0.03)

    def test_a_network_that_is_not_the_files_is_refused_by_name(self):
        for others, message in (
            (dict(held=False), "its range is held, and unit is asked for"),
            (dict(size="m"), "its features is 16, and 32"),
            (dict(scale=3), "its scale is 2, and 3"),
            (dict(pipeline="mnss"), "its pipeline is enss, and mnss"),
        ):
            with self.assertRaisesRegex(SystemExit, message):
                train.Training(arguments_for(ENSS, **others))

    def test_kernels_of_a_table_learn_without_turns(self):
        self.assertFalse(train.Training(arguments_for(ENSS)).turns)

    def test_what_has_learned_is_saved_and_mixed(self):
        one, other = (train.Training(arguments_for(ENSS, seed=seed)) for seed in (0, 1))
        with torch.no_grad():
            for parameter in other.network.parameters():
                parameter.add_(0.02 * torch.randn(parameter.shape))
        export.mix(one.network, other.network, 0.5)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "model.safetensors")
            model_file.save(path, one.network, half=True)
            weights = [safetensors.load(file)[0]["first.weight"] for file in (path, ENSS)]
            self.assertFalse(np.array_equal(*weights))
            frame = onnx.smooth_frame(one.network, (24, 18))
            with torch.no_grad():
                self.assertTrue(torch.equal(one.network.step(frame)[0], model_file.load(path).step(frame)[0]))
        other.network.body[0].input_zero_point += 1
        with self.assertRaisesRegex(SystemExit, "body.0.input_zero_point"):
            export.mix(one.network, other.network, 0.5)

    def test_a_layer_that_is_not_computed_here_is_named(self):
        layers = quantized.layers_of(safetensors.load(f"{PIPELINES}/srpo/weights/srpo-x2-int8.safetensors")[0])
        with self.assertRaisesRegex(SystemExit, "conv.2: no convolution"):
            quantized.make_trained(srpo.create(2), layers)


def some_layer(seed, inputs, outputs, size=3, largest=1.0):
    """A layer that learns, for inputs from −1 to 5."""
    torch.manual_seed(seed)
    layer = torch.nn.Conv2d(inputs, outputs, size, padding=size // 2)
    with torch.no_grad():
        layer.weight.mul_(largest / layer.weight.abs().max())
    scales = layer.weight.detach().abs().amax(dim=(1, 2, 3)) / 120
    return quantized.TrainedConv2d(layer.weight, layer.bias, (6 / 255, 43), scales)


class Trained(unittest.TestCase):
    def test_a_layer_that_learns_has_the_bits_of_what_it_is_saved_as(self):
        image = 6 * torch.rand(2, 5, 7, 9, generator=torch.Generator().manual_seed(1)) - 1
        for inputs, hands_on in ((5, None), (5, (np.float32(0.013), 17)), (600, None), (600, (np.float32(2.5), 90))):
            layer = some_layer(2, inputs, 4)
            layer.hands_on = hands_on
            exact = quantized.QuantizedConv2d(layer.tensors())
            exact.hands_on = hands_on
            seen = image.repeat(1, inputs // 5, 1, 1)
            self.assertTrue(torch.equal(layer(seen), exact(seen).float()))

    def test_gradients_are_those_without_rounding_but_for_what_is_clamped(self):
        layer = some_layer(3, 4, 3)
        plain = torch.nn.Conv2d(4, 3, 3, padding=1)
        plain.load_state_dict({"weight": layer.weight.detach(), "bias": layer.bias.detach()})
        images = [(6 * torch.rand(1, 4, 6, 8, generator=torch.Generator().manual_seed(4)) - 1) for _ in range(2)]
        images[0][0, 0, 2, 3] = images[1][0, 0, 2, 3] = 40
        for image, network in zip(images, (layer, plain)):
            image.requires_grad_()
            (network(image) * torch.arange(3)[:, None, None]).sum().backward()
        self.assertEqual(images[0].grad[0, 0, 2, 3], 0)
        images[1].grad[0, 0, 2, 3] = 0
        torch.testing.assert_close(images[0].grad, images[1].grad, rtol=0.02, atol=0.02)
        torch.testing.assert_close(layer.bias.grad, plain.bias.grad, rtol=1e-5, atol=1e-5)
        unclamped = slice(1, None)  # input channels
        torch.testing.assert_close(layer.weight.grad[:, unclamped], plain.weight.grad[:, unclamped], rtol=0.02, atol=0.5)

    def test_layers_one_after_the_other_hand_numbers_on(self):
        network = mnss.create(scale=2)
        layers = {}
        for name, module in network.named_modules():
            if isinstance(module, torch.nn.Conv2d) and name != "inpaint":
                layers[name] = (0.01, 3), torch.full((module.out_channels,), 0.001)
        quantized.make_trained(network, layers)
        self.assertEqual(network.antialias[0].hands_on, network.antialias[1].reads)
        self.assertIsNone(network.antialias[1].hands_on)
        self.assertEqual(network.reconstruct[2].hands_on, network.reconstruct[3].reads)
        self.assertIsInstance(network.inpaint, torch.nn.Conv2d)


class Simulated(unittest.TestCase):
    def test_a_layer_is_the_same_but_for_rounding(self):
        rng = np.random.default_rng(4)
        weight, bias = rng.normal(size=(5, 4, 3, 3)).astype(np.float32), rng.normal(size=5).astype(np.float32)
        tensors = quantized.quantize(weight, bias, np.float32(0.02), 40)
        floats, layers = quantized.in_floats({f"body.0.{name}": array for name, array in tensors.items()})
        reads, weight_scale = layers["body.0"]
        simulated = quantized.SimulatedConv2d(floats["body.0.weight"], floats["body.0.bias"], reads, weight_scale)
        image = torch.from_numpy(rng.uniform(-1, 5, (1, 4, 9, 7)).astype(np.float32))
        exact = quantized.QuantizedConv2d(tensors)(image).float()
        torch.testing.assert_close(simulated(image), exact, rtol=1e-5, atol=1e-5)

    def test_shipped_networks_in_whole_numbers_do_much_what_those_in_floats_do(self):
        for name, layers in (("srpo/weights/srpo-x2", 3), ("mnss/weights/mnss-x2", 7), ("enss/weights/enss-s-x2", 1)):
            with self.subTest(name):
                network = model_file.load(f"{PIPELINES}/{name}-int8.safetensors", simulated=True)
                made = [module for module in network.modules() if isinstance(module, quantized.SimulatedConv2d)]
                self.assertEqual(len(made), layers)
                self.assertEqual(sorted(network.quantized), ["first", "last"] * ("enss" in name))
                frame = onnx.smooth_frame(network, (24, 18))
                with torch.no_grad():
                    plain = model_file.load(f"{PIPELINES}/{name}.safetensors")
                    outputs = [each.step(frame)[0] for each in (network, plain)]
                off = (outputs[0] - outputs[1]).abs()
                self.assertLess(float(off.quantile(0.9)), 0.02)
                self.assertGreater(float(off.max()), 0)
