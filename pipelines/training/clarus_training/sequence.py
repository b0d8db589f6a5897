"""Sequences in the native layout, decoded once into arrays that training cuts clips from."""

import hashlib
import json
import os
import pathlib
import resource
import shutil

import numpy as np
import OpenImageIO as oiio
import torch

from . import fsr2, history, operators
from .frame import Frame


class Sequence:
    """A sequence's frames as memory-mapped arrays, canonical as docs/conventions.md has it.

    `color` [T, h, w, 3] and `reference` [T, H, W, 3] are display-encoded: uint8 where the images are, else float16 in
    [0, 1]. `depth` [T, h, w] is 0 nearest, 1 without any; `motion` [T, h, w, 2] is in render pixels to the
    previous frame, NaN where invalid. `jitter` is a list of (jx, jy), `motion_jitter` of where in their pixels the
    vectors were sampled (J_m), `reset` of flags.
    """

    def __init__(self, directory):
        self.directory = directory
        path = os.path.join(directory, "sequence.json")
        with open(path) as file:
            self.facts = json.load(file)
        scale = self.facts["scale"]
        self.scale = int(scale) if scale == int(scale) else scale
        self.frames = self.facts["frames"]
        if any(frame.get("render_size", self.facts["render_size"]) != self.facts["render_size"] for frame in self.frames):
            raise ValueError(f"{path}: frames of several render sizes; training needs one")
        if any({"channels", "part"} & set(self.facts.get(role, {})) for role in ("color", "depth", "motion")):
            raise ValueError(f"{path}: channels of layers or parts; training reads files that have no others")
        self.jitter = [tuple(frame["jitter"]) for frame in self.frames]
        jittered = self.facts.get("motion", {}).get("sampled_at") == "jittered"
        self.motion_jitter = self.jitter if jittered else [(0.0, 0.0)] * len(self.frames)
        self.reset = [t == 0 or frame.get("reset", False) for t, frame in enumerate(self.frames)]
        self._shape = (len(self.frames), *self.facts["render_size"][::-1])
        self.has_references = all("reference" in frame for frame in self.frames)
        names = ["color", "depth", "motion"] + ["reference"] * self.has_references
        self._written = os.stat(path).st_mtime_ns
        self._load("arrays", names)

    def follow(self):
        """Adds `followed` [T, H, W, 2], in output pixels, and `checked` [T, h, w, 2], both float16: see history.py."""
        self._load(f"followed-{source_of(history)}", ["followed", "checked"])

    def collect(self):
        """Adds `collected` [T, H, W, 4] and `trust` [T, h, w, 1], both float16: see fsr2.py."""
        self._load(f"collected-{source_of(fsr2, history)}", ["collected", "trust"])

    def _load(self, kind, names):
        """Sets attributes to arrays that are decoded where they are not there yet."""
        cache = os.path.join(self.directory, f".{kind}-{self._written}")
        if not os.path.isdir(cache):
            temporary = f"{cache}.{os.getpid()}.part"
            os.mkdir(temporary)
            for name in names:
                np.save(os.path.join(temporary, f"{name}.npy"), getattr(self, f"_decode_{name}")())
            try:
                os.rename(temporary, cache)
            except OSError:  # another process was faster
                shutil.rmtree(temporary)
        for name in names:
            setattr(self, name, np.load(os.path.join(cache, f"{name}.npy"), mmap_mode="r"))

    def __len__(self):
        return len(self.frames)

    def images(self, name, t, device="cpu"):
        """Frame t's colour, depth, motion or reference as a batch of one image."""
        array = getattr(self, name)[t : t + 1]
        return to_images(array[..., None] if name == "depth" else array, device)

    def frame(self, t, device="cpu"):
        images = (self.images(name, t, device) for name in ("color", "depth", "motion"))
        return Frame(*images, self.jitter[t], self.motion_jitter[t])

    def _image(self, frame, name):
        return read_pixels(os.path.join(self.directory, frame[name]))

    def _display(self, frame, name):
        return display(self._image(frame, name), self.facts["color_space"] == "linear", frame.get("exposure", 1.0))

    def _decode_color(self):
        return np.stack([self._display(frame, "color") for frame in self.frames])

    def _decode_reference(self):
        return np.stack([self._display(frame, "reference") for frame in self.frames])

    def _decode_depth(self):
        if "depth" not in self.frames[0]:
            return np.ones(self._shape, np.float32)
        facts = self.facts.get("depth", {})
        reversed_depth, near, far = facts.get("reversed", False), facts.get("near"), facts.get("far")

        def canonical(stored):
            v = stored.astype(np.float64)
            if facts.get("encoding", "linear") == "linear":
                return 1 - v if reversed_depth else v
            v = np.clip(v, 0, 1)
            with np.errstate(divide="ignore"):
                if far is None:
                    return near / (v if reversed_depth else 1 - v) / (1e4 * near)
                return near / (near + v * (far - near) if reversed_depth else far - v * (far - near))

        stored = [self._image(frame, "depth")[:, :, 0] for frame in self.frames]
        canonical_depth = [np.clip(np.nan_to_num(canonical(v), nan=1.0), 0, 1) for v in stored]
        return np.stack(canonical_depth).astype(np.float32)

    def _decode_motion(self):
        if "motion" not in self.frames[0]:
            return np.full((*self._shape, 2), np.nan, np.float32)
        facts = self.facts.get("motion", {})
        frames = []
        for t, frame in enumerate(self.frames):
            motion = self._image(frame, "motion")[:, :, :2].astype(np.float32)
            if facts.get("unit", "pixels") == "uv":
                motion = motion * np.float32(self.facts["render_size"])
            if facts.get("direction", "to_previous") == "from_previous":
                motion = -motion
            if facts.get("y", "down") == "up":
                motion = motion * np.float32([1, -1])
            motion = operators.mark_invalid(torch.from_numpy(motion).permute(2, 0, 1)[None])[0].permute(1, 2, 0).numpy()
            if facts.get("jittered", False) and not self.reset[t]:
                motion = motion + np.float32(self.jitter[t - 1]) - np.float32(self.jitter[t])
            frames.append(motion)
        return np.stack(frames)

    def _checked(self, t):
        return history.checked(self.images("motion", t), self.images("depth", t), self.jitter[t])

    def _decode_followed(self):
        def followed(t):
            depth = self.images("depth", t)
            return history.reproject(self._checked(t), depth, self.scale, self.motion_jitter[t])[0].movedim(0, 2)

        return np.stack([followed(t).half().numpy() for t in range(len(self))])

    def _collected(self):
        """fsr2's history and trust of each frame; decoded together, and kept until both are written."""
        if not hasattr(self, "_of_fsr2"):
            made = []
            for t in range(len(self)):
                before = None if self.reset[t] else made[-1][0]
                made.append(fsr2.step(self.frame(t), before, self.scale))
            self._of_fsr2 = [np.stack([each[0].movedim(0, 2).half().numpy() for each in some]) for some in zip(*made)]
        return self._of_fsr2

    def _decode_collected(self):
        return self._collected()[0]

    def _decode_trust(self):
        trust = self._collected()[1]
        del self._of_fsr2
        return trust

    def _decode_checked(self):
        return np.stack([self._checked(t)[0].movedim(0, 2).half().numpy() for t in range(len(self))])


def source_of(*modules):
    """A name of what modules say at present: what they have made is made anew when they change."""
    said = [pathlib.Path(module.__file__).read_bytes() for module in (*modules, operators)]
    return hashlib.sha256(b"".join(said)).hexdigest()[:12]


def display(pixels, is_linear, exposure=1.0):
    """Display-encoded colour [h, w, 3] of an image's pixels: uint8 as stored, anything else as float16."""
    pixels = pixels[:, :, :3]
    if pixels.dtype == np.uint8:
        return pixels
    if not is_linear:
        return np.clip(np.nan_to_num(pixels, nan=0.0), 0, 1).astype(np.float16)
    linear = np.clip(np.nan_to_num(pixels, nan=0.0, posinf=65504.0), 0, None) * exposure
    tone_mapped = linear / (1 + linear.max(axis=2, keepdims=True))
    curve = 1.055 * np.maximum(tone_mapped, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(tone_mapped < 0.0031308, 12.92 * tone_mapped, curve).astype(np.float16)


def read_pixels(path):
    """An image's pixels [h, w, c]: uint8 as stored, anything else as float32."""
    specification = oiio.ImageSpec()
    specification.attribute("oiio:UnassociatedAlpha", 1)
    image = oiio.ImageInput.open(path, specification)
    if image is None:
        raise OSError(f"{path}: {oiio.geterror()}")
    pixels = image.read_image("uint8" if str(image.spec().format) == "uint8" else "float")
    image.close()
    return pixels


def find(directories):
    """All sequences at or below the directories."""
    # A memory-mapped array holds its file open.
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    found = []
    for directory in directories:
        for folder, folders, files in os.walk(directory):
            folders[:] = sorted(name for name in folders if not name.endswith(".part"))
            if "sequence.json" in files:
                found.append(Sequence(folder))
    if not found:
        raise SystemExit(f"no sequence.json in {', '.join(directories)}")
    return found


def to_images(array, device="cpu"):
    """Frames [..., h, w, c] as float images [..., c, h, w]; uint8 becomes [0, 1]."""
    images = torch.from_numpy(np.array(array)).to(device)
    images = images.float() / 255 if images.dtype == torch.uint8 else images.float()
    return images.movedim(-1, -3)
