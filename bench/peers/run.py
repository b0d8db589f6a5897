#!/usr/bin/env python3
"""Makes the peers' virtual environment where it is missing, then measures: see README.md and --help.

CLARUS_PEERS_VENV is the environment's folder, build/peers-venv unless told. With CLARUS_PEERS_TORCH=system it is made
with this Python's own packages and uses the PyTorch among them, instead of one from PyPI, which comes with gigabytes of
CUDA libraries that nothing here uses.
"""

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
TREE = HERE.parent.parent


def make_environment(folder):
    system_torch = os.environ.get("CLARUS_PEERS_TORCH") == "system"
    options = ["--system-site-packages"] if system_torch else []
    subprocess.run([sys.executable, "-m", "venv", *options, folder], check=True)
    # pnnx, ncnn's converter, asks for PyTorch only to be called from it.
    wanted = [["numpy"], ["onnx"], ["onnxruntime"], ["openvino"], ["ncnn"], ["--no-deps", "pnnx"]]
    for packages in wanted if system_torch else [*wanted, ["torch"]]:
        print(f"peers: installing {packages[-1]}", file=sys.stderr)
        # One that cannot be had is said so in the table.
        subprocess.run([folder / "bin/python", "-m", "pip", "install", "--quiet", *packages], check=False)
    needed = [folder / "bin/python", "-c", "import numpy, torch"]
    if subprocess.run(needed, stderr=subprocess.DEVNULL).returncode:
        raise SystemExit(f"peers: NumPy and PyTorch could not be installed; remove {folder} and try again")
    (folder / "complete").touch()


def main():
    folder = Path(os.environ.get("CLARUS_PEERS_VENV", TREE / "build/peers-venv"))
    if not (folder / "complete").exists():
        make_environment(folder)
    python = folder / "bin/python"
    os.environ["PYTHONPATH"] = str(TREE / "pipelines/training")
    os.execv(python, [python, HERE / "measure.py", *sys.argv[1:]])


if __name__ == "__main__":
    main()
