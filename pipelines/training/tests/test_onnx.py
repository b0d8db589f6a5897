"""The graphs for other frameworks compute what the networks do: python3 -m unittest discover tests."""

import os
import tempfile
import unittest

import numpy as np
import torch

from clarus_training import golden, onnx

def models():
    """Of every case of the golden files that can be exported a network with random weights, and the frames' size."""
    for pipeline, cases in golden.CASES.items():
        for name, case in cases.items():
            if case.get("quantized"):
                continue
            generator = torch.Generator().manual_seed(1)
            yield name, golden.RANDOM_NETWORKS[pipeline](generator, **case), case["size"]


def graphs(network):
    """The graphs that a network has; frames of clarus and NSS, and any whose history is checked, cannot be exported."""
    alone = network.pipeline in ("clarus", "nss") or getattr(network, "checked", False)
    return {name: make for name, make in onnx.GRAPHS.items() if name == "network" or not alone}


def called(graph):
    with torch.no_grad():
        outputs = graph.module(*graph.inputs.values())
    outputs = outputs if isinstance(outputs, tuple) else (outputs,)
    return dict(zip(graph.outputs, outputs, strict=True))


class OnnxTest(unittest.TestCase):
    def test_a_frame_is_the_networks_step(self):
        for name, network, size in models():
            if "frame" not in graphs(network):
                continue
            with self.subTest(name):
                network = network.double()
                frame = onnx.smooth_frame(network, size)
                frame = frame._replace(**{key: getattr(frame, key).double() for key in ("color", "depth", "motion")})
                graph = onnx.frame_graph(network, frame)
                with torch.no_grad():
                    output, state = network.step(frame, onnx.state_after_reset(network, frame))
                outputs = called(graph)
                torch.testing.assert_close(list(outputs.values())[0][:, :3], output, rtol=0, atol=1e-9)
                state = state if isinstance(state, (tuple, list)) else [] if state is None else [state]
                for actual, expected in zip(list(outputs.values())[::-1], list(state)[::-1]):
                    torch.testing.assert_close(actual, expected, rtol=0, atol=1e-9)

    def test_a_network_says_what_its_convolutions_do(self):
        network = golden.random_srpo(torch.Generator().manual_seed(1), 2)
        graph = onnx.network_graph(network, onnx.smooth_frame(network, (10, 7)))
        seen = {}
        with torch.no_grad():
            network.step(onnx.smooth_frame(network, (10, 7))._replace(color=graph.inputs["color"]), inside=seen)
        torch.testing.assert_close(called(graph)["offsets"], seen["raw"])

    def test_graphs_run_in_onnx_runtime(self):
        try:
            import onnxruntime
        except ImportError:
            self.skipTest("there is no onnxruntime: bench/peers makes an environment that has it")
        for name, network, size in models():
            for part, make in graphs(network).items():
                with self.subTest(name, part=part), tempfile.TemporaryDirectory() as folder:
                    graph = make(network, onnx.smooth_frame(network, size))
                    path = os.path.join(folder, "graph.onnx")
                    onnx.save(path, graph)
                    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
                    known = {each.name for each in session.get_inputs()}
                    inputs = {key: tensor.numpy() for key, tensor in graph.inputs.items() if key in known}
                    for actual, expected in zip(session.run(graph.outputs, inputs), called(graph).values()):
                        np.testing.assert_allclose(actual, expected.numpy(), rtol=0, atol=1e-4)

    def test_a_quantized_network_is_refused(self):
        case = golden.CASES["stack"]["stack_int8_1x1"]
        network = golden.random_stack(torch.Generator().manual_seed(1), **case)
        with self.assertRaisesRegex(SystemExit, "quantized"):
            onnx.refuse_quantized(network)

    def test_every_graph_can_be_written(self):
        for name, network, size in models():
            for part, make in graphs(network).items():
                with self.subTest(name, part=part), tempfile.TemporaryDirectory() as folder:
                    path = os.path.join(folder, "graph.onnx")
                    onnx.save(path, make(network, onnx.smooth_frame(network, size)))
                    self.assertGreater(os.path.getsize(path), 100)


if __name__ == "__main__":
    unittest.main()
