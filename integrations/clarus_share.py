"""clarus/share.h for Python, by ctypes: what the programs of this folder need of it. Images are NumPy arrays."""

import ctypes
import os
from ctypes import POINTER, Structure, byref, c_char_p, c_float, c_int, c_size_t, c_uint64, c_void_p

import numpy as np

TREE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
KINDS = 10
COLOR, DEPTH, MOTION = range(3)
OK, TIMED_OUT, ENDED, GONE = 0, 6, 8, 9
TYPES = [np.uint8, np.float16, np.float32, np.uint16]  # the others are packed


class Format(Structure):
    _fields_ = [("type", c_int), ("channels", c_int)]


class Resource(Structure):
    _fields_ = [("format", Format), ("width", c_int), ("height", c_int), ("row_pitch", c_size_t)]


class Description(Structure):
    _fields_ = [
        ("resources", Resource * KINDS),
        ("slots", c_int),
        ("policy", c_int),
        ("linear_color", c_int),
        ("depth_projective", c_int),
        ("depth_reversed", c_int),
        ("motion_scale_x", c_float),
        ("motion_scale_y", c_float),
        ("motion_jittered", c_int),
        ("motion_sampled_at_jitter", c_int),
        ("scale", c_float),
        ("output_width", c_int),
        ("output_height", c_int),
        ("dynamic_resolution", c_int),
        ("user_bytes", c_size_t),
    ]


class Image(Structure):
    _fields_ = [
        ("pixels", c_void_p),
        ("row_pitch", c_size_t),
        ("format", Format),
        ("width", c_int),
        ("height", c_int),
    ]

    def array(self):
        """The image where it lies, [height, width, channels]. Errors: ValueError for pixels that are packed."""
        if self.format.type >= len(TYPES):
            raise ValueError(f"pixels of element type {self.format.type} are packed, which NumPy has no type for")
        kind = np.dtype(TYPES[self.format.type])
        memory = (ctypes.c_char * (self.row_pitch * self.height)).from_address(self.pixels)
        strides = (self.row_pitch, kind.itemsize * self.format.channels, kind.itemsize)
        return np.ndarray((self.height, self.width, self.format.channels), kind, memory, strides=strides)


class Frame(Structure):
    _fields_ = [
        ("images", Image * KINDS),
        ("user", c_void_p),
        ("user_bytes", c_size_t),
        ("slot", c_int),
        ("number", c_uint64),
        ("width", c_int),
        ("height", c_int),
        ("jitter_x", c_float),
        ("jitter_y", c_float),
        ("exposure", c_float),
        ("near_plane", c_float),
        ("far_plane", c_float),
        ("fov_y", c_float),
        ("frame_seconds", c_float),
        ("motion_scale_x", c_float),
        ("motion_scale_y", c_float),
        ("reset", c_int),
        ("has_matrices", c_int),
        ("view", c_float * 16),
        ("projection", c_float * 16),
    ]


class ShareError(Exception):
    def __init__(self, status):
        super().__init__(library().clarus_share_last_error().decode())
        self.status = status


_library = None


def library():
    """libclarus_share: CLARUS_SHARE_LIBRARY, or the one that was built here."""
    global _library
    if not _library:
        built = os.path.join(TREE, "build/host/libclarus_share.so")
        loaded = ctypes.CDLL(os.environ.get("CLARUS_SHARE_LIBRARY", built))
        loaded.clarus_share_last_error.restype = c_char_p
        loaded.clarus_share_default_description.restype = Description
        loaded.clarus_share_reader_description.restype = POINTER(Description)
        for name in ("close", "reader_close"):
            getattr(loaded, f"clarus_share_{name}").restype = None
        _library = loaded
    return _library


def _call(name, *arguments):
    status = getattr(library(), f"clarus_share_{name}")(*arguments)
    if status != OK:
        raise ShareError(status)


class Stream:
    """A renderer's side: `with Stream(name, description) as stream:`, then `begin` and `end` once a frame."""

    def __init__(self, name, description):
        self._handle = c_void_p()
        _call("open", name.encode(), byref(description), byref(self._handle))

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if not kind:
            _call("drain", self._handle, 60000)
        library().clarus_share_close(self._handle)

    def begin(self, timeout_ms=60000):
        frame = Frame()
        _call("begin", self._handle, timeout_ms, byref(frame))
        return frame

    def end(self, frame):
        _call("end", self._handle, byref(frame))


class Reader:
    """An upscaler's side. Iterating waits for frames, each there until the next is asked for, until the stream ends."""

    def __init__(self, name, timeout_ms=60000):
        self._handle = c_void_p()
        _call("reader_open", name.encode(), byref(self._handle))
        _call("reader_connect", self._handle, timeout_ms)
        self.description = library().clarus_share_reader_description(self._handle).contents

    def __enter__(self):
        return self

    def __exit__(self, *_):
        library().clarus_share_reader_close(self._handle)

    def __iter__(self):
        while True:
            frame = Frame()
            try:
                _call("reader_wait", self._handle, 60000, byref(frame))
            except ShareError as error:
                if error.status in (ENDED, GONE):
                    return
                raise
            yield frame
            _call("reader_release", self._handle)
