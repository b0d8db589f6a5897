"""Data, the loop and evaluation, on tiny synthetic sequences: python3 -m unittest discover tests."""

import contextlib
import csv
import io
import json
import os
import random
import signal
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
import OpenImageIO as oiio
import torch

import make_data
from clarus_training import (
    dataset,
    distil,
    enss,
    evaluate,
    export,
    frame,
    fsr2,
    manifest,
    mnss,
    model_file,
    nss,
    operators,
    quantized,
    safetensors,
    sequence,
    train,
    validation,
)


def write(path, pixels):
    kind = "float" if path.endswith(".exr") else "uint8"
    output = oiio.ImageOutput.create(path)
    output.open(path, oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind))
    output.write_image(pixels)
    output.close()


def scene(x, y):
    """Smooth colour anywhere in the plane."""
    waves = [np.sin(a * x + b * y + c) for a, b, c in ((0.9, 0.3, 0), (-0.4, 1.1, 1), (0.5, 0.7, 2))]
    return np.stack([0.5 + 0.4 * wave for wave in waves], axis=-1)


def write_sequence(folder, count=6, size=(24, 16), scale=2, period=4, color_space="srgb", resets=(), speed=(1.0, 0.5)):
    """A plane that moves by `speed` render pixels a frame, sampled with Halton jitter."""
    width, height = size
    os.makedirs(folder)
    frames = []
    for t in range(count):
        jitter = operators.halton_jitter(period)[t % period]

        def at(s, offset):
            x = (np.arange(s * width) + 0.5) / s + offset[0] - speed[0] * t
            y = (np.arange(s * height) + 0.5) / s + offset[1] - speed[1] * t
            pixels = scene(*np.meshgrid(x, y))
            return (255 * pixels).round().astype(np.uint8) if color_space == "srgb" else pixels.astype(np.float32)

        kind = "png" if color_space == "srgb" else "exr"
        kinds = {"color": kind, "depth": "exr", "motion": "exr", "reference": kind}
        names = {name: f"{name}{t}.{end}" for name, end in kinds.items()}
        write(os.path.join(folder, names["color"]), at(1, jitter))
        write(os.path.join(folder, names["reference"]), at(scale, (0, 0)))
        write(os.path.join(folder, names["depth"]), np.full((height, width, 1), 0.5, np.float32))
        vectors = np.tile(np.float32([-speed[0], -speed[1]]), (height, width, 1))
        write(os.path.join(folder, names["motion"]), np.concatenate((vectors, vectors[..., :1]), axis=2))
        frames.append({**names, "jitter": jitter, "reset": t in resets})
    facts = {"version": 1, "render_size": size, "scale": scale, "color_space": color_space, "frames": frames}
    with open(os.path.join(folder, "sequence.json"), "w") as file:
        json.dump(facts, file)


def run(module, *words):
    with mock.patch.object(sys, "argv", ["program", *map(str, words)]), contextlib.redirect_stdout(io.StringIO()):
        module.main()


class WithData(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)
        self.threads = torch.get_num_threads()
        torch.set_num_threads(1)
        self.folder = tempfile.TemporaryDirectory()
        self.path = self.folder.name
        write_sequence(os.path.join(self.path, "data", "a"))

    def tearDown(self):
        torch.set_num_threads(self.threads)
        self.folder.cleanup()

    def at(self, *names):
        return os.path.join(self.path, *names)


class Data(WithData):
    def test_batches_agree_in_jitter_and_reset_by_invalid_motion(self):
        write_sequence(self.at("data", "b"), size=(32, 24), resets=(0, 3))
        write_sequence(self.at("data", "c"), period=7)
        write_sequence(self.at("data", "d"), color_space="linear")
        found = {os.path.basename(s.directory): s for s in sequence.find([self.path])}
        clips = dataset.Clips(list(found.values()), 3, 16, turn=False, tint=False)
        chance, seen = random.Random(0), set()
        for _ in range(60):
            frames, reference = clips.batch(2, chance)
            self.assertEqual(reference.shape, (3, 2, 3, 32, 32))
            jitters = [frame.jitter for frame in frames]
            self.assertTrue(any(jitters == s.jitter[t : t + 3] for s in found.values() for t in range(4)))
            for frame in frames:
                self.assertEqual(frame.color.shape, (2, 3, 16, 16))
                self.assertTrue(0 <= frame.color.min() and frame.color.max() <= 1)
                gone = torch.isnan(frame.motion).flatten(1)
                self.assertTrue((gone.all(dim=1) == gone.any(dim=1)).all())
                seen.add(gone.any().item())
        self.assertEqual(seen, {False, True})

    def test_turned_data_is_as_consistent_as_it_was(self):
        clips = dataset.Clips(sequence.find([self.path]), 4, 16, turn=True, tint=False)
        chance, kinds = random.Random(1), set()
        for _ in range(24):
            frames, reference = clips.batch(1, chance)
            kinds.add(tuple(frames[1].motion[0, :, 8, 8].tolist()))
            for t, frame in enumerate(frames):
                # The smooth scene resampled at the jittered places is the reference there.
                resampled = operators.keys_upsample(frame.color, 2, frame.jitter)
                self.assertLess((resampled - reference[t])[..., 6:-6, 6:-6].abs().max().item(), 0.03)
                if t:
                    motion = operators.dilate(frame.motion, frame.depth, 2)
                    warped = operators.warp(reference[t - 1], motion, "clamp", 0)
                    self.assertLess((warped - reference[t])[..., 6:-6, 6:-6].abs().max().item(), 0.03)
        self.assertEqual(kinds, {(x, y) for a, b in ((1.0, 0.5), (0.5, 1.0)) for x in (a, -a) for y in (b, -b)})

    def test_tints_are_linear_and_stay_in_range(self):
        chance = random.Random(2)
        for _ in range(20):
            gain, offset = dataset.tints(4, chance)
            self.assertTrue(((offset >= 0) & (gain > 0) & (gain + offset <= 1)).all())
        clips = dataset.Clips(sequence.find([self.path]), 1, 16, turn=False, tint=True)
        for _ in range(10):
            frames, reference = clips.batch(4, chance)
            resampled = operators.keys_upsample(frames[0].color, 2, frames[0].jitter)
            self.assertLess((resampled - reference[0])[..., 6:-6, 6:-6].abs().max().item(), 0.03)

    def test_checked_clips_know_their_history_also_when_turned(self):
        found = sequence.find([self.path])
        chance = random.Random(4)
        clips = dataset.Clips(found, 4, 16, turn=True, tint=False, checked=True)
        for _ in range(8):
            frames, reference = clips.batch(1, chance)
            for t, frame in enumerate(frames[1:], 1):
                self.assertEqual(frame.followed.shape, (1, 2, 32, 32))
                self.assertTrue(torch.isfinite(frame.checked[..., 4:-4, 4:-4]).all())
                warped = operators.warp(reference[t - 1], frame.followed, "clamp", 0)
                self.assertLess((warped - reference[t])[..., 6:-6, 6:-6].abs().max().item(), 0.03)

    def test_collected_clips_know_what_fsr2_made_of_all_frames_before(self):
        (found,) = sequence.find([self.path])
        wanted, state = [], None
        for t in range(len(found)):
            state, trust = fsr2.step(found.frame(t), None if found.reset[t] else state, found.scale)
            wanted.append((state, trust))
        clips = dataset.Clips([found], 2, min(found.depth.shape[1:]), turn=False, tint=False, collected=True)
        chance = random.Random(6)
        for _ in range(6):
            for frame in clips.batch(1, chance)[0]:
                errors = [
                    (frame.collected - state[..., : frame.collected.shape[2], x : x + frame.collected.shape[3]]).abs().max()
                    + (frame.trust - trust[..., : frame.trust.shape[2], x // 2 : x // 2 + frame.trust.shape[3]]).abs().max()
                    for state, trust in wanted
                    for x in range(0, state.shape[3] - frame.collected.shape[3] + 1, 16)
                ]
                self.assertLess(min(errors).item(), 0.01)  # kept in half precision

    def test_events_befall_input_and_reference_alike(self):
        clips = dataset.Clips(sequence.find([self.path]), 6, 16, turn=False, tint=False, eventful=True, checked=True)
        chance, unmarked_cuts, flats = random.Random(5), 0, 0
        for _ in range(60):
            frames, reference = clips.batch(2, chance)
            for t, frame in enumerate(frames):
                resampled = operators.keys_upsample(frame.color, 2, frame.jitter)
                difference = (resampled - reference[t]).abs()
                # A bar's edge is not smooth: no more than its rows or columns differ.
                self.assertLess(difference.median().item(), 0.02)
                flats += (frame.color.flatten(2).std(dim=2) == 0).all(dim=1).sum().item()
                if t:
                    jump = (reference[t] - reference[t - 1]).abs().mean(dim=(1, 2, 3)) > 0.3
                    unmarked_cuts += (jump & torch.isfinite(frame.checked).flatten(1).all(dim=1)).sum().item()
        self.assertGreater(flats, 10)
        self.assertGreater(unmarked_cuts, 5)

    def test_crops_keep_their_dilated_motion(self):
        (whole,) = sequence.find([self.path])
        frames, _ = dataset.Clips([whole], 2, 8, turn=False, tint=False).batch(1, random.Random(3))
        self.assertEqual(tuple(frames[1].motion[0, :, 0, 0].tolist()), (-1.0, -0.5))


class Loop(WithData):
    def train(self, output, *words, pipeline="enss", size=("--size", "s")):
        options = ["--scale", 2, "--data", self.at("data"), "--crop", 16, "--clip", 2, 3, "--batch", 2, "--hidden", 16]
        run(train, "--pipeline", pipeline, *size, *options, "--output", self.at(output), "--threads", 1, *words)
        with open(self.at(output, "log.csv")) as file:
            return list(csv.DictReader(file)), torch.load(self.at(output, "checkpoint.pt"))

    def test_resuming_is_as_if_nothing_had_happened(self):
        _, whole = self.train("whole", "--steps", 8)
        stopping = property(lambda training: training.iteration / 8 if training.iteration < 5 else 1)
        with mock.patch.object(train.Training, "progress", stopping):
            rows, half = self.train("half", "--steps", 8)
        self.assertEqual((half["iteration"], len(rows)), (5, 1))
        rows, resumed = self.train("half", "--steps", 8, "--resume")
        self.assertEqual((resumed["iteration"], len(rows)), (8, 2))
        for part in ("network", "raw"):
            for name, tensor in whole[part].items():
                self.assertTrue(torch.equal(tensor, resumed[part][name]), name)
        self.assertTrue(any((whole["raw"][name] - whole["network"][name]).abs().max() > 0 for name in whole["raw"]))
        self.assertEqual(whole["running"], resumed["running"])

    def test_every_network_learns_and_is_exported(self):
        cases = {"clarus": ("--size", "s"), "enss": ("--size", "s"), "nsrr": ("--size", "fast"), "mnss": (), "nss": (), "srpo": ()}
        for pipeline, size in cases.items():
            clip = ["--clip", 1 if pipeline == "srpo" else 3]
            losses, step = [], train.Training.step

            def watched(training, clips):
                before = training.running
                rate = step(training, clips)
                now = training.running if before is None else (training.running - 0.98 * before) / 0.02
                losses.append(now)
                return rate

            steps = {"nss": 40, "clarus": 300}.get(pipeline, 24)  # these start as a reconstruction, and as fsr2
            words = ["--steps", steps, "--rate", 3e-3, "--no-turns", "--no-tints", *clip]
            with mock.patch.object(train.Training, "step", watched):
                self.train(pipeline, *words, pipeline=pipeline, size=size)
            self.assertLess(sum(losses[-6:]), 0.97 * sum(losses[:6]), pipeline)
            model = self.at(f"{pipeline}.safetensors")
            run(export, self.at(pipeline, "checkpoint.pt"), model, "--float32")
            loaded, trained = model_file.load(model), export.load_checkpoint(self.at(pipeline, "checkpoint.pt"))
            (data,) = sequence.find([self.at("data")])
            with torch.no_grad():
                for t in range(2):
                    outputs = [network.step(data.frame(t))[0] for network in (loaded, trained)]
                    self.assertLess((outputs[0] - outputs[1]).abs().max().item(), 1e-4, pipeline)

    def quantize(self, network, path):
        """Writes it with all its layers in whole numbers, for what they read of the data."""
        seen, layers = {}, {name: each for name, each in network.named_modules() if isinstance(each, torch.nn.Conv2d)}
        for name, layer in layers.items():
            layer.register_forward_hook(lambda _, inputs, __, name=name: seen.setdefault(name, []).append(inputs[0]))
        (data,) = sequence.find([self.at("data")])
        with torch.no_grad():
            frame.run(network, [data.frame(t) for t in range(4)])
        tensors, metadata = mnss.model_tensors(network)
        for name, layer in layers.items():
            reads = quantized.quantization_of(torch.cat(seen[name]))
            own = quantized.quantize(layer.weight.detach().numpy(), layer.bias.detach().numpy(), *reads)
            tensors.update({f"{name}.{key}": array for key, array in own.items()})
        safetensors.save(path, tensors, metadata)

    def test_a_network_in_whole_numbers_learns_from_the_one_in_floats(self):
        start, teacher, model = (self.at(f"{name}.safetensors") for name in ("start", "teacher", "model"))
        torch.manual_seed(3)
        network = mnss.Mnss(2)
        model_file.save(teacher, network)
        with torch.no_grad():
            for parameter in network.parameters():
                parameter.add_(0.03 * torch.randn_like(parameter))
        self.quantize(network, start)
        words = ["--int8", "--start", start, "--teacher", teacher, "--steps", 60, "--rate", 2e-3, "--loss", "l1"]
        self.train("whole", *words, "--no-turns", "--no-tints", pipeline="mnss", size=())
        checkpoint = self.at("whole", "checkpoint.pt")
        run(export, checkpoint, model)
        self.assertEqual(safetensors.load(model)[1]["quantization"], "int8")
        self.assertEqual(safetensors.load(model)[0]["reconstruct.1.weight"].dtype, np.int8)
        (data,) = sequence.find([self.at("data")])
        clip = [data.frame(t) for t in range(4)]
        with torch.no_grad():
            made = {name: frame.run(model_file.load(name), clip)[-1] for name in (start, teacher, model)}
            trained = frame.run(export.load_checkpoint(checkpoint), clip)[-1]
        distances = [(made[name] - made[teacher]).abs().mean().item() for name in (start, model)]
        self.assertLess(distances[1], 0.6 * distances[0])
        self.assertLess((trained - made[model]).abs().max().item(), 1e-5)
        with self.assertRaisesRegex(SystemExit, "teacher.*no layer is in whole numbers"):
            self.train("floats", "--int8", "--start", teacher, "--steps", 1, pipeline="mnss", size=())

    def test_weights_are_mixed(self):
        for seed in (0, 1):
            self.train(self.at(str(seed)), "--steps", 1, "--seed", seed)
        first, second = (export.load_checkpoint(self.at(str(seed), "checkpoint.pt")) for seed in (0, 1))
        mix = ["--mix", self.at("1", "checkpoint.pt"), 0.25]
        run(export, self.at("0", "checkpoint.pt"), self.at("mixed.safetensors"), "--float32", *mix)
        mixed = model_file.load(self.at("mixed.safetensors"))
        wanted = 0.75 * first.body[0].weight + 0.25 * second.body[0].weight
        self.assertGreater((first.body[0].weight - second.body[0].weight).abs().max().item(), 1e-3)
        torch.testing.assert_close(mixed.body[0].weight, wanted)

    def test_another_networks_weights_are_refused(self):
        self.train("small", "--steps", 1)
        with self.assertRaisesRegex(SystemExit, "--start .*small.*another shape"):
            self.train("other", "--steps", 1, "--start", self.at("small", "checkpoint.pt"), size=("--size", "m"))

    def test_distillation(self):
        teacher = enss.create(2, 4, 0, 32).kernels
        student, missed = distil.fit(teacher, hidden=24, steps=300)
        jitters = torch.rand(50, 2) - 0.5
        with torch.no_grad():
            wanted = teacher(jitters)
            error = (student(jitters) - wanted).square().sum() / (wanted - wanted.mean(dim=0)).square().sum()
        self.assertLess(error.item(), 0.05)
        self.assertLess(missed, 0.05)
        self.assertEqual(student.layers[3].weight.shape, (24, 24))

    def test_sequences_of_other_scales_are_left_out(self):
        write_sequence(self.at("data", "tripled"), scale=3)
        write_sequence(self.at("other"), scale=3)
        write_sequence(self.at("other", "halves"), scale=1.5)
        rows, _ = self.train("mixed", "--steps", 1, "--validation", self.at("data"))
        self.assertTrue(0 < float(rows[-1]["psnr"]) < 100)
        with self.assertRaisesRegex(SystemExit, "--validation: no sequence of scale 2"):
            self.train("none", "--steps", 1, "--validation", self.at("other"))

    def test_a_network_for_any_scale(self):
        write_sequence(self.at("data", "tripled"), scale=3)
        write_sequence(self.at("data", "beyond"), scale=4)
        scales, loss = set(), nss.loss

        def watched(network, frames, reference, *others):
            scales.add(reference.shape[-1] / frames[0].color.shape[-1])
            return loss(network, frames, reference, *others)

        with mock.patch.object(nss, "loss", watched):
            self.train("any", "--steps", 12, "--scale", "any", "--validation", self.at("data"), pipeline="nss", size=())
        self.assertEqual(scales, {2, 3})
        run(export, self.at("any", "checkpoint.pt"), self.at("any.safetensors"))
        self.assertEqual(safetensors.load(self.at("any.safetensors"))[1]["scale"], "any")
        for path in ("a", "tripled"):
            (data,) = sequence.find([self.at("data", path)])
            (figures, *_) = validation.run(model_file.load(self.at("any.safetensors")), data)
            self.assertTrue(0 < figures[0] < 100)
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()) as said:
            self.train("one", "--steps", 1, "--scale", "any")
        self.assertIn("networks of enss are of one scale", said.getvalue())
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()) as said:
            self.train("one", "--steps", 1, "--scale", "7")
        self.assertIn("7 is neither a whole number from 2 to 6 nor any", said.getvalue())

    def test_ends_when_told(self):
        step = train.Training.step

        def interrupted(training, clips):
            if training.iteration == 2:
                os.kill(os.getpid(), signal.SIGTERM)
            return step(training, clips)

        with mock.patch.object(train.Training, "step", interrupted):
            rows, checkpoint = self.train("told", "--steps", 100)
        self.assertEqual((checkpoint["iteration"], rows[-1]["iteration"]), (3, "3"))


class Evaluation(WithData):
    def test_manifest(self):
        path = self.at("manifest.json")
        segments = [{"frames": [0, 2], "kind": "moving"}, {"frames": [2, 5], "kind": "still"}]
        listed = [
            {"name": "one", "scene": "demo", "frames": 5, "segments": segments, "thin": True},
            dict(name="town-{n}", scene="procedural:{n}", path="{n}", n=[7, 9], jitter="halton:99+{n}", hdr=True),
            dict(name="centre", scene="demo", motion_at="centre", depth="projective", reversed=True),
        ]
        with open(path, "w") as file:
            json.dump(listed, file)
        entries = manifest.read(path)
        self.assertEqual([entry.name for entry in entries], ["one", "town-7", "town-8", "town-9", "centre"])
        self.assertEqual(entries[0].frames_of("still"), [2, 3, 4])
        command = entries[2].render_command("clarus", 3, "out")
        options = {"--scene": "procedural:8", "--path": "8", "--jitter": "halton:99+8", "--scale": "3"}
        for words in [*options.items(), ("--output", "out"), ("--hdr",)]:
            place = command.index(words[0])
            self.assertEqual(command[place : place + len(words)], [*words])
        self.assertNotIn("--reversed", command)
        command = " ".join(entries[4].render_command("clarus", 2, "out"))
        self.assertIn("--motion-at centre --depth projective --reversed", command)
        self.assertNotIn("--hdr", command)
        self.assertNotIn("--output-buffers", command)
        self.assertIn("--output-buffers", entries[2]._replace(output_buffers=True).render_command("clarus", 3, "out"))
        outside = [{"frames": [3, 99], "kind": "still"}]
        twice = {"name": "one", "scene": "demo"}
        for broken in ({"name": "x"}, twice, {"name": "y", "scene": "demo", "segments": outside}):
            with open(path, "w") as file:
                json.dump(listed + [broken], file)
            with self.assertRaises(SystemExit):
                manifest.read(path)

    def test_nothing_is_both_trained_on_and_held_out(self):
        folder = os.path.dirname(make_data.__file__)
        trained, held_out = (manifest.read(os.path.join(folder, f"{name}.json")) for name in ("training", "held_out"))
        self.assertFalse({entry.scene for entry in trained} & {entry.scene for entry in held_out})
        # Of these worlds seeds from 900 choose from kinds that no smaller one has.
        seeds = [
            [int(entry.scene[7:]) for entry in entries if entry.scene.startswith("action:")]
            for entries in (trained, held_out)
        ]
        self.assertLess(max(seeds[0]), 900)
        self.assertGreaterEqual(min(seeds[1]), 900)
        tracks = [[entry for entry in entries if entry.scene.startswith("torcs:")] for entries in (trained, held_out)]
        self.assertFalse(set.intersection(*({entry.path % 2 for entry in entries} for entries in tracks)))  # the cars
        self.assertGreaterEqual((len(held_out), len(tracks[1])), (4, 2))
        self.assertTrue(any(entry.thin for entry in held_out))
        self.assertTrue(all(entry.output_buffers for entry in held_out))
        self.assertTrue(all(entry.frames_of("still") for entry in held_out))
        moving = sum(len(entry.frames_of("moving")) for entry in held_out)
        self.assertGreaterEqual(2 * moving, sum(entry.frames for entry in held_out))

    def test_figures(self):
        segments = ({"frames": [0, 1], "kind": "moving"}, {"frames": [1, 3], "kind": "still"})
        entry = manifest.Entry("one", "demo", frames=3, segments=segments)
        ours = {"pixel_std": 0.5, "worst_blocks_psnr": 21.0, "if_ssim": 0.9, "strred": 2.0}
        ours["frames"] = [{"psnr": p, "ssim": 0.9, "worse_blocks": w} for p, w in ((30.0, 0.1), (33.0, 0.9), (34.0, 0.9))]
        bicubic = {"worst_blocks_psnr": 20.0, "frames": [{"psnr": p, "ssim": 0.8} for p in (29.0, 30.0, 30.0)]}
        # The first frame has no mask, the last one nothing disoccluded.
        for t, values in ((1, (25.0, 26.0)), (2, (None, 30.0))):
            for mask, value in zip(("disoccluded_4_psnr", "thin_psnr"), values):
                if value:
                    ours["frames"][t][mask], bicubic["frames"][t][mask] = value, value - t
        row = evaluate.figures_of(entry, ours, bicubic)
        self.assertAlmostEqual(row["gain"], 8 / 3)
        self.assertEqual((row["moving_gain"], row["still_gain"]), (1.0, 3.5))
        self.assertEqual((row["in_disoccluded_4_psnr"], row["in_disoccluded_4_gain"]), (25.0, 1.0))
        self.assertEqual((row["in_thin_psnr"], row["in_thin_gain"]), (28.0, 1.5))
        self.assertIsNone(row["in_moving_psnr"])
        self.assertEqual((row["worst_gain"], row["worse_blocks"]), (1.0, 10.0))
        plain = {"frames": [{key: frame[key] for key in ("psnr", "ssim")} for frame in ours["frames"]]}
        moving = evaluate.figures_of(entry._replace(segments=segments[:1]), plain, bicubic)
        self.assertEqual([moving[name] for name in ("pixel_std", "worst_gain", "worse_blocks", "in_thin_gain")], [None] * 4)
        mean = evaluate.mean_row([row, moving])
        self.assertEqual((mean["moving_gain"], mean["still_gain"], mean["frames"]), (1.0, 3.5, 6))
        self.assertEqual((mean["in_thin_gain"], mean["worse_blocks"]), (1.5, 10.0))
        for columns in (evaluate.GAINS, evaluate.ABSOLUTES):
            lines = evaluate.table([row, moving, mean], columns, markdown=True).splitlines()
            self.assertEqual({line.count("|") for line in lines}, {len(columns) + 2})
            lines = evaluate.table([row, moving, mean], columns, markdown=False).splitlines()
            self.assertEqual(len({len(line) for line in lines}), 1)
        gains = evaluate.table([row, moving, mean], evaluate.GAINS, markdown=True).splitlines()
        self.assertIn("| +2.67 | +1.00 | +3.50 | – | +1.00 | – | +1.50 | – | – | +1.00 | 10.0 | 0.50 |", gains[2])

    def test_bars(self):
        def row(scene, gain, worse):
            return {"scene": scene, "in_disoccluded_4_gain": gain, "worse_blocks": worse}

        gain, worse = evaluate.bars([row("a", 0.0, 4.0), row("b", 1.0, 6.0), row("mean", 0.5, 5.0)]).splitlines()
        self.assertTrue(gain.endswith("0.50, should be 0 or more: met on the mean"), gain)
        self.assertTrue(worse.endswith("5.00, should be 5 at most: met on the mean; not on b"), worse)
        gain, worse = evaluate.bars([row("a", -0.5, None), row("mean", -0.5, None)]).splitlines()
        self.assertTrue(gain.endswith("missed on the mean; not on a"), gain)
        self.assertTrue(worse.endswith("not measured, should be 5 at most"), worse)

    def test_results_are_refused_before_the_work(self):
        with open(self.at("list.json"), "w") as file:
            json.dump([{"name": "one", "scene": "demo", "frames": 1, "segments": []}], file)
        with self.assertRaisesRegex(SystemExit, "--results .*/nowhere/r.json: there is no such folder"):
            run(evaluate, "clarus", self.at("list.json"), self.path, "a", "--results", self.at("nowhere", "r.json"))

    def test_results_of_several_runs_share_a_file(self):
        path, row = self.at("results.json"), {"scene": "one", "gain": 1.234567, "frames": 3}
        self.assertEqual(evaluate.recorded(path, ["one"]), {})
        for model, gain in (("a", 1.0), ("b", 2.0), ("a", 3.0)):
            evaluate.record(path, ["one"], "clarus 1", {model: [row, {**row, "scene": "mean", "gain": gain}]})
        models = evaluate.recorded(path, ["one"])
        self.assertEqual({name: each["mean"]["gain"] for name, each in models.items()}, {"a": 3.0, "b": 2.0})
        self.assertEqual(models["a"]["scenes"], [{**row, "gain": 1.23457}])
        self.assertEqual((models["a"]["program"], len(models["a"]["date"])), ("clarus 1", len("2026-01-01")))
        self.assertFalse(os.path.exists(f"{path}.part"))
        with self.assertRaisesRegex(SystemExit, "results.json: of other scenes, one;"):
            evaluate.recorded(path, ["one", "two"])
        for text, why in (("[]", "not a file of results"), ('{"format": "clarus-quality"}', "not a file"), ("{", "results.json: ")):
            with open(path, "w") as file:
                file.write(text)
            with self.assertRaisesRegex(SystemExit, why):
                evaluate.record(path, ["one"], "clarus 1", {"a": [row, row]})
            with open(path) as file:
                self.assertEqual(file.read(), text)

    def test_every_model_is_compared_with_one_bicubic(self):
        runs = []

        def measure(clarus, sequence, model, output, options, baseline=None):
            runs.append((os.path.basename(sequence), model, baseline and os.path.basename(baseline)))
            os.makedirs(output, exist_ok=True)
            self.assertTrue(baseline is None or os.path.isdir(baseline))
            frames = [{"psnr": {"bicubic": 20.0, "a": 21.0, "b": 23.0}[model], "ssim": 0.5}]
            return {"pixel_std": 1.0, "frames": frames} if sequence.endswith("one") else {"frames": frames}

        entries = [manifest.Entry("one", "demo", frames=1), manifest.Entry("two", "demo", frames=1)]
        with mock.patch.object(evaluate, "measure", measure):
            rows, details = evaluate.evaluate("clarus", entries, "data", ["a", "b"], [])
        self.assertEqual([row["gain"] for row in rows["a"]], [1.0, 1.0, 1.0])
        self.assertEqual([row["gain"] for row in rows["b"]], [3.0, 3.0, 3.0])
        self.assertEqual([row["pixel_std"] for row in rows["b"]], [1.0, None, 1.0])
        self.assertEqual(sorted(details["b"]), ["one", "two"])
        self.assertEqual(runs[:3], [("one", "bicubic", None), ("one", "a", "bicubic"), ("one", "b", "bicubic")])


if __name__ == "__main__":
    unittest.main()
