#include "api/memory_checks.h"

#include <limits>
#include <optional>
#include <string>

#include "base/error.h"
#include "base/image_format.h"
#include "cl/error.h"

namespace clarus {
namespace {

/// Asks for what OpenCL says of a memory object. False: the handle is of none.
template <typename Answer>
bool ask(std::string_view name, cl_mem memory, cl_mem_info what, Answer& answer) {
    const cl_int status = clGetMemObjectInfo(memory, what, sizeof(answer), &answer, nullptr);
    if (status != CL_SUCCESS && status != CL_INVALID_MEM_OBJECT)
        ocl::fail_with_status(fmt::format("ask for the memory of frame.{}", name), status);
    return status == CL_SUCCESS;
}

template <typename Answer>
Answer of_image(std::string_view name, cl_mem image, cl_image_info what) {
    Answer answer{};
    const cl_int status = clGetImageInfo(image, what, sizeof(answer), &answer, nullptr);
    if (status != CL_SUCCESS) ocl::fail_with_status(fmt::format("ask for the image object of frame.{}", name), status);
    return answer;
}

/// `kind` as in "a buffer".
void check_memory(std::string_view name, cl_mem memory, cl_context context, cl_mem_object_type wanted,
                  std::string_view kind) {
    if (!context)
        fail(ErrorKind::invalid_argument, "frame.{}: {}, and the devices at work share no context; give host memory",
             name, kind);
    cl_context owner = nullptr;
    cl_mem_object_type type = 0;
    const bool known = ask(name, memory, CL_MEM_CONTEXT, owner) && ask(name, memory, CL_MEM_TYPE, type);
    if (!known || owner != context || type != wanted)
        fail(ErrorKind::invalid_argument, "frame.{}: not {} of the upscaler's context{}", name, kind,
             !known || type == wanted        ? ""
             : type == CL_MEM_OBJECT_BUFFER  ? ", but a buffer"
             : type == CL_MEM_OBJECT_IMAGE2D ? ", but an image object"
                                             : ", but another kind of image object");
}

std::optional<ElementType> element_type(cl_channel_type type) {
    switch (type) {
        case CL_UNORM_INT8:
            return ElementType::u8;
        case CL_UNORM_INT16:
            return ElementType::u16;
        case CL_HALF_FLOAT:
            return ElementType::f16;
        case CL_FLOAT:
            return ElementType::f32;
        default:
            return std::nullopt;
    }
}

/// 0 of an order that has its components otherwise than they are read here.
int channels_in_order(cl_channel_order order) {
    switch (order) {
        case CL_R:
        case CL_DEPTH:
            return 1;
        case CL_RG:
            return 2;
        case CL_RGBA:
        case CL_sRGBA:
            return 4;
        default:
            return 0;
    }
}

}  // namespace

void check_buffer(std::string_view name, const Image& image, const ImageFormat& format, cl_context context, Use use) {
    check_memory(name, image.buffer, context, CL_MEM_OBJECT_BUFFER, "a buffer");
    size_t size = 0;
    cl_mem_flags flags = 0;
    ask(name, image.buffer, CL_MEM_SIZE, size);
    ask(name, image.buffer, CL_MEM_FLAGS, flags);
    if (use == Use::output && (flags & CL_MEM_READ_ONLY))
        fail(ErrorKind::invalid_argument, "frame.{}: the buffer is CL_MEM_READ_ONLY", name);
    if (use == Use::input && (flags & CL_MEM_WRITE_ONLY))
        fail(ErrorKind::invalid_argument, "frame.{}: the buffer is CL_MEM_WRITE_ONLY", name);
    const size_t first = first_byte(image, format);
    const size_t bytes = row_pitch(image, format) * (image.size.height - 1) + tight_pitch(image.size, format);
    if (bytes > size || first > size - bytes)
        fail(ErrorKind::invalid_argument, "frame.{}: the buffer has {} bytes; {} at offset {} are needed", name, size,
             bytes, first);
    if (first > std::numeric_limits<cl_uint>::max())
        fail(ErrorKind::invalid_argument, "frame.{}: offset {} is beyond 4 GiB; make a sub-buffer", name, first);
}

void check_image_object(std::string_view name, const Image& image, const ImageFormat& format, cl_context context) {
    check_memory(name, image.image, context, CL_MEM_OBJECT_IMAGE2D, "a 2D image object");
    if (image.row_pitch != 0 || image.offset != 0)
        fail(ErrorKind::invalid_argument, "frame.{}: row_pitch and offset are not for image objects", name);
    const auto stored = of_image<cl_image_format>(name, image.image, CL_IMAGE_FORMAT);
    const int channels = channels_in_order(stored.image_channel_order);
    if (channels == 0)
        fail(ErrorKind::invalid_argument,
             "frame.{}: the image object's channel order is {:#x}; R, RG, RGBA, sRGBA and DEPTH are possible", name,
             stored.image_channel_order);
    const std::optional<ElementType> type = element_type(stored.image_channel_data_type);
    if (!type)
        fail(ErrorKind::invalid_argument,
             "frame.{}: the image object's components are of type {:#x}; CL_UNORM_INT8, CL_UNORM_INT16, CL_HALF_FLOAT "
             "and CL_FLOAT are possible",
             name, stored.image_channel_data_type);
    if (format != ImageFormat{*type, channels})
        fail(ErrorKind::invalid_argument,
             "frame.{}: the image object has {} channels of {}, the options' format has {} of {}", name, channels,
             element_name(*type), format.channels, element_name(format.type));
    const auto width = of_image<size_t>(name, image.image, CL_IMAGE_WIDTH);
    const auto height = of_image<size_t>(name, image.image, CL_IMAGE_HEIGHT);
    const auto beyond = [](int origin, int side, size_t whole) {
        return static_cast<size_t>(origin) + static_cast<size_t>(side) > whole;
    };
    if (beyond(image.origin.x, image.size.width, width) || beyond(image.origin.y, image.size.height, height))
        fail(ErrorKind::invalid_argument, "frame.{}: the image object is {}x{}; {}x{} at ({}, {}) are needed", name,
             width, height, image.size.width, image.size.height, image.origin.x, image.origin.y);
}

}  // namespace clarus
