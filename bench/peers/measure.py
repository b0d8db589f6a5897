"""Prepares, takes turns, prints: run.py starts this in the virtual environment. What is measured: README.md."""

import argparse
import json
import math
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import table
from compare import difference
from turns import Process, take_turns

HERE = Path(__file__).parent
TREE = HERE.parent.parent
PEERS = {"onnxruntime": "ONNX Runtime", "openvino": "OpenVINO", "ncnn": "ncnn", "pytorch": "PyTorch"}
# Stages between the convolutions that the peers' networks hold, too.
NETWORK_STAGE = re.compile(r"convolution|^(features|reweight|unet)|^(relu|tanh|sigmoid|prelu|depth_to_space) \d")


def shipped():
    return {path.stem: path for path in sorted(TREE.glob("pipelines/*/weights/*.safetensors"))}


def one_of_each():
    """For every pipeline with weights one model: medium, and of scale 2, where there is such."""
    best = {}
    for name, path in shipped().items():
        key = ("-m-" not in name, "x2" not in name, name)
        best[path.parent] = min(best.get(path.parent, (key, name)), (key, name))
    return [name for _, name in best.values()]


def chosen_models(names):
    known = shipped()
    for name in {"default": one_of_each(), "all": list(known)}.get(names[0], names):
        path = known.get(name, Path(name))
        if not path.is_file():
            raise SystemExit(f"peers: {name}: neither a file nor one of {', '.join(known)}")
        yield path.resolve()


def prepare(model, output, folder):
    """The case of a model, its graphs in `folder`."""
    from clarus_training import safetensors

    scale = int(safetensors.load(model)[1]["scale"])
    width, height = (int(extent) // scale for extent in output.split("x"))
    subprocess.run([sys.executable, HERE / "prepare.py", model, f"{width}x{height}", folder], check=True)
    return json.loads((folder / "case.json").read_text())


def start_clarus(tool, device, precision, case, folder):
    """The process, and an entry with the device and how far its output is from PyTorch's."""
    size, jitter = case["size"], case["jitter"]
    process = Process([tool, device, precision, case["model"], *size, *jitter, folder], threads=1)
    if "error" in process.about or "error" in (checked := process.ask("check")):
        return process, {"error": process.about.get("error") or checked["error"]}
    expected = np.load(folder / "expected.npy")
    actual = np.fromfile(folder / "clarus.f32", np.float32).reshape(*expected.shape[1:], 3).transpose(2, 0, 1)
    return process, {"difference": difference([(actual, expected)]), **process.about}


def clarus_seconds(part, answer):
    if part == "frame":
        return answer["seconds"]
    stages = [stage["seconds"] for stage in answer["stages"] if NETWORK_STAGE.search(stage["name"])]
    if not stages:
        raise SystemExit("peers: no stage of Clarus's is called as a network's are; see NETWORK_STAGE")
    return sum(stages)


def measure(part, case, folder, clarus, entry, options):
    """A result as table.py has it, of a model's network or frame."""
    threads = options.threads or entry.get("threads") or os.cpu_count()
    entries = {"Clarus": dict(entry)}
    for together in [[name] for name in options.peers] if options.in_pairs else [options.peers]:
        workers = {name: [sys.executable, HERE / "worker.py", name, folder / part, threads, options.precision]
                   for name in together}  # fmt: skip
        peers = {PEERS[name]: Process(command, threads) for name, command in workers.items()}
        entries.update({name: dict(process.about) for name, process in peers.items()})
        running = {name: process for name, process in peers.items() if "error" not in process.about}
        if "error" not in entries["Clarus"]:
            running["Clarus"] = clarus
        answers, failed = take_turns(running, options.seconds, time.monotonic)
        for process in peers.values():
            process.close()
        seconds = {name: [clarus_seconds(part, answer) if name == "Clarus" else answer["seconds"] for answer in given
                          if "error" not in answer] for name, given in answers.items()}  # fmt: skip
        for name, taken in seconds.items():
            entries[name].update(failed.get(name, {"seconds": entries[name].get("seconds", []) + taken}))
            if name != "Clarus":
                entries[name]["beside"] = seconds.get("Clarus", [])
    own = entries.pop("Clarus")
    return {"model": Path(case["model"]).name.removesuffix(".safetensors"), "part": part, "size": case["size"],
            "scale": case["scale"], "numbers": "int8" if case["quantized"] else options.precision, "threads": threads,
            "clarus": own, "peers": entries}  # fmt: skip


def finite(value):
    """The same with null in place of numbers that JSON does not know."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def main():
    parser = argparse.ArgumentParser(prog="./run peers", description="Clarus and its peers on the same networks.")
    parser.add_argument("--models", nargs="+", default=["default"],
                        help="shipped ones, files, or `all`; unless told, one of every pipeline")  # fmt: skip
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=list(PEERS))
    parser.add_argument("--parts", nargs="+", choices=table.PARTS, default=list(table.PARTS))
    parser.add_argument("--precision", choices=("fp32", "bf16"), default="fp32",
                        help="bf16: of Clarus, OpenVINO, ncnn and PyTorch, on processors that have it")  # fmt: skip
    parser.add_argument("--output", default="1920x1080", metavar="WxH", help="the size of the output")
    parser.add_argument("--device", default="cpu", help="Clarus's, as `clarus devices` has them")
    parser.add_argument("--threads", type=int, help="the peers'; unless told, the device's compute units")
    parser.add_argument("--seconds", type=float, default=15, help="for the turns of a network or frame")
    parser.add_argument("--in-pairs", action="store_true",
                        help="every peer takes turns with Clarus alone: less memory, more time")  # fmt: skip
    parser.add_argument("--tool", default=TREE / "build/bin/clarus_turn", help="the program that runs Clarus's frames")
    parser.add_argument("--work", type=Path, default=TREE / "build/peers", help="a folder for graphs")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--markdown", action="store_true", help="print the table for a README")
    options = parser.parse_args()

    busy = os.getloadavg()[0]
    if busy > 0.5:
        print(f"peers: the machine has other work (load {busy:.1f}): figures will be unsteady", file=sys.stderr)
    results = []
    for model in chosen_models(options.models):
        folder = options.work / model.name
        print(f"peers: {model.name}", file=sys.stderr)
        case = prepare(model, options.output, folder)
        clarus, entry = start_clarus(options.tool, options.device, options.precision, case, folder)
        for part in options.parts:
            if part in case["left_out"]:
                print(f"peers: {model.name} {part}: left out: {case['left_out'][part]}", file=sys.stderr)
            else:
                results.append(measure(part, case, folder, clarus, entry, options))
        clarus.close()
    versions = {entry["version"] for result in results for entry in result["peers"].values() if "version" in entry}
    devices = {result["clarus"]["device"] for result in results if "device" in result["clarus"]}
    threads = sorted({result["threads"] for result in results})
    print(", ".join(sorted(versions)))
    print(f"Clarus on {', '.join(devices)}; {threads[0]} threads; output {options.output}")
    print()
    print(table.markdown(results) if options.markdown else table.text(results))
    if options.json:
        part = options.json.with_name(f"{options.json.name}.part")
        part.write_text(json.dumps({"version": 1, "output": options.output, "results": finite(results)}, indent=1))
        part.replace(options.json)


if __name__ == "__main__":
    main()
