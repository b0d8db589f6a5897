"""Training of Clarus's pipelines in PyTorch: networks, data, losses, export, evaluation, golden outputs."""
