#include <doctest/doctest.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/image_format.h"
#include "operator_harness.h"
#include "runtime/inputs.h"
#include "runtime/launch.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;
using runtime::Storage;

namespace {

/// The caller's image, with gaps before its first row and after each.
class Target {
  public:
    Target(Size size, const ImageFormat& format)
        : size_(size),
          format_(format),
          row_(static_cast<cl_uint>(tight_pitch(size, format))),
          bytes_(kSkipped + static_cast<size_t>(row_ + kGap) * size.height, 0xa5),
          buffer_(context().context(), CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, bytes_.size(), bytes_.data()) {}

    void bind(runtime::Bindings& bindings) const {
        bindings.target = buffer_;
        bindings.target_offset = {{kSkipped, row_ + kGap}};
    }

    /// Components as numbers; u8 in its own units. Checks that nothing but pixels was written.
    Planes read() {
        context().queue().enqueueReadBuffer(buffer_, CL_TRUE, 0, bytes_.size(), bytes_.data());
        bool beside = false;
        for (size_t i = 0; i < bytes_.size(); ++i)
            if (i < kSkipped || (i - kSkipped) % (row_ + kGap) >= row_) beside = beside || bytes_[i] != 0xa5;
        CHECK_FALSE(beside);
        return planes({format_.channels, size_.height, size_.width}, [&](int c, int x, int y) -> float {
            const size_t element = static_cast<size_t>(x) * format_.channels + c;
            const unsigned char* place =
                &bytes_[kSkipped + static_cast<size_t>(y) * (row_ + kGap) + element * bytes_of(format_.type)];
            half as_half;
            float value;
            if (format_.type == ElementType::u8) return *place;
            std::memcpy(&as_half, place, 2);
            if (format_.type == ElementType::f16) return as_half;
            std::memcpy(&value, place, 4);
            return value;
        });
    }

  private:
    static constexpr cl_uint kSkipped = 16, kGap = 12;
    static ocl::Context& context() { return test_device().context(); }

    Size size_;
    ImageFormat format_;
    cl_uint row_;
    std::vector<unsigned char> bytes_;
    cl::Buffer buffer_;
};

Planes run_present(const Planes& output, const runtime::TensorLayout& layout, const StreamOptions& options,
                   float exposure) {
    const Device device = test_device();
    ocl::Context& context = device.context();
    Target target({output.shape.width, output.shape.height}, options.output_format);
    runtime::Bindings bindings;
    bindings.inputs = {upload(context, layout, &output)};
    bindings.frame.exposure = exposure;
    target.bind(bindings);
    const runtime::KernelCall call = runtime::present(layout, options);
    runtime::Launch launch(runtime::Kernels(context, {&call}), call);
    launch.bind(bindings);
    launch.enqueue(context.queue());
    return target.read();
}

double inverse_transfer(double v) { return v < 12.92 * 0.0031308 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double transfer(double v) { return v < 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

double unit(double v) { return v > 0 ? std::min(v, 1.0) : 0; }

/// What the target should hold, before it is stored.
Planes expected_target(const Planes& output, const StreamOptions& options, double exposure) {
    graph::Shape shape = output.shape;
    shape.channels = options.output_format.channels;
    return planes(shape, [&](int c, int x, int y) -> float {
        if (c == 3) return output.shape.channels == 4 ? static_cast<float>(unit(output.at(3, x, y))) : 1.0f;
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

/// That this is what was shown of the output.
void check_shown(const Planes& result, const Planes& output, const StreamOptions& options, Storage storage) {
    const Planes expected = expected_target(output, options, 1);
    const ElementType type = options.output_format.type;
    if (type == ElementType::u8) {
        for (size_t i = 0; i < expected.values.size(); ++i)
            CHECK(std::abs(result.values[i] - 255 * expected.values[i]) <= 0.5001f);
    } else {
        check_close(result, rounded(expected, storage), type == ElementType::f16 ? 1e-3f : 1e-6f);
    }
}

void check_display(ImageFormat format, Storage storage, int block, graph::Shape shape) {
    CAPTURE(static_cast<int>(format.type));
    StreamOptions options;
    options.output_format = format;
    const Planes output = some_output(shape, storage);
    const auto layout = part_layout(shape, storage, block, shape.channels * block * block + 1, 1);
    check_shown(run_present(output, layout, options, 1), output, options, storage);
}

/// A program that copies an image in blocks, of which it presents `shown` channels, does what present() does of the
/// copy, to the last bit.
void check_presented(ImageFormat format, int block, int copy_block, graph::Shape shape, int first = 0, int shown = 3) {
    CAPTURE(static_cast<int>(format.type));
    CAPTURE(format.channels);
    StreamOptions options;
    options.output_format = format;
    const Planes image = some_output(shape, Storage::f32);
    const Planes output =
        planes({shown, shape.height, shape.width}, [&](int c, int x, int y) { return image.at(first + c, x, y); });
    runtime::Problem problem;
    problem.node = {graph::Pointwise{{}, {0}}, {}, shape, "program"};
    problem.inputs = {part_layout(shape, Storage::f32, block, shape.channels * block * block, 0)};
    problem.output = part_layout(shape, Storage::f32, copy_block, 4 * copy_block * copy_block, 0);
    problem.presented = runtime::Presented{first, shown, format};
    const Planes expected = run_present(output, pixel_layout(output.shape, Storage::f32), options, 1);
    const Device device = test_device();
    ocl::Context& context = device.context();
    for (const runtime::Implementation& implementation : runtime::implementations(problem.node)) {
        if (implementation.preference(problem, device.profile()) == 0) continue;
        for (const runtime::Choices& choices : implementation.choices(problem, device.profile())) {
            Target target({shape.width, shape.height}, format);
            runtime::Bindings bindings;
            bindings.inputs = {upload(context, problem.inputs[0], &image)};
            bindings.output = upload(context, problem.output);
            target.bind(bindings);
            const runtime::KernelCall call = implementation.lower(problem, choices).call;
            runtime::Launch launch(runtime::Kernels(context, {&call}), call);
            launch.bind(bindings);
            launch.enqueue(context.queue());
            check_close(target.read(), expected, 0);
            check_close(download(context, problem.output, bindings.output), image, 0);
        }
    }
}

}  // namespace

TEST_CASE("present writes every format") {
    for (const ElementType type : {ElementType::u8, ElementType::f16, ElementType::f32}) {
        check_display({type, 3}, Storage::f32, 1, {3, 18, 34});
        check_display({type, 4}, Storage::f16, 2, {3, 18, 34});
        check_display({type, 4}, Storage::f32, 1, {4, 18, 35});
        check_display({type, 4}, Storage::f32, 2, {4, 18, 34});
    }
}

TEST_CASE("a program presents what it has made as present does") {
    for (const ElementType type : {ElementType::u8, ElementType::f16, ElementType::f32}) {
        for (const int channels : {3, 4}) {
            check_presented({type, channels}, 1, 1, {3, 7, 69});
            check_presented({type, channels}, 2, 1, {4, 10, 154});
            check_presented({type, channels}, 2, 2, {4, 18, 34}, 1);
        }
        check_presented({type, 3}, 3, 3, {3, 9, 33});
        check_presented({type, 4}, 4, 1, {4, 8, 36}, 1);
        check_presented({type, 4}, 1, 1, {4, 7, 69}, 0, 4);
        check_presented({type, 4}, 2, 1, {4, 10, 154}, 0, 4);
        check_presented({type, 4}, 3, 3, {4, 9, 33}, 0, 4);
    }
}

TEST_CASE("present turns display values back into light") {
    StreamOptions options;
    options.color_space = ColorSpace::linear;
    const graph::Shape shape{3, 20, 65};
    const Planes output = some_output(shape, Storage::f32);
    for (const float exposure : {1.0f, 0.125f, 100.0f}) {
        const Planes result = run_present(output, pixel_layout(shape, Storage::f32), options, exposure);
        const Planes expected = expected_target(output, options, exposure);
        // Compared as display values (docs/conventions.md, "Colour"): light near the limit magnifies any rounding.
        const auto displayed = [&](const Planes& light) {
            return planes(shape, [&](int c, int x, int y) {
                const double most = exposure * std::max({light.at(0, x, y), light.at(1, x, y), light.at(2, x, y)});
                return static_cast<float>(transfer(exposure * light.at(c, x, y) / (1 + most)));
            });
        };
        check_close(displayed(result), displayed(expected), 2e-6f);
        for (const float v : result.values) CHECK(std::isfinite(v));
    }

    graph::Shape with_alpha = shape;
    with_alpha.channels = 4;
    const Planes four = some_output(with_alpha, Storage::f32);
    options.output_format = {ElementType::f32, 4};
    const Planes result = run_present(four, pixel_layout(with_alpha, Storage::f32), options, 0.5f);
    for (int y = 0; y < shape.height; ++y)
        for (int x = 0; x < shape.width; ++x) CHECK(result.at(3, x, y) == static_cast<float>(unit(four.at(3, x, y))));

    options.output_format = {ElementType::f16, 3};
    for (const float v : run_present(output, pixel_layout(shape, Storage::f32), options, 1e-3f).values)
        CHECK(v <= 65504);
}

TEST_SUITE("small") {
    TEST_CASE("present of one pixel") {
        check_display({ElementType::u8, 4}, Storage::f32, 1, {3, 1, 1});
        check_display({ElementType::f32, 3}, Storage::f16, 1, {3, 1, 1});
        check_display({ElementType::f32, 4}, Storage::f32, 1, {4, 1, 1});
        check_presented({ElementType::u8, 3}, 1, 1, {4, 1, 1}, 1);
    }
}
