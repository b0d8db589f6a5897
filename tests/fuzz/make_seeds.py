#!/usr/bin/env python3
"""Makes tests/fuzz/seeds: small valid inputs, of which libFuzzer makes others. Needs oiiotool, for the images, and the build."""
import json
import shutil
import struct
import subprocess
from pathlib import Path

tests = Path(__file__).resolve().parent.parent
seeds = tests / "fuzz" / "seeds"


def write(target, name, content):
    (seeds / target).mkdir(parents=True, exist_ok=True)
    (seeds / target / name).write_bytes(content)


write("address", "port", b"7000")
write("address", "host", b"localhost:7000")
write("address", "ipv6", b"[::1]:7000")
write("address", "stream", b"ucx:127.0.0.1:7000/game")

for model in ("stack_esr_max_x2.model", "stack_int8_1x1.golden", "mnss_x2_1x1.golden"):
    write("safetensors", model, (tests / "golden" / f"{model}.safetensors").read_bytes())

for model in ("stack_all_x2", "stack_int8_1x1", "enss_x2_1x1", "srpo_x2", "mnss_x2_1x1"):
    write("model", model, (tests / "golden" / f"{model}.model.safetensors").read_bytes())

bench = seeds / "bench_file" / "bilinear"
bench.parent.mkdir(parents=True, exist_ok=True)
subprocess.run([tests.parent / "build/bin/clarus", "bench", "--models", "bilinear", "--sizes", "64x48", "--seconds", "0.2",
                "--without-start", "-o", bench], check=True)
bench.write_text(json.dumps(json.loads(bench.read_text())))  # shorter

write("trace", "frame", json.dumps({"otherData": {"began": 1.5e9}, "traceEvents": [
    {"ph": "M", "name": "process_name", "pid": 1, "args": {"name": "render"}},
    {"ph": "M", "name": "thread_name", "pid": 1, "tid": 2, "args": {"name": "frames"}},
    {"ph": "X", "name": "draw", "pid": 1, "tid": 2, "ts": 0, "dur": 9.5, "args": {"frame": "0000"}},
    {"ph": "X", "name": "draw", "pid": 1, "tid": 2, "ts": 20, "dur": 9, "args": {"frame": "0001"}}]}).encode())

write("sequence", "native", json.dumps({
    "version": 1, "render_size": [16, 8], "scale": 2, "frame_rate": 60, "color_space": "srgb",
    "depth": {"encoding": "projective", "reversed": True, "near": 0.1, "far": None},
    "motion": {"unit": "uv", "direction": "from_previous", "y": "up", "jittered": False, "sampled_at": "jittered"},
    "frames": [{"color": "c.png", "depth": "d.exr", "motion": "m.exr", "jitter": [0.0, -0.25], "reset": True}],
}).encode())

# share_stream_packet of a 16x8 stream with colour in 3 bytes, then share_frame_header: host/share/wire.h.
head = struct.pack("4I", 0x53524C43, 2, 2, 328)
resources = struct.pack("4IQ", 0, 3, 16, 8, 0) + bytes(9 * 24)
fields = struct.pack("7I3f4IQQ", 3, 0, 0, 0, 0, 0, 0, 1, 1, 2, 0, 0, 0, 0, 0, 0)
frame = struct.pack("3Q2I9f2I32fI", 0, 0, 0, 16, 8, 0, 0, 1, 0.1, 100, 1, 0.016, 1, 1, 0, 0, *[0] * 32, 0)
write("share", "color", head + resources + fields + frame)

for name, options in {"rgb.png": ["-d", "uint8"], "rgb16.png": ["-d", "uint16"], "half.exr": ["-d", "half", "--compression", "zip"],
                      "piz.exr": ["-d", "float", "--compression", "piz"]}.items():
    (seeds / "image").mkdir(parents=True, exist_ok=True)
    subprocess.run([shutil.which("oiiotool") or "oiiotool", "--pattern", "fill:topleft=0,.5,1:bottomright=1,0,.2", "8x6", "3",
                    *options, "-o", str(seeds / "image" / name)], check=True)
