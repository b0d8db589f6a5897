"""Lists of sequences to render, as JSON.

    [{"name": "demo-1", "scene": "demo", "path": 1, "first_frame": 0, "frames": 24, "size": "320x180",
      "jitter": "halton:16", "motion_at": "jittered", "depth": "linear", "reversed": false, "hdr": false, "thin": false,
      "output_buffers": false,
      "segments": [{"frames": [0, 10], "kind": "moving"}, {"frames": [10, 24], "kind": "still"}]}]

Only `name` and `scene` are needed; `jitter`, `motion_at` and `depth` are as `clarus render` takes them. `segments` say
which frames (first, and one past the last, counted from the sequence's own 0) move and which stand still, `thin` that
the scene has thin features, `output_buffers` that masks are wanted to measure in (docs/metrics.md). An entry with
"n": [a, b] stands for b − a + 1 of them, in whose text "{n}" is replaced:

    {"name": "town-{n}", "scene": "procedural:{n}", "path": "{n}", "n": [100, 179]}
"""

import json
from typing import NamedTuple


class Entry(NamedTuple):
    name: str
    scene: str
    path: int = 0
    first_frame: int = 0
    frames: int = 24
    size: str = "320x180"
    jitter: str = "halton:16"
    samples: int = 1
    reference_samples: int = 16
    motion_at: str = "jittered"
    depth: str = "linear"
    reversed: bool = False
    hdr: bool = False
    thin: bool = False
    output_buffers: bool = False
    segments: tuple = ()

    def frames_of(self, kind):
        """In segments of a kind."""
        spans = [segment["frames"] for segment in self.segments if segment["kind"] == kind]
        return [t for first, end in spans for t in range(first, end)]

    def render_command(self, clarus, scale, output):
        command = [clarus, "render", "--scene", self.scene, "--path", self.path, "--size", self.size, "--scale", scale]
        command += ["--frames", self.frames, "--first-frame", self.first_frame, "--jitter", self.jitter]
        command += ["--samples", self.samples, "--reference-samples", self.reference_samples]
        command += ["--motion-at", self.motion_at, "--depth", self.depth]
        flags = ("reversed", "hdr", "output_buffers")
        command += [f"--{flag.replace('_', '-')}" for flag in flags if getattr(self, flag)]
        return [str(word) for word in command + ["--output", output, "--force"]]


def read(path):
    """The entries of a manifest."""
    with open(path) as file:
        listed = json.load(file)
    entries = []
    for fields in listed:
        first, last = fields.pop("n", (0, 0))
        for n in range(first, last + 1):
            filled = {k: v.replace("{n}", str(n)) if isinstance(v, str) else v for k, v in fields.items()}
            try:
                entry = Entry(**filled)
            except TypeError as error:
                raise SystemExit(f"{path}: {fields}: {error}") from None
            if any(not 0 <= s["frames"][0] < s["frames"][1] <= entry.frames for s in entry.segments):
                raise SystemExit(f"{path}: {entry.name}: a segment is not within its {entry.frames} frames")
            entries.append(entry._replace(path=int(entry.path)))
    names = [entry.name for entry in entries]
    for name in names:
        if names.count(name) > 1:
            raise SystemExit(f"{path}: {name} is there more than once")
    return entries
