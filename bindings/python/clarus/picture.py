"""Pictures that notebooks show."""

import os
import struct
import zlib

import numpy
import numpy.typing

from clarus._clarus import InvalidArgumentError


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


class Picture:
    """Display values, rows x columns x 3 or 4 (or rows x columns, which are gray), as a picture: notebooks show it.

    Floats are from 0 to 1, and what is beyond is clamped; uint8 is taken as it is. Raises InvalidArgumentError.
    """

    def __init__(self, array: numpy.typing.ArrayLike) -> None:
        array = numpy.asarray(array)
        kinds = {(2,): 0, (3, 1): 0, (3, 3): 2, (3, 4): 6}
        kind = kinds.get((array.ndim, *array.shape[2:]))
        if kind is None or 0 in array.shape or not (array.dtype == numpy.uint8 or array.dtype.kind == "f"):
            raise InvalidArgumentError(
                f"array: {array.dtype} of shape {array.shape}; wanted are floats or uint8, rows x columns x 1, 3 or 4"
            )
        if array.dtype != numpy.uint8:
            array = (numpy.clip(numpy.nan_to_num(array.astype(numpy.float32)), 0, 1) * 255 + 0.5).astype(numpy.uint8)
        height, width = array.shape[:2]
        rows = numpy.zeros((height, 1 + array.size // height), numpy.uint8)  # each begins with its filter: none
        rows[:, 1:] = array.reshape(height, -1)
        self._png = b"".join((
            b"\x89PNG\r\n\x1a\n",
            _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)),
            _chunk(b"IDAT", zlib.compress(rows.tobytes(), 1)),
            _chunk(b"IEND", b""),
        ))
        self._text = f"<clarus.Picture {width}x{height}>"

    def _repr_png_(self) -> bytes:
        return self._png

    def __repr__(self) -> str:
        return self._text

    def save(self, path: str | os.PathLike[str]) -> None:
        """As a PNG file."""
        unfinished = f"{os.fspath(path)}.{os.getpid()}.partial"
        try:
            with open(unfinished, "xb") as file:
                file.write(self._png)
            os.replace(unfinished, path)
        except BaseException:
            if os.path.exists(unfinished):
                os.remove(unfinished)
            raise
