#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "base/image_format.h"
#include "cl/context.h"
#include "clarus/upscaler.h"
#include "test_device.h"

using namespace clarus;

namespace {

const Size kRender{13, 9}, kOutput{26, 18};
const Size kBeyond{3, 2};  // what image objects have more than the image
const Position kCorner{2, 1};

struct Format {
    ImageFormat stored;
    cl::ImageFormat opencl;
};

const Format kRgbaHalf{{ElementType::f16, 4}, {CL_RGBA, CL_HALF_FLOAT}};
const Format kRgbaFloat{{ElementType::f32, 4}, {CL_RGBA, CL_FLOAT}};
const Format kRgbaBytes{{ElementType::u8, 4}, {CL_RGBA, CL_UNORM_INT8}};
const Format kRgbaShorts{{ElementType::u16, 4}, {CL_RGBA, CL_UNORM_INT16}};

/// Halves of which all are finite, for every other type a number as well.
std::vector<uint16_t> noise(size_t bytes, unsigned seed) {
    std::vector<uint16_t> values(bytes / 2);
    for (uint16_t& value : values)
        value = static_cast<uint16_t>(0x3000 + (seed = seed * 1664525 + 1013904223) / 0x40000 % 0xc00);
    return values;
}

cl::Image2D image_object(const Format& format, Size size, const std::vector<uint16_t>& inner) {
    const ocl::Context& context = test_device().context();
    const cl::Image2D image(context.context(), CL_MEM_READ_WRITE, format.opencl, size.width + kBeyond.width,
                            size.height + kBeyond.height);
    context.queue().enqueueFillImage(
        image, cl_float4{{0.25f, 0.25f, 0.25f, 0.25f}}, {0, 0, 0},
        {static_cast<size_t>(size.width + kBeyond.width), static_cast<size_t>(size.height + kBeyond.height), 1});
    if (!inner.empty())
        context.queue().enqueueWriteImage(
            image, CL_TRUE, {static_cast<size_t>(kCorner.x), static_cast<size_t>(kCorner.y), 0},
            {static_cast<size_t>(size.width), static_cast<size_t>(size.height), 1}, 0, 0, inner.data());
    context.queue().finish();
    return image;
}

/// All of an image object.
std::vector<float> pixels_of(const cl::Image2D& image, Size size) {
    std::vector<float> pixels(4 * static_cast<size_t>(size.width) * size.height);
    test_device().context().queue().enqueueReadImage(
        image, CL_TRUE, {0, 0, 0}, {static_cast<size_t>(size.width), static_cast<size_t>(size.height), 1}, 0, 0,
        pixels.data());
    return pixels;
}

}  // namespace

TEST_CASE("image objects give what host memory gives, and keep what is around the image" *
          doctest::test_suite("small")) {
    if (!test_device().is_one_context() || !test_device().profile().images) return;
    for (const Format& color : {kRgbaHalf, kRgbaFloat, kRgbaBytes, kRgbaShorts}) {
        CAPTURE(static_cast<int>(color.stored.type));
        UpscalerOptions options;
        options.color_format = color.stored;
        options.depth_format = kRgbaShorts.stored;
        options.motion_format = kRgbaHalf.stored;
        options.output_format = kRgbaFloat.stored;
        Upscaler by_host(test_device(), Model::filter("fsr2", 2), kRender, options);
        Upscaler by_image(test_device(), Model::filter("fsr2", 2), kRender, options);
        const Size whole{kOutput.width + kBeyond.width, kOutput.height + kBeyond.height};
        const cl::Image2D shown = image_object(kRgbaFloat, kOutput, {});
        for (unsigned t = 0; t < 3; ++t) {
            std::vector<uint16_t> pixels[3] = {noise(tight_bytes(kRender, color.stored), t),
                                               noise(tight_bytes(kRender, options.depth_format), 50 + t),
                                               noise(tight_bytes(kRender, options.motion_format), 90 + t)};
            const cl::Image2D images[3] = {image_object(color, kRender, pixels[0]),
                                           image_object(kRgbaShorts, kRender, pixels[1]),
                                           image_object(kRgbaHalf, kRender, pixels[2])};
            std::vector<float> expected(4 * static_cast<size_t>(kOutput.width) * kOutput.height);
            FrameDescription frame;
            const auto all = [&](auto&& image) {
                frame.color = image(0), frame.depth = image(1), frame.motion = image(2);
            };
            all([&](int i) { return Image{.host = pixels[i].data(), .size = kRender}; });
            frame.output = {.host = expected.data(), .size = kOutput};
            by_host.submit(frame).wait();
            all([&](int i) { return Image{.image = images[i](), .size = kRender, .origin = kCorner}; });
            frame.output = {.image = shown(), .size = kOutput, .origin = kCorner};
            by_image.submit(frame).wait();

            const std::vector<float> got = pixels_of(shown, whole);
            int differing = 0;
            for (int y = 0; y < whole.height; ++y)
                for (int x = 0; x < whole.width; ++x)
                    for (int c = 0; c < 4; ++c) {
                        const int inner_x = x - kCorner.x, inner_y = y - kCorner.y;
                        const bool inside =
                            inner_x >= 0 && inner_y >= 0 && inner_x < kOutput.width && inner_y < kOutput.height;
                        const float wanted = inside ? expected[4 * (inner_y * kOutput.width + inner_x) + c] : 0.25f;
                        differing += got[4 * (y * whole.width + x) + c] != wanted;
                    }
            CHECK(differing == 0);
        }
    }
}
