"""Arm's published NSS v1 checkpoint as a model file: python3 -m clarus_training.import_nss FILE MODEL.safetensors."""

import argparse

import torch

from . import model_file, nss, safetensors


def read(path):
    """The tensors of a `.pt` checkpoint or a `.safetensors` file, by the names of `Nss`."""
    if path.endswith(".safetensors"):
        return {name: torch.tensor(array) for name, array in safetensors.load(path)[0].items()}
    content = torch.load(path, map_location="cpu", **({"weights_only": True} if torch.__version__ >= "2" else {}))
    return content.get("model_state_dict", content)


def convert(path, model, scale, white):
    network = nss.Nss(scale, white)
    tensors, wanted = read(path), network.state_dict()
    for name, tensor in wanted.items():
        found = tensors.get(name)
        if found is None or found.shape != tensor.shape:
            what = "is missing" if found is None else f"is {list(found.shape)}"
            raise SystemExit(f"{path}: tensor {name} {what}; NSS v1 of quality `high` has {list(tensor.shape)}")
    network.load_state_dict({name: tensors[name].float() for name in wanted})
    model_file.save(model, network)


def main():
    parser = argparse.ArgumentParser(description="Convert a published NSS v1 checkpoint, quality high, fp32.")
    parser.add_argument("checkpoint", help=".pt or .safetensors")
    parser.add_argument("model", help="the .safetensors file to write")
    parser.add_argument("--scale", type=float, default=2.0, help="from 1 to 3")
    white = "radiance of display white; inf, as published: for linear sequences"
    parser.add_argument("--white", type=float, default=float("inf"), help=white)
    arguments = parser.parse_args()
    if not 1 <= arguments.scale <= 3:
        parser.error("--scale is from 1 to 3")
    if not arguments.white >= 1:
        parser.error("--white is at least 1")
    convert(arguments.checkpoint, arguments.model, arguments.scale, arguments.white)


if __name__ == "__main__":
    main()
