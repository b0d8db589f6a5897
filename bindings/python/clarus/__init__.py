"""Neural supersampling on any OpenCL device. docs/python.md describes it; each function has its own help."""

from clarus._clarus import (
    BuildError,
    Device,
    DeviceError,
    DeviceProfile,
    Error,
    FileError,
    Finding,
    InvalidArgumentError,
    Model,
    NoDeviceError,
    OutOfMemoryError,
    PipelineOption,
    Upscaler,
    cache_directory,
    check,
    devices,
    halton_jitter,
    jitter_count,
    mip_bias,
    mnss_jitter,
    models,
    psnr,
    quality_modes,
    quality_render_size,
    quality_scale,
    random_jitter,
    ssim,
)
from clarus._clarus import version as __version__
from clarus.picture import Picture

__all__ = [
    "BuildError",
    "Device",
    "DeviceError",
    "DeviceProfile",
    "Error",
    "FileError",
    "Finding",
    "InvalidArgumentError",
    "Model",
    "NoDeviceError",
    "OutOfMemoryError",
    "Picture",
    "PipelineOption",
    "Upscaler",
    "__version__",
    "cache_directory",
    "check",
    "devices",
    "halton_jitter",
    "jitter_count",
    "mip_bias",
    "mnss_jitter",
    "models",
    "psnr",
    "quality_modes",
    "quality_render_size",
    "quality_scale",
    "random_jitter",
    "ssim",
]

# Tracebacks and help name a class as programs do.
for _thing in list(globals().values()):
    if isinstance(_thing, type) and _thing.__module__ == "clarus._clarus":
        _thing.__module__ = "clarus"
del _thing
