#!/usr/bin/env python3
"""README's pictures: bicubic, ENSS and reference beside each other, parts of them as a film and one frame as a whole.

make_film.py CLARUS DIRECTORY FILM.webp STILL.jpg [--model NAME] [--scene SCENE] [--path N] [--first-frame N]
    [--frames N] [--size WxH] [--crop X,Y,W,H]... [--still-frame NAME] [--rate FPS] [--quality Q]

DIRECTORY receives the sequence, what is made of it, and the film's frames; what is there is not made again. The film's
labels give the mean PSNR of its frames, the still's that of the frame, both of whole images. Needs Debian's
python3-openimageio, webp and fonts-dejavu-core.
"""

import argparse
import json
import os
import shutil
import sys

import numpy as np
import OpenImageIO as oiio

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "training"))

from clarus_training import evaluate  # noqa: E402

CROPS = ["40,58,160,130", "370,237,160,110"]  # cables before the sky, a wheel that turns
ZOOM, LABEL, GAP = 2, 26, 4  # pixels


def run(*words):
    return evaluate.run([str(word) for word in words])


def make(folder, *command):
    """Runs a command that writes the folder, unless it is there."""
    if not os.path.exists(folder):
        shutil.rmtree(f"{folder}.part", ignore_errors=True)
        run(*command, "--output", f"{folder}.part")
        os.rename(f"{folder}.part", folder)


def column(path, crops, label):
    """Parts of an image below each other and their label, every pixel a square."""
    image = oiio.ImageBuf(path)
    head = oiio.ImageBuf(oiio.ImageSpec(crops[0][2] * ZOOM, LABEL, 3, oiio.FLOAT))
    oiio.ImageBufAlgo.render_text(head, 2, LABEL - 8, label, 16, "DejaVuSans", (1.0, 1.0, 1.0))
    parts = [head.get_pixels(oiio.FLOAT)]
    for x, y, width, height in crops:
        part = image.get_pixels(oiio.FLOAT, oiio.ROI(x, x + width, y, y + height))
        if image.has_error:
            raise SystemExit(f"{path}: {image.geterror()}")
        parts += [part[:, :, :3].repeat(ZOOM, axis=0).repeat(ZOOM, axis=1), np.zeros((GAP, width * ZOOM, 3))]
    return np.concatenate(parts[:-1])


def beside(parts):
    gap = np.zeros((len(parts[0]), GAP, 3))
    return np.concatenate([parts[0], *(each for part in parts[1:] for each in (gap, part))], axis=1)


def write(path, picture, compression="zip"):
    image = oiio.ImageBuf(oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, oiio.UINT8))
    image.set_pixels(oiio.ROI(), np.ascontiguousarray(picture, np.float32))
    image.specmod().attribute("Compression", compression)
    if not image.write(path):
        raise SystemExit(f"{path}: {image.geterror()}")


def main():
    parser = argparse.ArgumentParser(description="Make README's moving picture and its still.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("directory")
    parser.add_argument("film", help="a WebP file")
    parser.add_argument("still", help="a JPEG file")
    parser.add_argument("--model", default="enss-m-x2", help="of scale 2")
    parser.add_argument("--scene", default="demo")
    parser.add_argument("--path", type=int, default=5)
    parser.add_argument("--first-frame", type=int, default=0)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--size", default="480x270", help="as rendered")
    parser.add_argument("--crop", action="append", help="of the output; may be repeated, all as wide as the first")
    parser.add_argument("--still-frame", default="0034", help="its name")
    parser.add_argument("--rate", type=float, default=15, help="frames a second")
    parser.add_argument("--quality", type=int, default=65, help="WebP's, to 100")
    given = parser.parse_args()
    texts = given.crop or CROPS
    crops = [[int(word) for word in text.split(",")] for text in texts]
    sequence, film = (os.path.join(given.directory, name) for name in ("sequence", "film"))
    scene = ["--scene", given.scene, "--path", given.path, "--first-frame", given.first_frame, "--frames", given.frames]
    make(sequence, given.clarus, "render", *scene, "--size", given.size, "--scale", 2)
    names = ["bicubic", given.model]
    results = [os.path.join(given.directory, name) for name in names]
    for name, folder in zip(names, results):
        make(folder, given.clarus, "upscale", sequence, "--model", name)
    sheet_file = os.path.join(given.directory, "sheet.png")
    sheet = ["--sheet", sheet_file, "--sheet-frame", given.still_frame, "--column-width", 480]
    sheet += [word for text in texts for word in ("--crop", text)]
    figures = json.loads(run(given.clarus, "compare", *results, sequence, "--json", *sheet))
    still = oiio.ImageBuf(sheet_file)
    still.specmod().attribute("Compression", "jpeg:85")
    if not still.write(given.still):
        raise SystemExit(f"{given.still}: {still.geterror()}")
    columns = [(folder, f"{name}, {of['psnr']:.1f} dB") for folder, name, of in zip(results, names, figures)]
    columns.append((os.path.join(sequence, "reference"), "reference"))
    os.makedirs(film, exist_ok=True)
    pictures = []
    for frame in sorted(os.listdir(columns[-1][0])):
        parts = [column(os.path.join(folder, frame), crops, label) for folder, label in columns]
        pictures.append(os.path.join(film, frame))
        write(pictures[-1], beside(parts))
    # Every frame is a whole one: what remains of the frame before would look like a ghost.
    options = ["-loop", 0, "-kmax", 1, "-lossy", "-q", given.quality, "-d", round(1000 / given.rate)]
    run("img2webp", *options, *pictures, "-o", given.film)


if __name__ == "__main__":
    main()
