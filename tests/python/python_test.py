#!/usr/bin/env python3
"""The package as it was installed, against the command: python_test.py CLARUS"""

import ast
import importlib.metadata
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import clarus
import numpy as np

TREE = pathlib.Path(__file__).resolve().parent.parent.parent
TOOL = sys.argv.pop(1)
DEVICE = os.environ.get("CLARUS_TEST_DEVICE") or "auto"
RENDER, OUTPUT = (48, 32), (96, 64)
MODEL = "enss-s-x2"

try:
    import OpenImageIO
except ImportError:
    OpenImageIO = None
try:
    import torch
except ImportError:
    torch = None


class OnlyDlpack:
    """An array of some other library."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def made_up(number, size=RENDER):
    width, height = size
    chance = np.random.default_rng(number)
    return (chance.random((height, width, 3), np.float32), chance.random((height, width), np.float32) * 20 + 1,
            np.zeros((height, width, 2), np.float32))


def upscaler(**options):
    return clarus.Upscaler(MODEL, RENDER, device=DEVICE, **options)


def upscaled(converted=lambda array: array, **options):
    """Two frames, the second with history."""
    with upscaler(**options) as made:
        for number in range(2):
            arrays = [converted(array) for array in made_up(number)]
            result = made.upscale(*arrays, jitter=clarus.halton_jitter(number, 16), reset=number == 0)
        return result


def with_gaps(array):
    """The same values in a part of a larger array."""
    larger = np.full((array.shape[0] + 3, array.shape[1] + 5, *array.shape[2:]), np.nan, array.dtype)
    part = larger[2:-1, 1:-4]
    part[...] = array
    return part


class Pictures(unittest.TestCase):
    @unittest.skipUnless(OpenImageIO, "python3-openimageio is missing, to read what the command has written")
    def test_bits_are_those_of_the_command(self):
        def read(file, type_=OpenImageIO.FLOAT):
            image = OpenImageIO.ImageBuf(str(file))
            self.assertFalse(image.has_error, file)
            return np.ascontiguousarray(image.get_pixels(type_))

        with tempfile.TemporaryDirectory() as folder:
            sequence, output = pathlib.Path(folder, "sequence"), pathlib.Path(folder, "output")
            for command in (
                ["render", "--size", "%dx%d" % RENDER, "--frames", "3", "--no-reference", "--output", sequence],
                ["upscale", sequence, "--model", MODEL, "--device", DEVICE, "--format", "exr", "--output", output],
            ):
                subprocess.run([TOOL, *map(str, command)], check=True, stdout=subprocess.DEVNULL)
            frames = json.loads((sequence / "sequence.json").read_text())["frames"]
            self.assertEqual(len(frames), 3)
            usual = upscaler(motion_sampled_at_jitter=True)
            of_bytes = upscaler(motion_sampled_at_jitter=True, color_format=("uint8", 3))
            to_bytes = upscaler(motion_sampled_at_jitter=True, output_format=("uint8", 3))
            for number, frame in enumerate(frames):
                depth, motion = read(sequence / frame["depth"]), read(sequence / frame["motion"])[..., :2]
                told = {"jitter": tuple(frame["jitter"]), "reset": frame.get("reset", False)}
                expected = read(output / ("%04d.exr" % number))
                color = read(sequence / frame["color"])
                np.testing.assert_array_equal(usual.upscale(color, depth, motion, **told), expected)
                bytes_ = read(sequence / frame["color"], OpenImageIO.UINT8)
                self.assertEqual(bytes_.dtype, np.uint8)
                # A byte over 255 is rounded otherwise on the device than where files are read.
                np.testing.assert_allclose(of_bytes.upscale(bytes_, depth, motion, **told), expected, rtol=0, atol=2e-6)
                in_bytes = to_bytes.upscale(color, depth, motion, **told)
                self.assertEqual(in_bytes.dtype, np.uint8)
                np.testing.assert_array_equal(in_bytes, np.floor(np.clip(expected, 0, 1) * np.float32(255) + 0.5))

    @unittest.skipUnless(torch and OpenImageIO, "python3-torch or python3-openimageio is missing")
    def test_training_compares_the_library_with_its_twin(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([TOOL, "render", "--size", "%dx%d" % RENDER, "--frames", "3", "--output", folder], check=True,
                           stdout=subprocess.DEVNULL)
            told = subprocess.run(
                [sys.executable, "-m", "clarus_training.validation", TREE / "pipelines/enss/weights" / f"{MODEL}.safetensors",
                 folder, "--library", "--device", DEVICE], cwd=TREE / "pipelines/training", text=True, capture_output=True)
            self.assertEqual(told.returncode, 0, told.stderr)
            self.assertLess(float(re.search(r"differ from PyTorch's by (\S+) at most", told.stdout)[1]), 1e-4)

    def test_arrays_of_other_libraries(self):
        expected = upscaled()
        self.assertEqual(expected.shape, (OUTPUT[1], OUTPUT[0], 3))
        self.assertEqual(expected.dtype, np.float32)
        kinds = {"dlpack": OnlyDlpack, "buffer": memoryview, "gaps": with_gaps, "columns first": np.asfortranarray}
        if torch:
            kinds["torch"] = torch.from_numpy
        for name, converted in kinds.items():
            with self.subTest(name):
                np.testing.assert_array_equal(upscaled(converted), expected)

    def test_input_may_be_read_only(self):
        def locked(array):
            array.flags.writeable = False
            return array

        np.testing.assert_array_equal(upscaled(locked), upscaled())

    def test_half_and_alpha(self):
        result = upscaled(output_format=("float16", 4))
        self.assertEqual((result.shape, result.dtype), ((OUTPUT[1], OUTPUT[0], 4), np.float16))
        np.testing.assert_array_equal(result[..., 3], 1)
        np.testing.assert_allclose(result[..., :3], upscaled(), atol=1e-3)

    def test_alpha_is_carried_through(self):
        color = np.concatenate((made_up(0)[0], np.full((RENDER[1], RENDER[0], 1), 0.25, np.float32)), axis=2)
        with clarus.Upscaler("bicubic", RENDER, device=DEVICE, alpha=True, color_format=("float32", 4),
                             output_format=("float32", 4)) as made:
            result = made.upscale(color)
        np.testing.assert_allclose(result[..., 3], 0.25, atol=1e-6)
        with self.assertRaisesRegex(clarus.InvalidArgumentError, "alpha: color_format has 3 channels"):
            clarus.Upscaler("bicubic", RENDER, device=DEVICE, alpha=True)

    def test_output_is_written_where_it_is_told(self):
        larger = np.full((OUTPUT[1] + 2, OUTPUT[0] + 4, 3), -1, np.float32)
        part = larger[1:-1, 2:-2]
        frame = made_up(0)
        with upscaler() as made:
            self.assertIs(made.upscale(*frame, out=part), part)
            np.testing.assert_array_equal(part, made.upscale(*frame, reset=True))
        part[...] = -1
        self.assertTrue((larger == -1).all())

    def test_reset_and_history(self):
        with upscaler() as made:
            first = made.upscale(*made_up(0))
            second = made.upscale(*made_up(0))
            self.assertFalse(np.array_equal(first, second))
            np.testing.assert_array_equal(made.upscale(*made_up(0), reset=True), first)
            made.reset()
            np.testing.assert_array_equal(made.upscale(*made_up(0)), first)

    def test_a_frame_may_be_smaller(self):
        with upscaler(dynamic_resolution=True) as made:
            small = made.upscale(*made_up(0, (40, 24)), render_size=(40, 24))
        self.assertEqual(small.shape, (48, 80, 3))

    def test_masks(self):
        everywhere = np.ones((RENDER[1], RENDER[0]), np.float32)
        with upscaler(reactive_mask_format=("float32", 1), transparency_mask_format=("uint8", 1)) as made:
            def second(**masks):
                made.upscale(*made_up(0), reset=True)
                return made.upscale(*made_up(1), **masks)

            plain, reactive = second(), second(reactive_mask=everywhere)
            np.testing.assert_array_equal(second(reactive_mask=0 * everywhere), plain)
            self.assertFalse(np.array_equal(reactive, plain))
            transparent = second(transparency_mask=np.full((RENDER[1], RENDER[0]), 255, np.uint8))
            np.testing.assert_array_equal(transparent, reactive)
        with upscaler() as made, self.assertRaisesRegex(clarus.InvalidArgumentError, "reactive_mask_format"):
            made.upscale(*made_up(0), reactive_mask=everywhere)

    def test_a_view(self):
        with upscaler() as made:
            name = made.view_names[0]
        with upscaler(views=[name]) as made:
            made.upscale(*made_up(0))
            seen = made.view(name)
        self.assertEqual((seen.ndim, seen.dtype), (3, np.float32))
        self.assertTrue(np.isfinite(seen).all())


class Threads(unittest.TestCase):
    def test_others_run_while_a_frame_does(self):
        size = (960, 540)
        with clarus.Upscaler("enss-m-x2", size, device=DEVICE) as made:
            frame = made_up(0, size)
            made.upscale(*frame)
            stamps, stop = [], threading.Event()

            def count():
                while not stop.is_set():
                    stamps.append(time.perf_counter())
                    time.sleep(0.0005)

            counter = threading.Thread(target=count)
            counter.start()
            begin = time.perf_counter()
            made.upscale(*frame)
            end = time.perf_counter()
            stop.set()
            counter.join()
        # Around its ends, the thread could run even if the frame kept Python's lock.
        quarter = (end - begin) / 4
        self.assertTrue(any(begin + quarter < stamp < end - quarter for stamp in stamps), (begin, end, stamps))

    def test_frames_of_several_threads_take_turns(self):
        frame = made_up(0)
        with upscaler() as made:
            expected = made.upscale(*frame)
            results = [None] * 8

            def run(place):
                results[place] = made.upscale(*frame, reset=True)

            threads = [threading.Thread(target=run, args=(place,)) for place in range(len(results))]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        for result in results:
            np.testing.assert_array_equal(result, expected)


class WhatElseFramesBring(unittest.TestCase):
    def test_user_interface_and_exposure(self):
        color = made_up(0)[0]
        with clarus.Upscaler("bicubic", RENDER, device=DEVICE, ui_format=("float32", 4)) as made:
            ui = np.zeros((OUTPUT[1], OUTPUT[0], 4), np.float32)
            ui[:8, :8] = 1  # opaque white
            shown = made.upscale(color, ui=ui)
            np.testing.assert_array_equal(shown[:8, :8], 1)
            np.testing.assert_array_equal(shown[8:], made.upscale(color)[8:])
        with clarus.Upscaler("bicubic", RENDER, device=DEVICE, color_space="linear",
                             exposure_image_format=("float32", 1)) as made:
            bright = color * 9
            by_image = made.upscale(bright, exposure_image=np.full((1, 1), 0.25, np.float32))
        with clarus.Upscaler("bicubic", RENDER, device=DEVICE, color_space="linear") as made:
            np.testing.assert_array_equal(by_image, made.upscale(bright, exposure=0.25))
        with upscaler(opaque_color_format=("float32", 3)) as made:
            color, depth, motion = made_up(0)
            made.upscale(color, depth, motion, opaque_color=color)
            with self.assertRaisesRegex(clarus.InvalidArgumentError, "opaque_color: none"):
                made.upscale(color, depth, motion)
        with upscaler() as made:
            with self.assertRaisesRegex(clarus.InvalidArgumentError, "ui: this Upscaler was made for none"):
                made.upscale(*made_up(0), ui=color)

    def test_what_is_reported_is_logged(self):
        with self.assertLogs("clarus", "WARNING") as messages:
            with upscaler() as made:
                made.upscale(*made_up(0), jitter=(0.3, 0.1))  # which the model has no kernels for
        self.assertIn("jitter", messages.output[0])

    def test_a_wrong_sign_is_logged(self):
        rng = np.random.default_rng(3)
        wide = np.kron(rng.random((40, 60, 3)), np.ones((2, 2, 1))).astype(np.float32)
        depth = np.full((32, 48), 0.5, np.float32)
        with self.assertLogs("clarus", "WARNING") as messages, upscaler(diagnose=True) as made:
            for frame in range(9):  # the picture goes two pixels to the left a frame
                color = wide[:32, 2 * frame:2 * frame + 48]
                motion = np.zeros((32, 48, 2), np.float32)
                motion[..., 0] = -2  # right would be 2, to the place before
                made.upscale(color, depth, motion, jitter=clarus.halton_jitter(frame, 16), reset=frame == 0)
        self.assertIn("motion", " ".join(messages.output))


class Errors(unittest.TestCase):
    def refused(self, pattern, kind=clarus.InvalidArgumentError):
        return self.assertRaisesRegex(kind, pattern)

    def test_kinds(self):
        for kind in (clarus.InvalidArgumentError, clarus.FileError, clarus.NoDeviceError, clarus.BuildError,
                     clarus.OutOfMemoryError, clarus.DeviceError):
            self.assertTrue(issubclass(kind, clarus.Error) and issubclass(kind, RuntimeError), kind)
            self.assertEqual(kind.__module__, "clarus")
        self.assertTrue(issubclass(clarus.InvalidArgumentError, ValueError))
        self.assertTrue(issubclass(clarus.OutOfMemoryError, MemoryError))
        with self.refused("no-such-model", clarus.FileError):
            clarus.Upscaler("no-such-model.safetensors", RENDER, device=DEVICE)
        with self.refused("no such device", clarus.NoDeviceError):
            clarus.Device("no such device")

    def test_settings(self):
        for pattern, options in {
            'precision: "fp8"; there are fp32, fp16, bf16, automatic': {"precision": "fp8"},
            'depth_format: there is no element type "int32"': {"depth_format": ("int32", 1)},
            "color_format: 2 channels": {"color_format": ("float32", 2)},
            "sharpen": {"sharpen": 7.0},
            "nothing": {"views": ["nothing"]},
            "nonsense": {"pipeline_options": {"nonsense": 1.0}},
        }.items():
            with self.subTest(pattern), self.refused(pattern):
                upscaler(**options)
        with self.refused("scale: 3, but enss-s-x2 upscales by 2"):
            upscaler(scale=3)
        with self.refused("scale: 3, but enss-s-x2 upscales by 2"):
            clarus.Model(MODEL, 3)
        with self.refused("scale: a Model has one"):
            clarus.Upscaler(clarus.Model("bicubic", 3), RENDER, device=DEVICE, scale=2)
        with self.assertRaises(TypeError):
            upscaler(nonsense=1)

    def test_arrays(self):
        color, depth, motion = made_up(0)
        locked = np.zeros((OUTPUT[1], OUTPUT[0], 3), np.float32)
        locked.flags.writeable = False
        with upscaler() as made:
            for pattern, arguments, more in (
                (r"color: shape \(48, 32, 3\), expected \(32, 48, 3\)", (color.transpose(1, 0, 2), depth, motion), {}),
                (r"color: shape \(32, 48, 4\)", (np.zeros((32, 48, 4), np.float32), depth, motion), {}),
                ("color: float64, but .* float32; its color_format", (color.astype(float), depth, motion), {}),
                ("color: uint8", ((color * 255).astype(np.uint8), depth, motion), {}),
                ("color: None", (None, depth, motion), {}),
                ("color: neither an array", ("a word", depth, motion), {}),
                ("color: neither an array", ([[1.0]], depth, motion), {}),
                (r"depth: shape \(31, 48\), expected \(32, 48, 1\)", (color, depth[:-1], motion), {}),
                ("depth: None, but the model needs it", (color, None, motion), {}),
                ("motion: None", (color, depth), {}),
                ("motion: float16", (color, depth, motion.astype(np.float16)), {}),
                (r"out: shape \(32, 48, 3\), expected \(64, 96, 3\)", (color, depth, motion), {"out": color}),
                ("out: not an array that can be written", (color, depth, motion), {"out": locked}),
                ("out: .*contiguous", (color, depth, motion), {"out": locked.copy(order="F")}),
                ("out: float64, .*output_format", (color, depth, motion), {"out": locked.astype(float)}),
                ("jitter", (color, depth, motion), {"jitter": (2, 0)}),
                ("render_size|dynamic_resolution", (color[:16], depth[:16], motion[:16]), {"render_size": (48, 16)}),
            ):
                with self.subTest(pattern), self.refused(pattern):
                    made.upscale(*arguments, **more)
            made.upscale(color, depth, motion)  # none of it has done harm

    def test_closed(self):
        made = upscaler()
        made.close()
        made.close()
        with self.refused("closed"):
            made.upscale(*made_up(0))


class Inquiry(unittest.TestCase):
    def test_upscaler(self):
        with upscaler() as made:
            made.prepare()
            self.assertEqual((made.render_size, made.output_size), (RENDER, OUTPUT))
            self.assertTrue(made.needs_depth and made.needs_motion)
            self.assertGreater(made.device_memory, RENDER[0] * RENDER[1])
            self.assertEqual(repr(made), "<clarus.Upscaler enss-s-x2: 48x32 to 96x64>")
            made.upscale(*made_up(0), jitter=(0.3, 0.1))
            self.assertGreater(made.largest_jitter_distance, 0.01)
        with clarus.Upscaler(clarus.Model("bicubic", 1.5), RENDER, device=clarus.Device(DEVICE)) as made:
            self.assertEqual(made.output_size, (72, 48))
            self.assertFalse(made.needs_depth or made.needs_motion)
            self.assertEqual(made.upscale(made_up(0)[0]).shape, (48, 72, 3))

    def test_devices(self):
        there = clarus.devices()
        self.assertTrue(there)
        for profile in clarus.Device(DEVICE).profiles:
            self.assertIn(profile.selector, [other.selector for other in there])
            self.assertIn(profile.device_class, ("gpu", "cpu", "dsp"))
            self.assertGreater(profile.global_memory, 0)

    def test_models(self):
        self.assertTrue({MODEL, "bicubic"} <= set(clarus.models()))
        model = clarus.Model(MODEL)
        self.assertEqual((model.name, model.pipeline, model.scale, model.scales), (MODEL, "enss", 2, (2, 2)))
        self.assertTrue(model.metadata)
        self.assertEqual(clarus.Model("bicubic", 3).scales, (1, math.inf))
        for option in clarus.Model("fsr2").options:
            self.assertLessEqual(option.smallest, option.usual)

    def test_jitter(self):
        self.assertEqual(clarus.halton_jitter(0, 16)[0], 0)
        self.assertAlmostEqual(clarus.halton_jitter(0, 16)[1], -1 / 6, 6)
        self.assertEqual(clarus.halton_jitter(5, 4), clarus.halton_jitter(1, 4))
        self.assertEqual({clarus.mnss_jitter(frame, 2) for frame in range(12)},
                         {(x, y) for x in (-0.25, 0.25) for y in (-0.25, 0.25)})
        self.assertEqual(clarus.random_jitter(7, 2), clarus.random_jitter(7, 2))
        for call in (lambda: clarus.halton_jitter(0, 0), lambda: clarus.halton_jitter(-1, 4),
                     lambda: clarus.mnss_jitter(0, 5), lambda: clarus.random_jitter(0, 0)):
            with self.assertRaises(clarus.InvalidArgumentError):
                call()


    def test_quality_modes(self):
        modes = clarus.quality_modes()
        scales = [clarus.quality_scale(mode) for mode in modes]
        self.assertEqual(scales, sorted(scales))
        self.assertEqual(clarus.quality_render_size((1920, 1080), 1.5), (1280, 720))
        self.assertEqual((clarus.jitter_count(2), clarus.mip_bias(2)), (32, -1))
        with self.assertRaisesRegex(clarus.InvalidArgumentError, "performance"):
            clarus.quality_scale("best")

    def test_metrics(self):
        image = made_up(0)[0]
        self.assertEqual((clarus.psnr(image, image), clarus.ssim(image, image)), (100, 1))
        other = np.clip(image + np.float32(0.1), 0, 2)
        self.assertAlmostEqual(clarus.psnr(other, image), 20, 3)
        self.assertLess(clarus.ssim(other, image), 1)
        bytes_of = [np.round(255 * each).astype(np.uint8) for each in (image, np.clip(other, 0, 1))]
        self.assertAlmostEqual(clarus.psnr(*bytes_of), clarus.psnr(*(each.astype(np.float32) / 255 for each in bytes_of)), 4)
        self.assertEqual(clarus.psnr(image[::2, ::-1], image[::2, ::-1].copy()), 100)
        for pattern, arrays in {r"image: shape \(32, 48, 2\)": (image[..., :2], image), "reference: must be": (image, image[0]),
                                "reference: must be rows x columns x 3, and not empty": (image, image[:0]),
                                "image: float64; there are float32": (image.astype(np.float64), image),
                                "image: neither": ("image.png", image), "48": (image, image[:-1])}.items():
            with self.subTest(pattern), self.assertRaisesRegex(clarus.InvalidArgumentError, pattern):
                clarus.psnr(*arrays)
        with self.assertRaisesRegex(clarus.InvalidArgumentError, "11x11"):
            clarus.ssim(image[:5], image[:5])

    def test_check(self):
        rng = np.random.default_rng(3)
        wide = np.kron(rng.random((80, 160, 3)), np.ones((2, 2, 1))).astype(np.float32)
        colors, motions = [], []
        for frame in range(8):  # the picture goes two pixels to the left and one up, and a part of it otherwise
            colors.append(wide[frame:frame + 96, 2 * frame:2 * frame + 160])
            motion = np.empty((96, 160, 2), np.float16)
            motion[...] = (2, 1)
            motions.append(motion)

        def wrong(colors=colors, motions=motions, **options):
            return [finding.field for finding in clarus.check(colors, None, motions, **options) if finding.verdict == "wrong"]

        self.assertEqual(wrong(), [])
        self.assertEqual(wrong(motion_scale=(-1, -1)), ["motion.direction"])
        self.assertEqual(wrong(motion_scale=(1, -1)), ["motion.y"])
        self.assertEqual(wrong([np.round(255 * color).astype(np.uint8) for color in colors], color_space="linear"), ["color_space"])
        findings = {finding.field: finding for finding in clarus.check(colors, motion=motions, motion_scale=(-1, -1))}
        found = findings["motion.direction"]
        self.assertEqual((found.declared, found.best, found.count), ("to_previous", "from_previous", 7))
        self.assertGreater(found.gain, 0.6)
        self.assertRegex(repr(found), "motion.direction: to_previous, from_previous fits best, .* dB: wrong")
        for pattern, arguments in {"color: no frames": ([],), r"color\[1\]: None": ([colors[0], None],),
                                   "motion: 1 of them, but 2 frames": (colors[:2], None, motions[:1]),
                                   r"motion\[0\]: .*shape": (colors[:2], None, colors[:2]),
                                   r"depth\[0\]: 5 columns": (colors[:1], [np.ones((4, 5), np.float32)])}.items():
            with self.subTest(pattern), self.assertRaisesRegex(clarus.InvalidArgumentError, pattern):
                clarus.check(*arguments)
        for pattern, options in {"color_space: .*linear": {"color_space": "rec709"},
                                 r"jitter\[1\]: ": {"jitter": [(0, 0)] + 7 * [(0, 1.5)]},
                                 "near_plane 0, far_plane 0": {"depth": colors, "depth_projective": True}}.items():
            with self.subTest(pattern), self.assertRaisesRegex(clarus.InvalidArgumentError, pattern):
                clarus.check(colors, **options)

    @unittest.skipUnless(OpenImageIO, "python3-openimageio is missing, to read what was saved")
    def test_pictures(self):
        color = made_up(0)[0]
        color[0, 0] = (2, -1, np.nan)
        for array, channels in ((color, 3), (color[..., 0], 1), (color[..., :1], 1), (np.zeros((3, 5, 4), np.float16), 4)):
            with tempfile.TemporaryDirectory() as folder:
                picture = clarus.Picture(array)
                picture.save(folder + "/saved.png")
                read = OpenImageIO.ImageBuf(folder + "/saved.png")
                pixels = read.get_pixels(OpenImageIO.UINT8)
            self.assertEqual(pixels.shape, (*array.shape[:2], channels))
            expected = np.floor(np.clip(np.nan_to_num(array.astype(np.float32)), 0, 1) * np.float32(255) + np.float32(0.5))
            np.testing.assert_array_equal(pixels.reshape(expected.shape), expected)
            self.assertTrue(picture._repr_png_().startswith(b"\x89PNG"))
        for wrong in (np.zeros((2, 2, 2)), np.zeros((2, 2), int), np.zeros((0, 2)), np.zeros(3)):
            with self.assertRaises(clarus.InvalidArgumentError):
                clarus.Picture(wrong)


class Package(unittest.TestCase):
    folder = pathlib.Path(clarus.__file__).parent

    def test_version(self):
        header = (TREE / "host/include/clarus/version.h").read_text()
        version = re.search(r'CLARUS_VERSION_STRING "(.*)"', header)[1]
        self.assertEqual((clarus.__version__, importlib.metadata.version("clarus")), (version, version))

    def test_it_stands_alone(self):
        self.assertNotIn(TREE / "bindings", self.folder.parents)
        needed = subprocess.run(["ldd", *self.folder.glob("_clarus*.so")], stdout=subprocess.PIPE, text=True).stdout
        self.assertIn("libOpenCL", needed)
        self.assertNotRegex(needed, "libclarus|OpenImageIO|not found")
        for file in importlib.metadata.files("clarus"):
            self.assertRegex(str(file), r"^clarus(-[^/]*\.dist-info)?/")
        self.assertTrue((self.folder / "models" / f"{MODEL}.safetensors").is_file())

    def test_types(self):
        self.assertTrue((self.folder / "py.typed").is_file())
        stub = ast.parse((self.folder / "_clarus.pyi").read_text())
        named = {name for node in stub.body
                 for name in ([node.name] if hasattr(node, "name") else [node.target.id] if isinstance(node, ast.AnnAssign)
                              else [target.id for target in node.targets] if isinstance(node, ast.Assign) else [])}
        public = {name for name in vars(clarus._clarus) if not name.startswith("_")}
        self.assertEqual(public, named)
        self.assertEqual(public - {"version"} | {"__version__", "Picture"}, set(clarus.__all__))

    def test_documents_name_everything(self):
        text = (TREE / "docs/python.md").read_text()
        for name in clarus.__all__:
            self.assertIn(f"`{name}", text)
        for name in vars(clarus.Upscaler):
            if not name.startswith("_"):
                self.assertRegex(text, rf"`{name}[`(]")


if __name__ == "__main__":
    unittest.main()
