#include "arrays.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <string>
#include <vector>

#include "api/stored_values.h"
#include "clarus/error.h"

namespace nb = nanobind;

namespace clarus::python {
namespace {

struct Element {
    const char* name;  // NumPy's
    ElementType type;
    nb::dlpack::dtype dlpack;
};

const std::array<Element, 4> elements{{
    {"float32", ElementType::f32, nb::dtype<float>()},
    {"float16", ElementType::f16, {static_cast<uint8_t>(nb::dlpack::dtype_code::Float), 16, 1}},
    {"uint8", ElementType::u8, nb::dtype<uint8_t>()},
    {"uint16", ElementType::u16, nb::dtype<uint16_t>()},
}};

[[noreturn]] void refuse(std::string_view argument, const std::string& reason) {
    throw Error(ErrorKind::invalid_argument, fmt::format("{}: {}", argument, reason));
}

std::string name_of(nb::dlpack::dtype type) {
    for (const Element& element : elements)
        if (element.dlpack == type) return element.name;
    constexpr std::array<const char*, 7> kinds{"int", "uint", "float", "opaque", "bfloat", "complex", "bool"};
    return type.code < kinds.size() ? fmt::format("{}{}", kinds[type.code], type.bits) : "of an unknown type";
}

const Element& element_of(std::string_view argument, nb::dlpack::dtype type) {
    for (const Element& element : elements)
        if (element.dlpack == type) return element;
    refuse(argument, fmt::format("{}; there are float32, float16, uint8, uint16", name_of(type)));
}

const Element& element_of(ElementType type) {
    for (const Element& element : elements)
        if (element.type == type) return element;
    refuse("format", "an element type that Python's arrays do not have");
}

template <typename Array>
void check(std::string_view argument, const Array& array, const ImageFormat& format, Size size) {
    if (array.device_type() != nb::device::cpu::value) refuse(argument, "on another device; give host memory");
    const Element& element = element_of(format.type);
    if (array.dtype() != element.dlpack)
        refuse(argument, fmt::format("{}, but this Upscaler was made for {}; its {}_format says which",
                                     name_of(array.dtype()), element.name, argument == "out" ? "output" : argument));
    std::vector<size_t> shape(array.ndim());
    for (size_t i = 0; i < shape.size(); ++i) shape[i] = array.shape(i);
    const std::vector<size_t> expected{static_cast<size_t>(size.height), static_cast<size_t>(size.width),
                                       static_cast<size_t>(format.channels)};
    const bool is_plane = format.channels == 1 && shape == std::vector(expected.begin(), expected.end() - 1);
    if (shape != expected && !is_plane)
        refuse(argument, fmt::format("shape ({}), expected ({}): rows, columns, channels", fmt::join(shape, ", "),
                                     fmt::join(expected, ", ")));
}

/// Whether each row is without a gap, and rows follow each other.
template <typename Array>
bool has_whole_rows(const Array& array, const ImageFormat& format, Size size) {
    if (array.ndim() == 3 && format.channels > 1 && array.stride(2) != 1) return false;
    if (size.width > 1 && array.stride(1) != format.channels) return false;
    return size.height == 1 || array.stride(0) >= static_cast<int64_t>(size.width) * format.channels;
}

template <typename Array>
Image image_of(const Array& array, Size size) {
    Image image;
    image.host = const_cast<void*>(static_cast<const void*>(array.data()));
    image.size = size;
    if (size.height > 1) image.row_pitch = static_cast<size_t>(array.stride(0)) * array.itemsize();
    return image;
}

}  // namespace

ImageFormat format_of(std::string_view argument, const Format& words) {
    for (const Element& element : elements)
        if (words.first == element.name) return {element.type, words.second};
    refuse(argument,
           fmt::format("there is no element type \"{}\"; there are float32, float16, uint8, uint16", words.first));
}

Input input_of(std::string_view argument, nb::handle object, const ImageFormat& format, Size size) {
    if (object.is_none()) return {};
    Input input;
    if (!nb::try_cast(object, input.array))
        refuse(argument, "neither an array with __dlpack__ nor one with the buffer protocol");
    check(argument, input.array, format, size);
    if (!has_whole_rows(input.array, format, size)) {
        nb::ndarray<nb::ro, nb::c_contig> copy;
        if (!nb::try_cast(object, copy))
            refuse(argument, "its pixels are not beside each other, and it cannot be copied; make it contiguous");
        input.array = nb::ndarray<nb::ro>(copy);
    }
    input.image = image_of(input.array, size);
    return input;
}

Image output_of(std::string_view argument, nb::handle object, const ImageFormat& format, Size size) {
    nb::ndarray<> array;
    if (!nb::try_cast(object, array)) refuse(argument, "not an array that can be written");
    check(argument, array, format, size);
    if (!has_whole_rows(array, format, size))
        refuse(argument, "its pixels are not beside each other; make it contiguous");
    return image_of(array, size);
}

io::Pixels values_of(std::string_view argument, nb::handle object, int channels) {
    nb::ndarray<nb::ro> array;
    if (!nb::try_cast(object, array))
        refuse(argument, "neither an array with __dlpack__ nor one with the buffer protocol");
    const bool is_image = array.ndim() == 3 || (array.ndim() == 2 && channels == 1);
    if (!is_image || array.size() == 0)
        refuse(argument, fmt::format("must be rows x columns x {}, and not empty", channels));
    const ImageFormat format{element_of(argument, array.dtype()).type, channels};
    const Size size{static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0))};
    const Input input = input_of(argument, object, format, size);
    return host_values(input.image, format, channels);
}

nb::object new_array(const ImageFormat& format, Size size) {
    return nb::module_::import_("numpy").attr("empty")(nb::make_tuple(size.height, size.width, format.channels),
                                                       element_of(format.type).name);
}

}  // namespace clarus::python
