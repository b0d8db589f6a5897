#!/usr/bin/env python3
"""Makes tests/fuzz/seeds: small valid inputs, of which libFuzzer makes others. Needs oiiotool and ffmpeg, for images and videos, and the build."""
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

for model in ("stack_all_x2", "stack_int8_1x1", "enss_x2_1x1", "srpo_x2", "mnss_x2_1x1", "clarus_x4_1x1"):
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

kind = {"motion": {"unit": "uv", "direction": "from_previous", "y": "up", "jittered": True}, "depth": {"encoding": "linear", "reversed": True}}
frames = [{"color": f"c{i}.png", "depth": f"d{i}.exr", "motion": f"m{i}.exr", "jitter": [0.125 * i, -0.25]} for i in range(3)]
plain = {"version": 1, "render_size": [16, 8], "scale": 2, "color_space": "srgb"}
write("correction", "linear", json.dumps({**plain, **kind, "frames": frames}).encode())
write("correction", "projective", json.dumps({
    **plain, **kind, "depth": {"encoding": "projective", "reversed": False, "near": 0.1, "far": None},
    "motion": {**kind["motion"], "unit": "pixels", "channels": ["X", "Y"]}, "frames": frames[:2]}).encode())
write("correction", "color", json.dumps({**plain, "frames": [{"color": "c.png", "jitter": [0, 0]}]}).encode())

for name, weights in (("filter", ""), ("network", "0123456789abcdef0123456789abcdef")):
    write("checks", name, json.dumps({"format": "clarus-bench-checks", "version": 1, "checks": [
        {"model": name, "scale": 2, "render_size": [16, 8], "checksum": weights, "sketch": [0.5, -0.25] * 32}]}).encode())

write("tuning", "measured", json.dumps({"device": "a device", "driver": "1.0", "results": {
    "convolution of 4x4/4 block 1 f32 2^7 to 4x4/4 block 1 f32 2^7 0123456789abcdef, 0123456789abcdef": {
        "implementation": "winograd", "choices": {"TILES": 12, "ROWS": -1}, "seconds": 1e-3, "built_in_seconds": 2e-3},
    "sum, 0": {"implementation": "plain", "choices": {}, "seconds": 1}}}).encode())

write("placement", "two", json.dumps({"places": [0, 1, 1], "seconds": [0, 1e-3, 0.5]}).encode())


# host/share/wire.h: heads, share_stream_packet, share_frame_header, and what else the two sides say.
def said_head(kind, size, version=2):
    return struct.pack("4I", 0x53524C43, version, kind, size)


def pages(size):
    return -(-size // 4096) * 4096


def stream(resources, slots=3, policy=0, scale=2, shown=(0, 0), dynamic=0, user=0, flags=(0, 0, 0, 0, 0)):
    """`resources`, of 10: type, channels, width, height, bytes of a row; None where there is none."""
    described = b"".join(struct.pack("4IQ", *(each or (0,) * 5)) for each in resources)
    slot = 4096 + pages(user) + sum(pages(each[3] * each[4]) for each in resources if each)
    return said_head(2, 328) + described + struct.pack("7I3f4IQQ", slots, policy, *flags, 1, 1, scale, *shown, dynamic, 0, user, slot)


def header(width=16, height=8, user=0, index=0, matrices=0):
    return struct.pack("3Q2I9f2I32fI", index, 7, user, width, height, 0, -0.25, 1, 0.1, 100, 1, 0.016, 1, 1, 0, matrices,
                       *[matrices] * 32, 0)


def leave(reason, text):
    return said_head(3, 276) + struct.pack("I256s", reason, text)


def words(*values):
    return struct.pack(f"{len(values)}Q", *values)


color, nothing = (0, 3, 16, 8, 48), [None] * 9
everything = [(2, 3, 16, 8, 192), (2, 1, 16, 8, 64), (1, 2, 16, 8, 64), (0, 1, 16, 8, 16), (3, 1, 16, 8, 32), (5, 3, 16, 8, 64),
              (4, 4, 32, 16, 128), (0, 4, 32, 16, 128), (2, 1, 1, 1, 4), (1, 4, 8, 8, 64)]
streams = {
    "color": stream([color, *nothing]) + header(),
    "everything": stream(everything, user=64, flags=(1, 1, 1, 1, 1), shown=(30, 16), scale=0) + header(user=64, matrices=1),
    "newest": stream([color, *nothing], slots=2, policy=1) + header(),
    "dynamic": stream([color, (6, 1, 16, 8, 64), *nothing[1:]], dynamic=1) + header(width=8, height=4),
}
for name, said in streams.items():
    write("share", name, said)
# Index i is in slot i: the words of the newest frame are i + 1 above, i below.
newest = words(1 << 4, 2 << 4 | 1)
write("share_reader", "color", streams["color"] + words(1, 3, 4) + leave(1, b"the end"))
write("share_reader", "everything", streams["everything"] + words(0, 2, 3) + leave(2, b"another \x1b reader"))
write("share_reader", "newest", streams["newest"] + newest + words(0))
write("share_reader", "newest_skips", streams["newest"] + words(0, 2 << 4 | 1, 2 << 4 | 1) + leave(1, b""))
write("share_reader", "dynamic", streams["dynamic"] + words(1))
write("share_reader", "other_version", said_head(2, 328, version=3) + bytes(312))
write("share_reader", "refusal", leave(2, b"it has an upscaler already"))
hello = said_head(1, 16)
for policy, name in enumerate(("every", "newest")):
    first = bytes([2 * len(hello) + policy]) + hello
    page = newest[:8] * 2 if policy else words(0, 1)
    write("share_stream", name, first + page * 2 + leave(1, b"the end"))
write("share_stream", "refusal", bytes([2 * len(hello)]) + hello + words(0, 0, 0, 1) + leave(4, b"nonsense"))
write("share_stream", "other_version", bytes([2 * len(hello)]) + said_head(1, 16, version=3))
write("share_stream", "leave", bytes([2 * 20]) + leave(1, b"")[:20])

# host/link/protocol.h, and the events of fuzz/link.cpp.
connects, fetched, lost, breaks = b"\0", b"\2", b"\6", b"\3"


def says(header, data=0):
    return b"\1" + struct.pack("<HI", len(header), data) + header


def link_hello(said, session=5, first=0, name=b"fuzz"):
    return says(said_head(16, 432) + struct.pack("2Q72s", session, first, name) + said)


def link_frame(index, said, data):
    return says(said_head(18, 24 + len(said)) + struct.pack("Q", index) + said, data)


def progress(received, released):
    return says(said_head(17, 32) + words(received, released))


alive, parted = says(said_head(19, 16)), says(leave(1, b"the end"))
plain, both = stream([color, *nothing]), stream(everything, user=64, scale=0)
plain_bytes, both_bytes = (struct.unpack("Q", said[-8:])[0] - 4096 for said in (plain, both))
write("link", "frames", b"\0" + connects + link_hello(plain) + link_frame(0, header(), plain_bytes) + fetched + alive +
      link_frame(1, header(), plain_bytes) + fetched + parted)
write("link", "everything", b"\0" + connects + link_hello(both, first=3) + link_frame(3, header(user=64, matrices=1), both_bytes) + fetched)
write("link", "again", b"\0" + connects + link_hello(plain) + link_frame(0, header(), plain_bytes) + breaks + connects +
      link_hello(plain) + lost + link_frame(0, header(), plain_bytes) + fetched)
write("link", "two", b"\0" + connects + link_hello(plain) + connects + b"\5" + link_hello(plain, session=6)[1:] + parted)
write("link", "wrong", b"\0" + connects + link_hello(plain) + link_frame(0, header(), 77))
write("link", "taken", b"\1" + progress(0, 0) + alive * 40 + progress(1, 0) + progress(1, 1) + parted)
write("link", "newest", b"\3" + progress(0, 0) + alive * 40 + breaks + progress(1, 1))
write("link", "never", b"\1" + progress(9, 0))
write("link", "refused", b"\1" + says(leave(2, b"another name")))


def film(name, *options):
    """ffmpeg into seeds/video, without its version."""
    folder = seeds / "video"
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "lavfi", "-i", "testsrc=size=32x16:rate=25:duration=0.12", *options,
                    "-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-flags:a", "+bitexact", name],
                   cwd=folder, check=True)


film("h264.mp4", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart")
film("fragments.mp4", "-c:v", "mpeg4", "-movflags", "+frag_keyframe+empty_moov")
film("sound.mkv", "-f", "lavfi", "-i", "sine=duration=0.12", "-c:v", "ffv1", "-pix_fmt", "yuv444p10", "-c:a", "pcm_s16le")
film("vp9.webm", "-c:v", "libvpx-vp9")
film("motion_jpeg.avi", "-c:v", "mjpeg", "-pix_fmt", "yuvj420p")
film("raw.avi", "-c:v", "rawvideo", "-pix_fmt", "yuv420p", "-frames:v", "2")


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
