#!/usr/bin/env python3
"""Makes tests/fuzz/seeds: small valid inputs, of which libFuzzer makes others. Needs oiiotool, for the images, and the build."""
import json
import struct
import subprocess
from pathlib import Path

tests = Path(__file__).resolve().parent.parent
seeds = tests / "fuzz" / "seeds"


def write(target, name, content):
    (seeds / target).mkdir(parents=True, exist_ok=True)
    (seeds / target / name).write_bytes(content)


def safetensors(metadata, tensors):
    """Tensors of so many F32 zeros."""
    header, end = {"__metadata__": metadata}, 0
    for name, count in tensors.items():
        header[name] = {"dtype": "F32", "shape": [count], "data_offsets": [end, end + 4 * count]}
        end += 4 * count
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + bytes(end)


write("address", "port", b"7000")
write("address", "host", b"localhost:7000")
write("address", "ipv6", b"[::1]:7000")
write("address", "stream", b"ucx:127.0.0.1:7000/game")

for model in ("stack_esr_max_x2.model", "stack_int8_1x1.golden", "mnss_x2_1x1.golden"):
    write("safetensors", model, (tests / "golden" / f"{model}.safetensors").read_bytes())

for model in ("stack_all_x2", "stack_int8_1x1", "enss_x2_1x1", "srpo_x2", "mnss_x2_1x1"):
    write("model", model, (tests / "golden" / f"{model}.model.safetensors").read_bytes())

for network in ("stack_esr_max_x2", "stack_esr_tm_x2", "stack_joined_x2"):
    write("onnx", network, (tests / "golden" / f"{network}.onnx").read_bytes())

bench = seeds / "bench_file" / "bilinear"
bench.parent.mkdir(parents=True, exist_ok=True)
subprocess.run([tests.parent / "build/bin/clarus", "bench", "--models", "bilinear", "--sizes", "64x48", "--seconds", "0.2",
                "--without-start", "-o", bench], check=True)
bench.write_text(json.dumps(json.loads(bench.read_text())))  # shorter

write("camera", "frame", json.dumps({"jitter_offset": {"x": 0.25, "y": -0.5}}).encode())

write("control", "state", b"{}")
write("control", "change", json.dumps({"model": "enss-s-x2", "scale": "2", "output-size": "auto"}).encode())

write("report", "run", json.dumps({
    "model": {"name": "bilinear"}, "devices": [{"name": "cpu"}], "precision": "fp32", "output_size": [32, 16],
    "stages": [{"name": "resample", "kernel": "fast", "seconds": 1e-3, "operations": 2048, "bytes": 4096, "device": 0}],
    "timeline": [{"stage": 0, "frame": 0, "start": 0, "end": 1e-3}], "placement": [{"stages": ["resample"]}]}).encode())

write("history", "values", safetensors({"form": "clarus history 1", "network": "a network", "render_size": "16x8", "jitter_x": "0.25",
                                        "jitter_y": "-0.25", "computed_by": "a device", "layout of history": "32x16"},
                                       {"history": 1536}))
write("history", "none", safetensors({"form": "clarus history 1", "network": "a network"}, {}))

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

write("sequence", "everything", json.dumps({
    "version": 1, "render_size": [16, 8], "output_size": [30, 16], "scale": 2, "mip_bias": -1, "color_space": "linear",
    "color": {"channels": ["L.R", "L.G", "L.B", "L.A"], "part": "beauty"}, "depth": {"encoding": "linear", "channels": ["Z"]},
    "motion": {"unit": "render_pixels", "channels": ["X", "Y"]},
    "frames": [{"color": "c.exr", "jitter": [0.0, 0.25], "reset": True, "exposure": 2, "render_size": [8, 4], "reactive": "r.png",
                "transparency": "t.png", "opaque_color": "o.exr", "ui": "u.png", "reference": "ref.exr",
                "camera": {"view": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
                           "projection": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -0.1, 0, 0, -1, 0], "near": 0.1, "far": None,
                           "fov_y": 1}}],
}).encode())
nss_frame = {"CameraNearPlane": 0.1, "CameraFarPlane": -1, "NormalizedPerRatioJitter": [{"X": 0.01, "Y": 0.02}], "Exposure": 2}
write("sequence", "nss", json.dumps({"EmulatedFramerate": 30, "ReverseZ": True, "UpscalingRatiosIndices": {"x2_index": 0},
                                     "Frames": [nss_frame, {**nss_frame, "CameraCut": True}]}).encode())

# share_stream_packet of a 16x8 stream with colour in 3 bytes, then share_frame_header: host/share/wire.h.
head = struct.pack("4I", 0x53524C43, 2, 2, 328)
resources = struct.pack("4IQ", 0, 3, 16, 8, 0) + bytes(9 * 24)
fields = struct.pack("7I3f4IQQ", 3, 0, 0, 0, 0, 0, 0, 1, 1, 2, 0, 0, 0, 0, 0, 0)
frame = struct.pack("3Q2I9f2I32fI", 0, 0, 0, 16, 8, 0, 0, 1, 0.1, 100, 1, 0.016, 1, 1, 0, 0, *[0] * 32, 0)
write("share", "color", head + resources + fields + frame)



def draw(*arguments):
    """oiiotool into seeds/image, without its words of itself and of the path."""
    folder = seeds / "image"
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["oiiotool", "--nosoftwareattrib", *arguments], cwd=folder, check=True)


picture = ["--pattern", "fill:topleft=0,.5,1:bottomright=1,0,.2", "8x6"]
draw(*picture, "3", "-d", "uint8", "-o", "rgb.png")
draw(*picture, "3", "-d", "uint16", "-o", "rgb16.png")
draw(*picture, "3", "-d", "half", "--compression", "zip", "-o", "half.exr")
draw(*picture, "3", "-d", "float", "--compression", "piz", "-o", "piz.exr")
draw(*picture, "7", "--chnames", "R,G,B,A,depth.Z,forward.u,forward.v", "-d", "half", "-o", "layers.exr")
draw(*picture, "4", "--chnames", "R,G,B,A", "--attrib", "oiio:subimagename", "rgba",
     *picture, "1", "--chnames", "Z", "--attrib", "oiio:subimagename", "depth", "--siappend", "-d", "float", "-o", "parts.exr")
