"""The peers: each takes a graph's folder, inputs and threads, and computes without spinning, in "fp32" or "bf16".

`run()` computes once, `outputs()` are the arrays of the last run by name. `version` says what it is, `way` how it was
set up where there is a choice. An Unable says what of the graph the peer cannot express.
"""

import functools
import importlib.metadata
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np


class Unable(Exception):
    pass


class OnnxRuntime:
    def __init__(self, folder, inputs, names, threads, precision):
        if precision != "fp32":
            raise Unable(f"has no convolutions in {precision}")
        import onnxruntime

        self.version = f"ONNX Runtime {onnxruntime.__version__}"
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        options.log_severity_level = 3
        self.session = onnxruntime.InferenceSession(folder / "graph.onnx", options, ["CPUExecutionProvider"])
        self.binding = self.session.io_binding()
        known = {each.name for each in self.session.get_inputs()}
        for name, array in inputs.items():
            if name in known:
                self.binding.bind_ortvalue_input(name, onnxruntime.OrtValue.ortvalue_from_numpy(array))
        self.results = {}
        for each in self.session.get_outputs():
            self.results[each.name] = onnxruntime.OrtValue.ortvalue_from_shape_and_type(each.shape, np.float32)
            self.binding.bind_ortvalue_output(each.name, self.results[each.name])

    def run(self):
        self.session.run_with_iobinding(self.binding)

    def outputs(self):
        return {name: value.numpy() for name, value in self.results.items()}


class OpenVino:
    def __init__(self, folder, inputs, names, threads, precision):
        import openvino

        self.version = f"OpenVINO {openvino.__version__.split('-')[0]}"
        settings = {
            "INFERENCE_PRECISION_HINT": {"fp32": "f32", "bf16": "bf16"}[precision],
            "INFERENCE_NUM_THREADS": threads,
            "NUM_STREAMS": 1,
            "PERFORMANCE_HINT": "LATENCY",
        }
        compiled = openvino.Core().compile_model(folder / "graph.onnx", "CPU", settings)
        self.request = compiled.create_infer_request()
        self.names = names
        for port in compiled.inputs:
            # Besides its own name a port has those of whatever was found to do nothing to it.
            array = next(inputs[name] for name in port.names if name in inputs)
            self.request.set_tensor(port, openvino.Tensor(array, shared_memory=True))

    def run(self):
        self.request.infer()

    def outputs(self):
        return {name: self.request.get_tensor(name).data for name in self.names}


class Ncnn:
    def __init__(self, folder, inputs, names, threads, precision):
        import ncnn

        self.version = f"ncnn {importlib.metadata.version('ncnn')}"
        shapes = ",".join(str(list(array.shape)).replace(" ", "") for array in inputs.values())
        tool = Path(sys.executable).with_name("pnnx")
        said = subprocess.run([tool, "graph.onnx", f"inputshape={shapes}", "fp16=0"], cwd=folder, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)  # fmt: skip
        parameters = folder / "graph.ncnn.param"
        if said.returncode or not parameters.exists():
            raise Unable(f"pnnx cannot convert the graph ({said.stdout.strip().splitlines()[-1:]})")
        self.net = ncnn.Net()
        options = self.net.opt
        options.num_threads, options.openmp_blocktime = threads, 0
        options.use_vulkan_compute = False
        for name in dir(options):
            if name.startswith(("use_fp16_", "use_bf16_", "use_int8_")):
                setattr(options, name, precision == "bf16" and name.startswith("use_bf16_"))
        layers = sorted({line.split()[0] for line in parameters.read_text().splitlines()[2:]})
        missing = [layer for layer in layers if ncnn.layer_to_index(layer) < 0]
        if missing:
            raise Unable(f"ncnn has no layer for {', '.join(missing)}")
        if self.net.load_param(str(parameters)):
            raise Unable("ncnn cannot load the graph")
        self.net.load_model(str(parameters.with_suffix(".bin")))
        mats = [ncnn.Mat(array[0]) for array in inputs.values()]
        self.inputs = {f"in{i}": mat for i, mat in enumerate(mats) if f"in{i}" in self.net.input_names()}
        self.names, self.results = names, {}

    def run(self):
        extractor = self.net.create_extractor()
        for name, mat in self.inputs.items():
            extractor.input(name, mat)
        for i, name in enumerate(self.names):
            failed, self.results[name] = extractor.extract(f"out{i}")
            if failed:
                raise Unable(f"ncnn cannot compute {name}")

    def outputs(self):
        return {name: np.array(mat)[None] for name, mat in self.results.items()}


class PyTorch:
    """The fastest of its ways."""

    def __init__(self, folder, inputs, names, threads, precision):
        import torch

        from clarus_training import model_file, onnx

        torch.set_num_threads(threads)
        torch.set_float32_matmul_precision("highest")
        torch.set_grad_enabled(False)
        self.precision = torch.autocast("cpu", torch.bfloat16, enabled=precision == "bf16", cache_enabled=False)
        case = json.loads((folder.parent / "case.json").read_text())
        network = model_file.load(case["model"], simulated=True)
        graph = onnx.GRAPHS[folder.name](network, onnx.smooth_frame(network, case["size"]))
        tensors = [torch.from_numpy(array) for array in inputs.values()]
        module = graph.module.eval()
        channels_last = [
            tensor.contiguous(memory_format=torch.channels_last) if tensor.ndim == 4 else tensor for tensor in tensors
        ]
        trace = functools.partial(torch.jit.trace, module, tuple(tensors), check_trace=False)
        ways = {
            "op by op": lambda: (module, tensors),
            "op by op, channels last": lambda: (module, channels_last),
            "traced, frozen, optimised": lambda: (
                torch.jit.optimize_for_inference(torch.jit.freeze(trace())),
                tensors,
            ),
        }
        if os.environ.get("CLARUS_PEERS_TORCH_COMPILE"):
            ways["compiled"] = lambda: (torch.compile(module), tensors)
        self.version, self.names = f"PyTorch {torch.__version__}", names
        timed, failed = {}, []
        for name, make in ways.items():
            try:
                with self.precision:
                    timed[name] = self.time(make())
            except Exception as error:  # its optimiser does not take every graph
                failed.append(f"{name}: {error}")
        if not timed:
            raise Unable("; ".join(failed))
        self.way = min(timed, key=lambda name: timed[name][0])
        self.call = timed[self.way][1]

    @staticmethod
    def time(call):
        module, tensors = call
        for _ in range(3):  # the profiling executor looks at two runs before it compiles
            start = time.perf_counter()
            module(*tensors)
            seconds = time.perf_counter() - start
            if seconds > 1:
                break  # long enough to tell the ways apart
        return seconds, call

    def run(self):
        module, tensors = self.call
        with self.precision:
            results = module(*tensors)
        self.results = results if isinstance(results, tuple) else (results,)

    def outputs(self):
        return {name: tensor.float().numpy() for name, tensor in zip(self.names, self.results)}


PEERS = {"onnxruntime": OnnxRuntime, "openvino": OpenVino, "ncnn": Ncnn, "pytorch": PyTorch}
