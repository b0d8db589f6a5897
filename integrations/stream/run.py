#!/usr/bin/env python3
"""Makes the stream's virtual environment where it is missing, then streams: see README.md and --help.

CLARUS_STREAM_VENV is the environment's folder, build/stream-venv unless told.
"""

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
TREE = HERE.parent.parent
# Below 0.6: what comes with the next one may be called otherwise.
PACKAGES = ["moq-rs>=0.5.1,<0.6"]


def make_environment(folder):
    print(f"stream: installing {', '.join(PACKAGES)}", file=sys.stderr)
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    subprocess.run([folder / "bin/python", "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    (folder / "complete").touch()


def main():
    folder = Path(os.environ.get("CLARUS_STREAM_VENV", TREE / "build/stream-venv"))
    if not (folder / "complete").exists():
        make_environment(folder)
    python = folder / "bin/python"
    os.execv(python, [python, HERE / "stream.py", *sys.argv[1:]])


if __name__ == "__main__":
    main()
