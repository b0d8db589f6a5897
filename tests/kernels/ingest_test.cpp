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
using runtime::TensorLayout;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kMost = std::numeric_limits<float>::max();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A caller's image: `skipped` bytes before it, rows at `pitch`, components beyond the image's channels and bytes
/// between rows set to 1s.
struct RawImage {
    cl::Buffer buffer;
    cl_uint2 place;
    Planes values;  // as the format has kept them
};

/// A value of 0 … 1 as so many bits from `first` on of a pixel; returns the value that they mean.
template <typename Pixel>
float store_normalised(unsigned char* place, float value, int first, int bits) {
    const Pixel most = static_cast<Pixel>(~Pixel{0}) >> (8 * sizeof(Pixel) - bits);
    const auto level =
        static_cast<Pixel>(std::llround(value > 0 ? std::min(value, 1.0f) * static_cast<double>(most) : 0.0));
    Pixel pixel;
    std::memcpy(&pixel, place, sizeof(pixel));
    pixel = static_cast<Pixel>((pixel & ~(most << first)) | (level << first));
    std::memcpy(place, &pixel, sizeof(pixel));
    return static_cast<float>(static_cast<double>(level) / most);
}

/// A value that is not negative as a half without sign and last bits.
float store_small_float(unsigned char* place, float value, int first, int bits) {
    const half as_half = value < 0 ? 0.0f : value;
    const int left_out = 15 - bits;
    const uint32_t kept = static_cast<uint32_t>(as_half.bits() & 0x7fff) >> left_out, most = (1u << bits) - 1;
    uint32_t pixel;
    std::memcpy(&pixel, place, sizeof(pixel));
    pixel = (pixel & ~(most << first)) | kept << first;
    std::memcpy(place, &pixel, sizeof(pixel));
    half result;
    result.setBits(static_cast<uint16_t>(kept << left_out));
    return result;
}

template <typename Value>
float store_real(unsigned char* place, float value) {
    const Value stored = value;
    std::memcpy(place, &stored, sizeof(stored));
    return stored;
}

/// Component c of the pixel at `place`; returns the value that the format has kept.
float store(unsigned char* place, ImageFormat format, int c, float value) {
    switch (format.type) {
        case ElementType::u8:
            return store_normalised<uint8_t>(place + c, value, 0, 8);
        case ElementType::f16:
            return store_real<half>(place + c * sizeof(half), value);
        case ElementType::f32:
            return store_real<float>(place + c * sizeof(float), value);
        case ElementType::u16:
            return store_normalised<uint16_t>(place + c * sizeof(uint16_t), value, 0, 16);
        case ElementType::rgb10a2:
            return store_normalised<uint32_t>(place, value, 10 * c, 10);
        case ElementType::r11g11b10f:
            return store_small_float(place, value, 11 * c, c == 2 ? 10 : 11);
        case ElementType::d24:
            return store_normalised<uint32_t>(place, value, 0, 24);
    }
    throw std::logic_error("unknown element type");
}

RawImage raw_image(const Planes& image, ImageFormat format, cl_uint skipped, cl_uint gap) {
    const size_t size = pixel_bytes(format);
    RawImage raw;
    raw.values = image;
    const cl_uint pitch = static_cast<cl_uint>(image.shape.width * size) + gap;
    raw.place = {{skipped, pitch}};
    std::vector<unsigned char> bytes(skipped + static_cast<size_t>(pitch) * image.shape.height, 0xff);
    for (int c = 0; c < image.shape.channels; ++c) {
        for (int y = 0; y < image.shape.height; ++y) {
            for (int x = 0; x < image.shape.width; ++x) {
                float& value = raw.values.at(c, x, y);
                value = store(&bytes[skipped + static_cast<size_t>(y) * pitch + x * size], format, c, value);
            }
        }
    }
    const Device device = test_device();
    raw.buffer = cl::Buffer(device.context().context(), CL_MEM_READ_WRITE, bytes.size());
    device.context().queue().enqueueWriteBuffer(raw.buffer, CL_TRUE, 0, bytes.size(), bytes.data());
    return raw;
}

struct Ingested {
    Planes color, depth, motion, jitter_x, jitter_y, scale;
    cl_uint invalid = 0;
};

/// Runs ingest with those destinations that the problem has, each in a buffer of its own.
Ingested run_ingest(const runtime::IngestProblem& problem, const runtime::FrameConstants& frame, const RawImage& color,
                    const RawImage& depth, const RawImage& motion) {
    const Device device = test_device();
    ocl::Context& context = device.context();
    const std::optional<TensorLayout> layouts[] = {problem.color,    problem.depth,    problem.motion,
                                                   problem.jitter_x, problem.jitter_y, problem.scale};
    Ingested result;
    runtime::Bindings bindings;
    for (const auto& layout : layouts) bindings.inputs.push_back(layout ? upload(context, *layout) : cl::Buffer());
    bindings.resources = {color.buffer, depth.buffer, motion.buffer};
    bindings.resource_offsets = {color.place, depth.place, motion.place};
    bindings.frame = frame;
    bindings.counter = cl::Buffer(context.context(), CL_MEM_READ_WRITE, sizeof(cl_uint));
    context.queue().enqueueWriteBuffer(bindings.counter, CL_TRUE, 0, sizeof(cl_uint), &result.invalid);

    const runtime::KernelCall call = runtime::ingest(problem);
    runtime::Launch launch(runtime::Kernels(context, {&call}), call);
    launch.bind(bindings);
    launch.enqueue(context.queue());
    Planes* images[] = {&result.color,    &result.depth,    &result.motion,
                        &result.jitter_x, &result.jitter_y, &result.scale};
    for (int i = 0; i < 6; ++i)
        if (layouts[i]) *images[i] = download(context, *layouts[i], bindings.inputs[i]);
    context.queue().enqueueReadBuffer(bindings.counter, CL_TRUE, 0, sizeof(cl_uint), &result.invalid);
    return result;
}

double srgb_transfer(double v) { return v < 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

Planes expected_color(const Planes& raw, ColorSpace space, double exposure) {
    return planes(raw.shape, [&](int c, int x, int y) -> float {
        if (space == ColorSpace::srgb) return raw.at(c, x, y) > 0 ? std::min(raw.at(c, x, y), 1.0f) : 0;
        double rgb[3];
        for (int i = 0; i < 3; ++i) {
            const double v = raw.at(i, x, y);
            rgb[i] = v > 0 ? std::min<double>((std::isinf(v) ? 65504 : v) * exposure, kMost) : 0;
        }
        return static_cast<float>(srgb_transfer(rgb[c] / (1 + std::max({rgb[0], rgb[1], rgb[2]}))));
    });
}

Planes expected_depth(const Planes& raw, DepthEncoding encoding, double near_plane, double far_plane) {
    return planes(raw.shape, [&](int, int x, int y) -> float {
        if (std::isnan(raw.at(0, x, y))) return 1;
        const double v = std::clamp<double>(raw.at(0, x, y), 0, 1), n = near_plane, f = far_plane;
        if (!encoding.projective) return static_cast<float>(encoding.reversed ? 1 - v : v);
        double denominator, d;
        if (std::isinf(f)) {
            denominator = encoding.reversed ? v : 1 - v;
            d = n / denominator / (1e4 * n);
        } else {
            denominator = encoding.reversed ? n + v * (f - n) : f - v * (f - n);
            d = n * f / denominator / f;
        }
        return denominator == 0 ? 1 : static_cast<float>(std::clamp(d, 0.0, 1.0));
    });
}

StreamOptions formats(ElementType color, int color_channels, ElementType depth, int depth_channels, ElementType motion,
                      int motion_channels) {
    StreamOptions options;
    options.color_format = {color, color_channels};
    options.depth_format = {depth, depth_channels};
    options.motion_format = {motion, motion_channels};
    return options;
}

Planes some_color(graph::Shape shape, float brightest) {
    std::mt19937 random(1);
    Planes color = random_planes(shape, random, -0.1f * brightest, brightest);
    const float special[] = {kNan, kInfinity, -kInfinity, 0, 1, 65504, -0.0f, 1e-5f};
    for (size_t i = 0; i < std::min(std::size(special), color.values.size()); ++i)
        color.values[(i * 7) % color.values.size()] = special[i];
    return color;
}

Planes some_depth(graph::Shape shape) {
    std::mt19937 random(2);
    Planes depth = random_planes(shape, random);
    const float special[] = {0, 1, kNan, -1, 2, kInfinity, -kInfinity, 0.99999994f, 0.9999f, 1e-6f, 1e-30f};
    for (size_t i = 0; i < std::min(std::size(special), depth.values.size()); ++i) depth.values[i] = special[i];
    return depth;
}

/// Colour, depth, both jitters and the scale as neighbours in wider cells, as ENSS has them; motion on its own.
void check_frame(Size size, const StreamOptions& options, Storage storage, float exposure = 1) {
    const graph::Shape color_shape{3, size.height, size.width}, plane_shape{1, size.height, size.width};
    std::mt19937 random(6);
    const RawImage color = raw_image(some_color(color_shape, options.color_space == ColorSpace::linear ? 40.0f : 1.2f),
                                     options.color_format, 8, 12);
    const RawImage depth = raw_image(some_depth(plane_shape), options.depth_format, 4, 0);
    const RawImage motion =
        raw_image(random_planes({2, size.height, size.width}, random, -0.5f, 0.5f), options.motion_format, 0, 8);

    runtime::IngestProblem problem;
    problem.color = part_layout(color_shape, storage, 1, 24, 0);
    problem.depth = part_layout(plane_shape, Storage::f32, 1, 24, 3);
    problem.jitter_x = part_layout(plane_shape, storage, 1, 24, 4);
    problem.jitter_y = part_layout(plane_shape, storage, 1, 24, 5);
    problem.scale = part_layout(plane_shape, storage, 1, 24, 6);
    problem.motion = part_layout({2, size.height, size.width}, Storage::f32, 1, 4, 0);
    problem.options = &options;
    runtime::FrameConstants frame;
    frame.jitter_x = 0.25f;
    frame.jitter_y = -0.375f;
    frame.scale = 1.5f;
    frame.exposure = exposure;
    frame.depth_numerator = frame.depth_addend = 0.1f / 250;

    const Ingested result = run_ingest(problem, frame, color, depth, motion);
    const float tolerance = storage == Storage::f16 ? 1e-3f : 2e-6f;
    check_close(result.color, expected_color(color.values, options.color_space, exposure), tolerance);
    check_close(result.depth, expected_depth(depth.values, options.depth, 0.1, 250), 2e-6f);
    check_close(result.motion, motion.values, 1e-6f);
    check_close(result.jitter_x, planes(plane_shape, [](int, int, int) { return 0.25f; }), 0);
    check_close(result.jitter_y, planes(plane_shape, [](int, int, int) { return -0.375f; }), 0);
    check_close(result.scale, planes(plane_shape, [](int, int, int) { return 1.5f; }), 0);
    CHECK(result.invalid == 0);
}

}  // namespace

TEST_CASE("ingest reads every format") {
    for (const ElementType type : {ElementType::u8, ElementType::f16, ElementType::f32}) {
        CAPTURE(static_cast<int>(type));
        check_frame({37, 21}, formats(type, 4, ElementType::f32, 1, ElementType::f16, 4), Storage::f32);
    }
    check_frame({37, 21}, formats(ElementType::f32, 3, ElementType::f16, 2, ElementType::f32, 2), Storage::f16);
    check_frame({37, 21}, formats(ElementType::u16, 3, ElementType::u16, 1, ElementType::f32, 2), Storage::f32);
    check_frame({37, 21}, formats(ElementType::rgb10a2, 4, ElementType::d24, 1, ElementType::f32, 2), Storage::f32);
}

TEST_CASE("ingest tone-maps linear colour") {
    StreamOptions options = formats(ElementType::f32, 3, ElementType::f32, 1, ElementType::f32, 2);
    options.color_space = ColorSpace::linear;
    check_frame({64, 9}, options, Storage::f32);
    check_frame({64, 9}, options, Storage::f32, 0.01f);
    check_frame({64, 9}, options, Storage::f32, 1e35f);
    options.color_format = {ElementType::r11g11b10f, 3};
    check_frame({37, 21}, options, Storage::f32);
}

TEST_CASE("ingest makes depth linear") {
    const graph::Shape shape{1, 16, 16};
    for (const bool projective : {false, true}) {
        for (const bool reversed : {false, true}) {
            for (const float far_plane : {1000.0f, kInfinity}) {
                if (!projective && std::isinf(far_plane)) continue;
                CAPTURE(projective);
                CAPTURE(reversed);
                CAPTURE(far_plane);
                StreamOptions options;
                options.depth = {projective, reversed};
                const RawImage depth = raw_image(some_depth(shape), options.depth_format, 0, 0);
                runtime::IngestProblem problem;
                problem.depth = pixel_layout(shape, Storage::f32);
                problem.options = &options;
                runtime::FrameConstants frame;
                frame.depth_numerator = std::isinf(far_plane) ? 1e-4f : 0.05f / far_plane;
                frame.depth_addend = std::isinf(far_plane) ? 0 : 0.05f / far_plane;
                check_close(run_ingest(problem, frame, {}, depth, {}).depth,
                            expected_depth(depth.values, options.depth, 0.05, far_plane), 1e-6f);
            }
        }
    }
}

TEST_SUITE("small") {
    TEST_CASE("ingest marks and counts invalid motion") {
        const graph::Shape shape{2, 3, 4};  // vectors up to 5 pixels long are valid
        Planes motion{shape, std::vector<float>(shape.elements(), 0.5f)};
        const std::pair<float, float> vectors[] = {{kNan, 0},  {0, kNan},   {kInfinity, 0}, {0, -kInfinity},
                                                   {1e30f, 0}, {3, -4},     {3, 4.001f},    {-1e-30f, 0},
                                                   {-5, 0},    {2.6f, 2.6f}};
        Planes expected = motion;
        unsigned invalid = 0;
        for (int i = 0; i < 12; ++i) {
            const int x = i % 4, y = i / 4;
            if (i < static_cast<int>(std::size(vectors))) {
                motion.at(0, x, y) = vectors[i].first / 4;
                motion.at(1, x, y) = vectors[i].second / -3;
            }
            const double mx = 4.0 * motion.at(0, x, y), my = -3.0 * motion.at(1, x, y);
            const bool valid = std::isfinite(mx) && std::isfinite(my) && std::hypot(mx, my) <= 5.0001;
            invalid += valid ? 0 : 1;
            expected.at(0, x, y) = valid ? static_cast<float>(mx + 0.75) : kNan;
            expected.at(1, x, y) = valid ? static_cast<float>(my - 0.25) : kNan;
        }
        REQUIRE(invalid == 6);

        StreamOptions options;
        runtime::IngestProblem problem;
        problem.motion = pixel_layout(shape, Storage::f32);
        problem.options = &options;
        runtime::FrameConstants frame;
        frame.motion_scale_x = 4;
        frame.motion_scale_y = -3;
        frame.jitter_change_x = 0.75f;
        frame.jitter_change_y = -0.25f;
        const RawImage raw = raw_image(motion, options.motion_format, 0, 0);
        const Ingested result = run_ingest(problem, frame, {}, {}, raw);
        check_close(result.motion, expected, 1e-6f);
        CHECK(result.invalid == invalid);

        frame.reset = 1;
        CHECK(run_ingest(problem, frame, {}, {}, raw).invalid == 0);
    }

    TEST_CASE("ingest of one pixel") {
        check_frame({1, 1}, formats(ElementType::u8, 3, ElementType::f32, 1, ElementType::f32, 2), Storage::f32);
        check_frame({1, 1}, formats(ElementType::r11g11b10f, 3, ElementType::d24, 1, ElementType::f32, 2),
                    Storage::f32);
    }
}
