"""PSNR of a model and of bicubic as the clarus program computes them.

python3 -m clarus_training.evaluate CLARUS MODEL SEQUENCE... [--device SELECTOR]
"""

import argparse
import json
import subprocess
import tempfile


def measure(clarus, sequence, model, options):
    """The report of `clarus compare` on what `clarus upscale` makes of a sequence."""
    with tempfile.TemporaryDirectory() as output:
        upscale = [clarus, "upscale", sequence, "--model", model, "--output", output, *options]
        subprocess.run(upscale, check=True, stdout=subprocess.DEVNULL)
        report = subprocess.run(
            [clarus, "compare", output, sequence, "--json"], check=True, stdout=subprocess.PIPE, text=True
        )
    return json.loads(report.stdout)


def main():
    parser = argparse.ArgumentParser(description="PSNR of a model and of bicubic, from the clarus program.")
    parser.add_argument("clarus", help="the clarus program")
    parser.add_argument("model", help="a model's name or file")
    parser.add_argument("sequences", nargs="+")
    parser.add_argument("--device", default="auto")
    arguments = parser.parse_args()
    options = ["--device", arguments.device]
    gains = []
    for sequence in arguments.sequences:
        ours = measure(arguments.clarus, sequence, arguments.model, options)
        bicubic = measure(arguments.clarus, sequence, "bicubic", options)
        gains.append(ours["psnr"] - bicubic["psnr"])
        print(
            f"{sequence}: {ours['psnr']:.2f} dB, SSIM {ours['ssim']:.4f}; "
            f"bicubic {bicubic['psnr']:.2f} dB, SSIM {bicubic['ssim']:.4f}; {gains[-1]:+.2f} dB"
        )
    print(f"mean gain {sum(gains) / len(gains):+.2f} dB")


if __name__ == "__main__":
    main()
