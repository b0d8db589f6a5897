#pragma once

#include <cstddef>

typedef struct _cl_mem* cl_mem;
typedef struct _cl_event* cl_event;

namespace clarus {

struct Size {
    int width = 0;
    int height = 0;
    friend bool operator==(const Size&, const Size&) = default;
};

/// A pixel's place: columns from the left, rows from the top.
struct Position {
    int x = 0;
    int y = 0;
    friend bool operator==(const Position&, const Position&) = default;
};

struct Vec2 {
    float x = 0;
    float y = 0;
    friend bool operator==(const Vec2&, const Vec2&) = default;
};

/// How a pixel's components are stored. u8 and u16 are normalised: 255 and 65535 are 1. The last three hold a pixel in
/// 32 bits, its first component in the lowest, and are read, not written.
enum class ElementType {
    u8,
    f16,
    f32,
    u16,
    rgb10a2,     // 4 channels: 10, 10, 10 and 2 bits, normalised
    r11g11b10f,  // 3 channels: floats of 11, 11 and 10 bits without sign
    d24          // 1 channel: depth in the low 24 bits, normalised; those above, a stencil, are skipped
};

struct ImageFormat {
    ElementType type = ElementType::f32;
    int channels = 0;  // components a pixel, interleaved; those beyond what is needed are skipped
    friend bool operator==(const ImageFormat&, const ImageFormat&) = default;
};

/// An image in host memory, in a buffer object or in an image object; exactly one of `host`, `buffer` and `image` is
/// set. Its format is that of the upscaler's options.
struct Image {
    void* host = nullptr;     // first pixel, at origin {0, 0}; only read where the image is an input
    cl_mem buffer = nullptr;  // an OpenCL buffer of the upscaler's context
    /// A 2D image object of the upscaler's context, of which level 0 is used, as a texture imported from OpenGL is one.
    /// Components as the format says, u8, u16, f16 or f32 (CL_UNORM_INT8, CL_UNORM_INT16, CL_HALF_FLOAT, CL_FLOAT), 1,
    /// 2 or 4 channels in the order R, RG or RGBA; sRGBA is display-encoded u8, CL_DEPTH has 1 channel. It is copied on
    /// the device, for kernels here read buffers.
    cl_mem image = nullptr;
    size_t offset = 0;     // bytes from the start of `buffer` to the first pixel
    size_t row_pitch = 0;  // bytes from row to row of `host` or `buffer`; 0 where rows follow each other without a gap
    Size size;             // pixels
    Position origin{};     // where the image begins within a larger one, that of `row_pitch` or `image`, in pixels

    bool empty() const { return !host && !buffer && !image; }
};

/// How intermediates are stored. With fp16, a device that has half arithmetic may be given convolutions that multiply
/// in half, sums of more than 72 products staying in float; others compute in float. `automatic` takes fp16 where the
/// device has half arithmetic, else fp32. bf16 stores as fp32 does; convolutions that are faster so multiply what they
/// have rounded to bfloat16 (8 bits of mantissa), with sums in float, on devices that can (DeviceProfile::bf16).
enum class Precision { fp32, fp16, automatic, bf16 };

/// How kernel variants are chosen: `stored` takes what earlier measurements on this device found and, where there is
/// none, what comes with Clarus for its class; `measure` first measures what is not stored; `fixed` takes what comes
/// with Clarus only; `obvious` takes the simplest kernel of every operator, to check the others by.
enum class Tuning { stored, measure, fixed, obvious };

}  // namespace clarus
