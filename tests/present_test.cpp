#include <doctest/doctest.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "operator_harness.h"
#include "runtime/inputs.h"
#include "runtime/launch.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

/// The target's components as numbers; u8 in its own units. Checks that nothing but pixels was written.
Planes run_present(const Planes& output, const runtime::TensorLayout& layout, const UpscalerOptions& options,
                   float exposure) {
    const Device device = test_device();
    ocl::Context& context = device.context();
    const ImageFormat format = options.output_format;
    const size_t size = format.type == ElementType::u8 ? 1 : format.type == ElementType::f16 ? 2 : 4;
    const int width = output.shape.width, height = output.shape.height;
    const cl_uint skipped = 16, row = static_cast<cl_uint>(width * format.channels * size), pitch = row + 12;
    std::vector<unsigned char> bytes(skipped + static_cast<size_t>(pitch) * height, 0xa5);

    runtime::Bindings bindings;
    bindings.inputs = {upload(context, layout, &output)};
    bindings.frame.exposure = exposure;
    bindings.target = cl::Buffer(context.context(), CL_MEM_READ_WRITE, bytes.size());
    bindings.target_offset = {{skipped, pitch}};
    context.queue().enqueueWriteBuffer(bindings.target, CL_TRUE, 0, bytes.size(), bytes.data());
    const runtime::KernelCall call = runtime::present(layout, options);
    runtime::Launch launch(runtime::Kernels(context, {&call}), call);
    launch.bind(bindings);
    launch.enqueue(context.queue());
    context.queue().enqueueReadBuffer(bindings.target, CL_TRUE, 0, bytes.size(), bytes.data());

    bool beside = false;
    for (size_t i = 0; i < bytes.size(); ++i)
        if (i < skipped || (i - skipped) % pitch >= row) beside = beside || bytes[i] != 0xa5;
    CHECK_FALSE(beside);
    return planes({format.channels, height, width}, [&](int c, int x, int y) -> float {
        const unsigned char* place =
            &bytes[skipped + static_cast<size_t>(y) * pitch + (x * format.channels + c) * size];
        half as_half;
        float value;
        if (format.type == ElementType::u8) return *place;
        std::memcpy(&as_half, place, 2);
        if (format.type == ElementType::f16) return as_half;
        std::memcpy(&value, place, 4);
        return value;
    });
}

double inverse_transfer(double v) { return v < 12.92 * 0.0031308 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double transfer(double v) { return v < 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

double unit(double v) { return v > 0 ? std::min(v, 1.0) : 0; }

/// What the target should hold, before it is stored.
Planes expected_target(const Planes& output, const UpscalerOptions& options, double exposure) {
    graph::Shape shape = output.shape;
    shape.channels = options.output_format.channels;
    return planes(shape, [&](int c, int x, int y) -> float {
        if (c == 3) return 1;
        if (options.color_space == ColorSpace::srgb) return static_cast<float>(unit(output.at(c, x, y)));
        double rgb[3];
        for (int i = 0; i < 3; ++i) rgb[i] = inverse_transfer(unit(output.at(i, x, y)));
        const double most = std::max({rgb[0], rgb[1], rgb[2]}), limit = 1 - std::ldexp(1, -12);
        const double shrink = most > limit ? limit / most : 1;
        return static_cast<float>(shrink * rgb[c] / (1 - shrink * most) / exposure);
    });
}

Planes some_output(graph::Shape shape, Storage storage) {
    std::mt19937 random(12);
    Planes output = random_planes(shape, random, -0.1f, 1.1f);
    const float special[] = {std::numeric_limits<float>::quiet_NaN(), 1,    0, 0.02f, 0.5f / 255, 0.999f,
                             std::numeric_limits<float>::infinity(),  -0.0f};
    for (size_t i = 0; i < std::min(std::size(special), output.values.size()); ++i) output.values[i] = special[i];
    return rounded(output, storage);
}

void check_display(ImageFormat format, Storage storage, int block, graph::Shape shape) {
    CAPTURE(static_cast<int>(format.type));
    UpscalerOptions options;
    options.output_format = format;
    const Planes output = some_output(shape, storage);
    const auto layout = part_layout(shape, storage, block, 3 * block * block + 1, 1);
    const Planes expected = expected_target(output, options, 1);
    if (format.type == ElementType::u8) {
        const Planes result = run_present(output, layout, options, 1);
        for (size_t i = 0; i < expected.values.size(); ++i)
            CHECK(std::abs(result.values[i] - 255 * expected.values[i]) <= 0.5001f);
    } else {
        check_close(run_present(output, layout, options, 1), rounded(expected, storage),
                    format.type == ElementType::f16 ? 1e-3f : 1e-6f);
    }
}

}  // namespace

TEST_CASE("present writes every format") {
    for (const ElementType type : {ElementType::u8, ElementType::f16, ElementType::f32}) {
        check_display({type, 3}, Storage::f32, 1, {3, 18, 34});
        check_display({type, 4}, Storage::f16, 2, {3, 18, 34});
    }
}

TEST_CASE("present turns display values back into light") {
    UpscalerOptions options;
    options.color_space = ColorSpace::linear;
    const graph::Shape shape{3, 20, 65};
    const Planes output = some_output(shape, Storage::f32);
    for (const float exposure : {1.0f, 0.125f, 100.0f}) {
        const Planes result = run_present(output, pixel_layout(shape, Storage::f32), options, exposure);
        const Planes expected = expected_target(output, options, exposure);
        // Compared as display values (conventions.md): light near the limit magnifies any rounding.
        const auto displayed = [&](const Planes& light) {
            return planes(shape, [&](int c, int x, int y) {
                const double most = exposure * std::max({light.at(0, x, y), light.at(1, x, y), light.at(2, x, y)});
                return static_cast<float>(transfer(exposure * light.at(c, x, y) / (1 + most)));
            });
        };
        check_close(displayed(result), displayed(expected), 2e-6f);
        for (const float v : result.values) CHECK(std::isfinite(v));
    }

    options.output_format = {ElementType::f16, 3};
    for (const float v : run_present(output, pixel_layout(shape, Storage::f32), options, 1e-3f).values)
        CHECK(v <= 65504);
}

TEST_SUITE("small") {
    TEST_CASE("present of one pixel") {
        check_display({ElementType::u8, 4}, Storage::f32, 1, {3, 1, 1});
        check_display({ElementType::f32, 3}, Storage::f16, 1, {3, 1, 1});
    }
}
