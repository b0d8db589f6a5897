"""The pipelines that can be trained, by name.

Each is a module with
- `shape(arguments)`: what its network is made of, as keywords; `create(**shape)`: a network to be trained;
- `ABLATIONS`, where experiments may leave something out: names for `create(without=…)`, whose networks are no models;
- `parameter_groups(network, arguments)`: for the optimiser; a group's `share` scales its learning rate;
- `CLIPS`: the lengths of the clips it learns from; `RATE`: its first learning rate;
- `serves(asked, scale)`, where a network learns from sequences of other scales than the one asked for, too;
- `loss(network, frames, reference, criterion, progress)`: of a clip that starts with a reset, by `criterion` where one
  is given, else by its own, the paper's as far as it can be had; `progress` goes from 0 to 1 as training does;
- `model_tensors(network, jitters, mlp, half)` and `load_model(tensors, metadata)`: a model file's content, and back;
  where they are missing, that is the scale and the tensors as the network calls them.

A network has `pipeline`, its model files'; `scale`; `ahead(frames)`, one value a frame of whatever needs no history;
where history may be checked, `place(ahead)`, the history.Place of it; and `step(frame, state, ahead, inside)`, which
returns the output [N, 3, H, W] and the new state.
"""

from . import clarus, enss, mnss, nsrr, nss, srpo, stack_training

PIPELINES = {
    "clarus": clarus,
    "enss": enss,
    "mnss": mnss,
    "nsrr": nsrr,
    "nss": nss,
    "srpo": srpo,
    "stack": stack_training,
}
ABLATIONS = {name: module.ABLATIONS for name, module in PIPELINES.items() if hasattr(module, "ABLATIONS")}
