#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "api/stored_values.h"
#include "base/image_format.h"
#include "clarus/error.h"
#include "clarus/log.h"
#include "clarus/upscaler.h"
#include "io/frames.h"
#include "program.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;

// docs/checking.md, "In the library".
namespace {

constexpr Size kRender{160, 96};

struct Film {
    io::Sequence sequence;
    std::vector<io::FramePixels> frames;
};

const Film& film() {
    static const Film rendered = [] {
        const TemporaryFolder folder;
        const std::string sequence = folder / "sequence";
        test::Program program(CLARUS_TOOL, {"render", "--size", "160x96", "--frames", "9", "--no-reference",
                                            "--threads", "1", "-o", sequence});
        REQUIRE(program.result() == 0);
        Film made{io::read_sequence(sequence), {}};
        for (size_t i = 0; i < made.sequence.frames.size(); ++i)
            made.frames.push_back(io::read_frame(made.sequence, i, true, false));
        return made;
    }();
    return rendered;
}

class Warnings {
  public:
    Warnings() {
        set_log_callback([this](LogLevel level, std::string_view text) {
            const std::lock_guard lock(mutex_);
            if (level == LogLevel::warning) all_.emplace_back(text);
        });
    }
    ~Warnings() { set_log_callback({}); }
    std::vector<std::string> all() const {
        const std::lock_guard lock(mutex_);
        return all_;
    }

  private:
    mutable std::mutex mutex_;
    std::vector<std::string> all_;
};

UpscalerOptions right_options() {
    UpscalerOptions options;
    options.color_space = film().sequence.color_space;
    options.depth = film().sequence.depth;
    options.motion = film().sequence.motion_encoding();
    options.diagnose = true;
    return options;
}

using Change = std::function<void(FrameDescription&)>;

/// What is said of the first `count` frames.
std::vector<std::string> said(
    const UpscalerOptions& options, const Change& change = [](FrameDescription&) {}, size_t count = 8,
    const std::string& filter = "fsr2") {
    const Warnings warnings;
    {
        Upscaler upscaler(test_device(), Model::filter(filter, 2), kRender, options);
        std::vector<float> output(3 * 4 * kRender.width * kRender.height);
        const auto image = [](const io::Pixels& pixels) {
            return Image{.host = const_cast<float*>(pixels.values.data()), .size = pixels.size};
        };
        for (size_t i = 0; i < count; ++i) {
            const io::FramePixels& pixels = film().frames[i];
            FrameDescription frame;
            static_cast<FrameParameters&>(frame) = film().sequence.frames[i];
            frame.color = image(pixels.color);
            frame.depth = image(pixels.depth);
            frame.motion = image(pixels.motion);
            frame.output = {.host = output.data(), .size = upscaler.output_size()};
            change(frame);
            upscaler.submit(frame).wait();
        }
    }
    return warnings.all();
}

void check_names(const std::vector<std::string>& warnings, const std::string& field) {
    REQUIRE(warnings.size() == 1);
    CHECK_MESSAGE(warnings[0].find("options.diagnose: in the first frames, " + field) == 0, warnings[0]);
}

}  // namespace

TEST_CASE("a sign that is wrong is one warning, and what is right none") {
    CHECK(said(right_options()).empty());
    CHECK(said(right_options(), [](FrameDescription& frame) { frame.reset = true; }).empty());  // nothing to compare

    UpscalerOptions flipped = right_options();
    flipped.motion.scale = {-flipped.motion.scale.x, -flipped.motion.scale.y};
    check_names(said(flipped), "motion.direction is to_previous, and from_previous fits better");
    check_names(said(
                    flipped, [](FrameDescription&) {}, 9),
                "motion.direction");
    check_names(said(
                    flipped, [](FrameDescription&) {}, 5),
                "motion.direction");  // as many as came
    CHECK(said(
              flipped, [](FrameDescription&) {}, 3)
              .empty());  // too few to be sure
    flipped.diagnose = false;
    CHECK(said(flipped).empty());

    const Vec2 right = right_options().motion.scale;
    check_names(said(right_options(),
                     [&](FrameDescription& frame) {
                         frame.motion_scale = Vec2{right.x, -right.y};
                     }),
                "motion.y is down, and up fits better");
    check_names(said(right_options(), [](FrameDescription& frame) { frame.jitter.x = -frame.jitter.x; }), "jitter x");
    UpscalerOptions reversed = right_options();
    reversed.depth.reversed = !reversed.depth.reversed;
    check_names(said(reversed), "depth.reversed");
    UpscalerOptions wider = flipped;  // vectors of another size than the frame
    wider.diagnose = true;
    wider.motion_size = Size{2 * kRender.width, 2 * kRender.height};
    std::vector<float> wide;
    check_names(said(wider,
                     [&](FrameDescription& frame) {
                         const auto* vectors = static_cast<const float*>(frame.motion.host);
                         wide.clear();
                         for (int y = 0; y < 2 * kRender.height; ++y)
                             for (int x = 0; x < 2 * kRender.width; ++x)
                                 for (int c = 0; c < 2; ++c)
                                     wide.push_back(vectors[2 * (y / 2 * kRender.width + x / 2) + c]);
                         frame.motion = {.host = wide.data(), .size = *wider.motion_size};
                     }),
                "motion.direction");
    CHECK(said(
              reversed, [](FrameDescription&) {}, 8, "bicubic")
              .empty());  // reads no motion
}

TEST_CASE("a history that is dropped is a cut") {
    const Warnings warnings;
    {
        UpscalerOptions options = right_options();
        Upscaler upscaler(test_device(), Model::filter("fsr2", 2), kRender, options);
        std::vector<float> output(3 * 4 * kRender.width * kRender.height);
        const auto image = [](const io::Pixels& pixels) {
            return Image{.host = const_cast<float*>(pixels.values.data()), .size = pixels.size};
        };
        for (int i = 0; i < 8; ++i) {  // back to the first frame again and again
            const io::FramePixels& pixels = film().frames[i % 2 * 7];
            FrameDescription frame;
            static_cast<FrameParameters&>(frame) = film().sequence.frames[i % 2 * 7];
            frame.reset = false;
            frame.color = image(pixels.color);
            frame.depth = image(pixels.depth);
            frame.motion = image(pixels.motion);
            frame.output = {.host = output.data(), .size = upscaler.output_size()};
            upscaler.reset();
            upscaler.submit(frame).wait();
        }
    }
    CHECK(warnings.all().empty());
}

TEST_CASE("frames in the device's buffers are looked at as those of the host are") {
    if (!test_device().is_one_context()) return;
    const auto& context = test_device().context();
    std::vector<cl::Buffer> buffers;
    const auto move_to_buffer = [&](Image& image, int channels) {
        const size_t bytes = tight_bytes(image.size, {ElementType::f32, channels});
        buffers.emplace_back(context.context(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, bytes, image.host);
        image.buffer = buffers.back()();
        image.host = nullptr;
    };
    const Change move = [&](FrameDescription& frame) {
        move_to_buffer(frame.color, 3);
        move_to_buffer(frame.depth, 1);
        move_to_buffer(frame.motion, 2);
    };
    CHECK(said(right_options(), move).empty());
    UpscalerOptions flipped = right_options();
    flipped.motion.scale = {-flipped.motion.scale.x, -flipped.motion.scale.y};
    check_names(said(flipped, move), "motion.direction");
}

TEST_CASE("stored values are those of every format, in a part of a larger image too") {
    const auto& context = test_device().context();
    const auto read = [&](const void* bytes, Size size, ImageFormat format, int channels) {
        return stored_values({.host = const_cast<void*>(bytes), .size = size}, format, channels, context).values;
    };
    const std::vector<uint8_t> eight{0, 51, 255, 9, 102, 1, 2, 3};
    CHECK(read(eight.data(), {2, 1}, {ElementType::u8, 4}, 3) ==
          std::vector<float>{0, 0.2f, 1, 0.4f, 1.0f / 255, 2.0f / 255});
    const std::vector<uint16_t> sixteen{65535, 13107};
    CHECK(read(sixteen.data(), {1, 2}, {ElementType::u16, 1}, 1) == std::vector<float>{1, 0.2f});
    const std::vector<uint16_t> halves{0x3c00, 0xc100};
    CHECK(read(halves.data(), {1, 1}, {ElementType::f16, 2}, 2) == std::vector<float>{1, -2.5f});
    const std::vector<uint32_t> tens{1023u | 341u << 10 | 2u << 30};
    CHECK(read(tens.data(), {1, 1}, {ElementType::rgb10a2, 4}, 4) == std::vector<float>{1, 1.0f / 3, 0, 2.0f / 3});
    const std::vector<uint32_t> small{0x3c0u | 0x400u << 11 | 0x1c0u << 22};  // 1, 2, 0.5
    CHECK(read(small.data(), {1, 1}, {ElementType::r11g11b10f, 3}, 3) == std::vector<float>{1, 2, 0.5f});
    const std::vector<uint32_t> depth{0xab000000u, 0x00ffffffu};
    CHECK(read(depth.data(), {2, 1}, {ElementType::d24, 1}, 1) == std::vector<float>{0, 1});

    std::vector<float> larger(5 * 4);
    for (size_t i = 0; i < larger.size(); ++i) larger[i] = static_cast<float>(i);
    const ImageFormat floats{ElementType::f32, 1};
    const Image part{.host = larger.data(), .row_pitch = 20, .size = {2, 2}, .origin = {3, 1}};
    const std::vector<float> expected{8, 9, 13, 14};
    CHECK(stored_values(part, floats, 1, context).values == expected);
    const cl::Buffer buffer(context.context(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, size_t{80}, larger.data());
    const Image on_device{.buffer = buffer(), .row_pitch = 20, .size = {2, 2}, .origin = {3, 1}};
    CHECK(stored_values(on_device, floats, 1, context).values == expected);
    if (!test_device().profile().images) return;
    const cl::Image2D object(context.context(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR,
                             cl::ImageFormat(CL_R, CL_FLOAT), 5, 4, 0, larger.data());
    const Image in_object{.image = object(), .size = {2, 2}, .origin = {3, 1}};
    CHECK(stored_values(in_object, floats, 1, context).values == expected);
}
