#!/usr/bin/env python3
"""Plays both games of README.md, once before `clarus serve` and once before record.py: games.py FOLDER [GAME ...]

Needs the tree's build, Debian's openarena and xvfb, and for Panda3D PyPI's panda3d, which is installed into
build/panda3d-venv where that is not there. FOLDER/GAME receives what was served, the sequence that was recorded, what a
model makes of that, and sheet.jpg.
"""

import argparse
import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile

import numpy as np
import OpenImageIO as oiio
from judge_motion import read

HERE = os.path.dirname(os.path.abspath(__file__))
TREE = os.path.dirname(HERE)
CLARUS = os.path.join(TREE, "build/bin/clarus")
MODEL = "enss-s-x2"
WIDTH, HEIGHT = 480, 270


@contextlib.contextmanager
def process(command, end=signal.SIGTERM, **options):
    """Runs while the block does; ended by a signal, or by a line that it is told."""
    told = isinstance(end, bytes)
    started = subprocess.Popen(command, stdin=subprocess.PIPE if told else subprocess.DEVNULL, **options)
    try:
        yield started
    finally:
        if not told:
            started.send_signal(end)
        try:
            if told:
                started.communicate(end, 30)
            started.wait(30)
        except subprocess.TimeoutExpired:
            started.kill()
            started.wait()


@contextlib.contextmanager
def openarena(stream):
    """The demo that the game brings, in steps of 1/30 s however long frames take."""
    with contextlib.ExitStack() as stack:
        ends = os.pipe()
        server = ["Xvfb", "-displayfd", str(ends[1]), "-screen", "0", "640x480x24", "-nolisten", "tcp"]
        stack.enter_context(process(server, pass_fds=[ends[1]], stderr=subprocess.DEVNULL))
        os.close(ends[1])
        with os.fdopen(ends[0]) as told:
            display = told.readline().strip()
        library = os.path.join(TREE, "build/lib/clarus/libclarus_opengl.so")
        environment = {
            "DISPLAY": f":{display}",
            "HOME": stack.enter_context(tempfile.TemporaryDirectory()),
            "LD_PRELOAD": library,
            "CLARUS_GL_STREAM": stream,
            "SDL_AUDIODRIVER": "dummy",
        }
        settings = {
            "cl_renderer": "opengl1",
            "r_fullscreen": 0,
            "r_mode": -1,
            "r_customwidth": WIDTH,
            "r_customheight": HEIGHT,
            "r_textureMode": "GL_LINEAR_MIPMAP_LINEAR",
            "s_initsound": 0,
            "com_introplayed": 1,
            "com_maxfps": 0,
            "fixedtime": 33,
        }
        words = [str(word) for name, value in settings.items() for word in ("+set", name, value)]
        game = ["/usr/games/openarena", "--quiet", *words, "+demo", "demo088-test1"]
        stack.enter_context(process(game, b"quit\n", env={**os.environ, **environment}))
        yield


@contextlib.contextmanager
def panda3d(stream):
    environment = os.path.join(TREE, "build/panda3d-venv")
    python = os.path.join(environment, "bin/python")
    if not os.path.exists(os.path.join(environment, "complete")):
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", environment], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "panda3d>=1.10.13"], check=True)
        open(os.path.join(environment, "complete"), "w").close()
    game = [python, os.path.join(HERE, "panda3d/game.py"), stream, "--size", f"{WIDTH}x{HEIGHT}", "--frames", "1000000"]
    with process(game, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):
        yield


# Of each game: frames until the demo's player sees something; the sheet's rows, each a frame and where a quarter of its
# sides begins that is enlarged, or None for the whole of it.
GAMES = {
    "openarena": (openarena, 60, [(45, None), (45, (190, 115)), (180, (135, 90))]),
    "panda3d": (panda3d, 0, [(48, None), (48, (100, 140))]),
}


def record(game, stream, folder, skip, frames):
    with game(stream):
        words = [stream, folder, "--frames", str(frames), "--skip", str(skip)]
        subprocess.run([sys.executable, os.path.join(HERE, "record.py"), *words], check=True)


def serve(game, stream, folder, seconds):
    with process([CLARUS, "serve", stream, "--model", MODEL, "--output", folder], signal.SIGINT) as server:
        with game(stream):
            with contextlib.suppress(subprocess.TimeoutExpired):
                server.wait(seconds)  # it ends by itself where something is wrong
            subprocess.run([CLARUS, "control", stream], check=True)
        with contextlib.suppress(subprocess.TimeoutExpired):
            server.wait(30)  # it ends when the game has closed its stream
    print(f"{len(os.listdir(folder))} pictures in {folder}")


def resized(image, width, height, filtername):
    height_before, width_before, channels = image.shape
    buffer = oiio.ImageBuf(oiio.ImageSpec(width_before, height_before, channels, "float"))
    buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(image, np.float32))
    roi = oiio.ROI(0, width, 0, height, 0, 1, 0, channels)
    return oiio.ImageBufAlgo.resize(buffer, filtername, roi=roi).get_pixels(oiio.FLOAT)


def colors_of(motion):
    """Grey where nothing moves; the direction as hue, full at 12 pixels a frame."""
    motion = np.nan_to_num(motion)
    angle = np.arctan2(motion[:, :, 1], motion[:, :, 0])
    strength = np.minimum(np.hypot(motion[:, :, 0], motion[:, :, 1]) / 12, 1)
    return 0.5 + 0.5 * np.stack([strength * np.cos(angle - turn * np.pi * 2 / 3) for turn in range(3)], axis=2)


def part_of(image, corner):
    if not corner:
        return image
    scale = image.shape[1] // WIDTH
    left, top = scale * corner[0], scale * corner[1]
    return image[top : top + scale * HEIGHT // 4, left : left + scale * WIDTH // 4]


def make_sheet(sequence, upscaled, rows, path):
    """Input, what became of it, and motion: a row each of `rows`."""
    lines = []
    for frame, corner in rows:
        color = read(sequence, f"color/{frame:04}.png")[:, :, :3]
        images = color, read(upscaled, f"{frame:04}.png"), colors_of(read(sequence, f"motion/{frame:04}.exr"))
        parts = [part_of(image, corner) for image in images]
        # Pixels stay to be seen where they become larger.
        filters = ["lanczos3" if part.shape[1] > 640 else "box" for part in parts]
        lines.append([resized(part, 640, 360, filtername) for part, filtername in zip(parts, filters)])
    picture = np.clip(np.concatenate([np.concatenate(line, axis=1) for line in lines]), 0, 1).astype(np.float32)
    specification = oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, "uint8")
    specification.attribute("Compression", "jpeg:80")
    image = oiio.ImageOutput.create(path)
    if not image or not image.open(path, specification):
        raise SystemExit(f"games: cannot write {path}: {oiio.geterror()}")
    image.write_image(np.ascontiguousarray(picture))
    image.close()
    print(f"{path}: input, {MODEL}, motion")


def main():
    parser = argparse.ArgumentParser(description="Play games before clarus serve and before record.py.")
    parser.add_argument("folder")
    parser.add_argument("games", nargs="*", metavar="GAME", help=f"of {', '.join(GAMES)}; all unless told")
    parser.add_argument("--frames", type=int, default=240, help="to record, 240 unless told, 181 at least")
    parser.add_argument("--seconds", type=float, default=20, help="to serve, 20 unless told")
    arguments = parser.parse_args()
    for name in arguments.games or GAMES:
        if name not in GAMES:
            parser.error(f"no game {name}; there are {', '.join(GAMES)}")
        game, skip, rows = GAMES[name]
        folder = os.path.join(arguments.folder, name)
        shutil.rmtree(folder, ignore_errors=True)
        sequence, upscaled = os.path.join(folder, "sequence"), os.path.join(folder, "upscaled")
        stream = f"{name}-{os.getpid()}"
        print(f"{name}: played before clarus serve", flush=True)
        serve(game, stream, os.path.join(folder, "served"), arguments.seconds)
        print(f"{name}: played once more, and recorded", flush=True)
        record(game, stream, sequence, skip, arguments.frames)
        subprocess.run([sys.executable, os.path.join(HERE, "judge_motion.py"), sequence], check=True)
        subprocess.run([CLARUS, "upscale", sequence, "--model", MODEL, "--output", upscaled], check=True)
        make_sheet(sequence, upscaled, rows, os.path.join(folder, "sheet.jpg"))


if __name__ == "__main__":
    main()
