#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <string_view>
#include <utility>

#include "clarus/types.h"
#include "io/image.h"

namespace clarus::python {

/// (width, height), as all sizes are told in Python.
using Pair = std::pair<int, int>;
/// (element type, channels): ("uint8", 4).
using Format = std::pair<std::string, int>;

/// The format of these words. Errors: invalid_argument, naming `argument`.
ImageFormat format_of(std::string_view argument, const Format& words);

/// An array that the device reads, and what keeps its memory.
struct Input {
    nanobind::ndarray<nanobind::ro> array;
    Image image;
};

/// Of an object with `__dlpack__` or the buffer protocol, rows × columns × channels, or rows × columns where there is
/// one channel. Its memory is used as it is, unless pixels are not beside each other. None: an empty image. Errors:
/// invalid_argument, naming `argument`.
Input input_of(std::string_view argument, nanobind::handle object, const ImageFormat& format, Size size);

/// The same of what the device writes. Errors likewise, also where it would have to be copied or is read-only.
Image output_of(std::string_view argument, nanobind::handle object, const ImageFormat& format, Size size);

/// What an array of so many channels holds, of any of these types and any size, as numbers: integers over their
/// largest, floats as they are. Errors: as input_of's.
io::Pixels values_of(std::string_view argument, nanobind::handle object, int channels);

/// A new NumPy array.
nanobind::object new_array(const ImageFormat& format, Size size);

}  // namespace clarus::python
