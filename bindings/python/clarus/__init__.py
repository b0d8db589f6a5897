"""Neural supersampling on any OpenCL device. docs/python.md describes it; each function has its own help."""

from clarus._clarus import (
    BuildError,
    Device,
    DeviceError,
    DeviceProfile,
    Error,
    FileError,
    InvalidArgumentError,
    Model,
    NoDeviceError,
    OutOfMemoryError,
    PipelineOption,
    Upscaler,
    cache_directory,
    devices,
    halton_jitter,
    mnss_jitter,
    models,
    random_jitter,
)
from clarus._clarus import version as __version__

__all__ = [
    "BuildError",
    "Device",
    "DeviceError",
    "DeviceProfile",
    "Error",
    "FileError",
    "InvalidArgumentError",
    "Model",
    "NoDeviceError",
    "OutOfMemoryError",
    "PipelineOption",
    "Upscaler",
    "__version__",
    "cache_directory",
    "devices",
    "halton_jitter",
    "mnss_jitter",
    "models",
    "random_jitter",
]

# Tracebacks and help name a class as programs do.
for _thing in list(globals().values()):
    if isinstance(_thing, type) and _thing.__module__ == "clarus._clarus":
        _thing.__module__ = "clarus"
del _thing
