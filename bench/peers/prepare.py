"""prepare.py MODEL WIDTHxHEIGHT FOLDER: a model's graphs, and what goes in and has to come out of them.

FOLDER gets the frame for Clarus, color.f32, depth.f32 and motion.f32, with expected.npy, what comes out of it after a
reset by the same frame; and in folders `network` and `frame` each a graph.onnx with inputs.npz and outputs.npz. What is
expected PyTorch computed op by op in single precision. case.json says what model of which pipeline, size and jitter it
is, and why a part has no graph, where it has none.
"""

import json
import sys
from pathlib import Path

import numpy as np
import torch

from clarus_training import model_file, onnx
from clarus_training.quantized import SimulatedConv2d


def main(model, size, folder):
    torch.set_float32_matmul_precision("highest")
    network = model_file.load(model, simulated=True)
    onnx.refuse_quantized(network)
    size = [int(extent) for extent in size.split("x")]
    frame = onnx.smooth_frame(network, size)
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("color", "depth", "motion"):
        getattr(frame, name)[0].permute(1, 2, 0).contiguous().numpy().tofile(folder / f"{name}.f32")
    with torch.inference_mode():
        np.save(folder / "expected.npy", network.step(frame, network.step(frame)[1])[0][0].numpy())
    left_out = {}
    for part, make in onnx.GRAPHS.items():
        try:
            graph = make(network, frame)
        except onnx.Unexportable as reason:
            left_out[part] = str(reason)
            continue
        (folder / part).mkdir(exist_ok=True)
        with torch.inference_mode():
            outputs = graph.module(*graph.inputs.values())
        outputs = outputs if isinstance(outputs, tuple) else (outputs,)
        np.savez(folder / part / "inputs.npz", **{name: tensor.numpy() for name, tensor in graph.inputs.items()})
        np.savez(folder / part / "outputs.npz", **{name: each.numpy() for name, each in zip(graph.outputs, outputs)})
        onnx.save(str(folder / part / "graph.onnx"), graph)
    quantized = any(isinstance(module, SimulatedConv2d) for module in network.modules())
    case = dict(model=model, quantized=quantized, pipeline=network.pipeline, scale=network.scale, size=size,
                jitter=frame.jitter, left_out=left_out)  # fmt: skip
    (folder / "case.json").write_text(json.dumps(case))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
