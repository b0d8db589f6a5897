#include "clarus/upscaler.h"

#include <CL/cl_half.h>
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "cache_folder.h"
#include "cl/context.h"
#include "clarus/error.h"
#include "clarus/log.h"
#include "one_frame.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;

namespace {

const Size kRender{13, 9};

Model network() { return Model::load(std::string(CLARUS_GOLDEN_DIR) + "/enss_x2_table.model.safetensors"); }

struct Inputs {
    explicit Inputs(unsigned seed) {
        std::mt19937 generator(seed);
        std::uniform_real_distribution<float> unit(0, 1);
        for (auto* plane : {&color, &depth, &motion})
            for (float& value : *plane) value = unit(generator);
        for (float& value : motion) value = 4 * value - 2;
    }
    FrameDescription describe(std::vector<float>& output) {
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = kRender};
        frame.depth = {.host = depth.data(), .size = kRender};
        frame.motion = {.host = motion.data(), .size = kRender};
        frame.jitter = {0.0f, -1.0f / 6};
        output.assign(4 * 3 * 13 * 9, -1);
        frame.output = {.host = output.data(), .size = {26, 18}};
        return frame;
    }
    std::vector<float> color = std::vector<float>(3 * 13 * 9), depth = std::vector<float>(13 * 9),
                       motion = std::vector<float>(2 * 13 * 9);
};

std::vector<float> run(Upscaler& upscaler, Inputs& inputs, bool reset = false) {
    std::vector<float> output;
    FrameDescription frame = inputs.describe(output);
    frame.reset = reset;
    upscaler.submit(frame).wait();
    return output;
}

ErrorKind error_of(Upscaler& upscaler, const FrameDescription& frame, const char* field) {
    try {
        upscaler.submit(frame);
    } catch (const Error& error) {
        CHECK(std::string(error.what()).find(field) != std::string::npos);
        return error.kind();
    }
    FAIL_CHECK("no error for " << field);
    return ErrorKind::device;
}

/// Colour alone through a filter that changes nothing.
std::vector<float> through_identity(const std::vector<float>& color, UpscalerOptions options, float exposure = 1) {
    const Size size{static_cast<int>(color.size()) / 3, 1};
    Upscaler upscaler(test_device(), Model::filter("bilinear", 1), size, options);
    return upscaled(upscaler, color, {}, exposure);
}

}  // namespace

TEST_CASE("buffers in the caller's context on the caller's out-of-order queue give what host memory gives") {
    const Device device = test_device();
    Upscaler by_host(device, network(), kRender);
    Inputs first(1), second(2);
    run(by_host, first);
    const std::vector<float> expected = run(by_host, second);

    const cl::Device id = device.context().device();
    const cl::Context context(id);
    cl_int status = CL_SUCCESS;
    const cl::CommandQueue queue(context, id, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE, &status);
    REQUIRE(status == CL_SUCCESS);
    Upscaler by_buffer(Device::adopt(context(), id(), queue()), network(), kRender);
    const auto buffer = [&](size_t floats) { return cl::Buffer(context, CL_MEM_READ_WRITE, floats * sizeof(float)); };
    const cl::Buffer color = buffer(first.color.size()), depth = buffer(first.depth.size()),
                     motion = buffer(first.motion.size()), output = buffer(expected.size() + 8);
    std::vector<float> result(expected.size()), unused;
    for (Inputs* inputs : {&first, &second}) {
        cl::Event written[3];
        queue.enqueueWriteBuffer(color, CL_FALSE, 0, sizeof(float) * inputs->color.size(), inputs->color.data(),
                                 nullptr, &written[0]);
        queue.enqueueWriteBuffer(depth, CL_FALSE, 0, sizeof(float) * inputs->depth.size(), inputs->depth.data(),
                                 nullptr, &written[1]);
        queue.enqueueWriteBuffer(motion, CL_FALSE, 0, sizeof(float) * inputs->motion.size(), inputs->motion.data(),
                                 nullptr, &written[2]);
        const cl_event events[] = {written[0](), written[1](), written[2]()};
        FrameDescription frame = inputs->describe(unused);
        frame.color = {.buffer = color(), .size = kRender};
        frame.depth = {.buffer = depth(), .size = kRender};
        frame.motion = {.buffer = motion(), .size = kRender};
        frame.output = {.buffer = output(), .offset = 8 * sizeof(float), .size = {26, 18}};
        frame.wait_for = events;
        const FrameEvent done = by_buffer.submit(frame);
        const std::vector<cl::Event> after{cl::Event(done.get(), true)};
        queue.enqueueReadBuffer(output, CL_TRUE, 8 * sizeof(float), sizeof(float) * result.size(), result.data(),
                                &after);
    }
    CHECK(result == expected);
}

TEST_CASE("history is dropped by reset, by the frame's flag, and by motion vectors of which none is valid") {
    Upscaler upscaler(test_device(), network(), kRender);
    Inputs first(1), second(2);
    const std::vector<float> alone = run(upscaler, second);
    run(upscaler, first);
    const std::vector<float> with_history = run(upscaler, second);
    CHECK(with_history != alone);
    run(upscaler, first);
    CHECK(run(upscaler, second, true) == alone);
    run(upscaler, first);
    upscaler.reset();
    CHECK(run(upscaler, second) == alone);

    Inputs broken = second;
    for (size_t i = 0; i < broken.motion.size(); i += 2)
        broken.motion[i + i % 4 / 2] = i % 3 == 0 ? NAN : i % 3 == 1 ? INFINITY : 1e30f;
    run(upscaler, first);
    CHECK(run(upscaler, broken) == alone);
    CHECK(run(upscaler, second) != alone);  // the frame after has history again, and it is clean
    for (const float value : run(upscaler, first)) CHECK(std::isfinite(value));
}

TEST_CASE("invalid motion vectors are counted, reset frames aside") {
    Upscaler upscaler(test_device(), network(), kRender);
    Inputs inputs(3);
    inputs.motion[0] = NAN;
    inputs.motion[7] = -INFINITY;
    inputs.motion[12] = 15.9f;  // longer than the diagonal of 13 × 9
    inputs.motion[13] = 0;
    inputs.motion[14] = 15.7f;  // shorter
    inputs.motion[15] = 0;
    std::vector<float> output;
    FrameDescription frame = inputs.describe(output);
    CHECK(upscaler.submit(frame).invalid_motion_vectors() == 0);
    CHECK(upscaler.submit(frame).invalid_motion_vectors() == 3);
    frame.reset = true;
    CHECK(upscaler.submit(frame).invalid_motion_vectors() == 0);
}

TEST_CASE("rows may be apart, formats narrower, channels more") {
    Inputs inputs(4);
    for (float& value : inputs.color) value = std::round(value * 255) / 255;
    UpscalerOptions plain;
    Upscaler expected(test_device(), network(), kRender, plain);
    const std::vector<float> reference = run(expected, inputs);

    UpscalerOptions options;
    options.color_format = {ElementType::u8, 4};
    options.output_format = {ElementType::f16, 4};
    Upscaler upscaler(test_device(), network(), kRender, options);
    std::vector<float> unused;
    FrameDescription frame = inputs.describe(unused);
    constexpr size_t kInPitch = 64, kOutPitch = 256;
    std::vector<unsigned char> color(kInPitch * 9, 77);
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 13; ++x)
            for (int c = 0; c < 3; ++c)
                color[y * kInPitch + 4 * x + c] =
                    static_cast<unsigned char>(std::lround(255 * inputs.color[3 * (y * 13 + x) + c]));
    std::vector<cl_half> output(kOutPitch / 2 * 18, 0x7fff);
    frame.color = {.host = color.data(), .row_pitch = kInPitch, .size = kRender};
    frame.output = {.host = output.data(), .row_pitch = kOutPitch, .size = {26, 18}};
    upscaler.submit(frame).wait();
    float largest = 0;
    for (int y = 0; y < 18; ++y) {
        for (int x = 0; x < 26; ++x) {
            const cl_half* pixel = output.data() + y * kOutPitch / 2 + 4 * x;
            for (int c = 0; c < 3; ++c)
                largest = std::max(largest, std::abs(cl_half_to_float(pixel[c]) - reference[3 * (y * 26 + x) + c]));
            CHECK(cl_half_to_float(pixel[3]) == 1);
        }
        CHECK(output[y * kOutPitch / 2 + 4 * 26] == 0x7fff);  // what lies between rows is left alone
    }
    CHECK(largest < 6e-4);  // half precision below 1
}

TEST_CASE("linear HDR comes back as linear HDR" * doctest::test_suite("small")) {
    UpscalerOptions linear;
    linear.color_space = ColorSpace::linear;
    const std::vector<float> color{0, 0.001f, 0.2f, 1, 2, 4, 100, 50, 25, -1, NAN, 0.5f};
    const std::vector<float> output = through_identity(color, linear, 0.5f);
    for (size_t i = 0; i < 9; ++i) CHECK(output[i] == doctest::Approx(color[i]).epsilon(2e-3));
    CHECK(output[9] == 0);
    CHECK(output[10] == 0);
    // Brighter than what the display encoding can tell from white: scaled to the brightest that it can.
    const std::vector<float> bright = through_identity({INFINITY, 0, 0}, linear);
    CHECK(bright[0] > 1000);
    CHECK(std::isfinite(bright[0]));
}

TEST_CASE("a frame that does not fit is refused with the field's name" * doctest::test_suite("small")) {
    Upscaler upscaler(test_device(), network(), kRender);
    Inputs inputs(5);
    std::vector<float> output;
    const FrameDescription good = inputs.describe(output);
    const auto refuse = [&](const char* field, auto&& spoil) {
        FrameDescription bad = good;
        spoil(bad);
        CHECK(error_of(upscaler, bad, field) == ErrorKind::invalid_argument);
    };
    refuse("color", [](FrameDescription& frame) { frame.color.host = nullptr; });
    refuse("color", [](FrameDescription& frame) { frame.color.size.width = 12; });
    refuse("depth", [](FrameDescription& frame) { frame.depth = {}; });
    refuse("motion", [](FrameDescription& frame) { frame.motion.size = {26, 18}; });
    refuse("output", [](FrameDescription& frame) { frame.output.size = {13, 9}; });
    refuse("row_pitch", [](FrameDescription& frame) { frame.color.row_pitch = 16; });
    refuse("row_pitch", [](FrameDescription& frame) { frame.color.row_pitch = size_t(1) << 63; });
    refuse("jitter", [](FrameDescription& frame) { frame.jitter.x = 1.01f; });
    refuse("jitter", [](FrameDescription& frame) { frame.jitter.y = NAN; });
    refuse("exposure", [](FrameDescription& frame) { frame.exposure = 0; });
    refuse("reactive_mask", [&](FrameDescription& frame) {
        frame.reactive_mask = frame.color;
        frame.reactive_mask.size = {3, 3};
    });

    UpscalerOptions options;
    options.depth.projective = true;
    Upscaler projective(test_device(), network(), kRender, options);
    CHECK(error_of(projective, good, "near_plane") == ErrorKind::invalid_argument);
    options = {};
    options.views = {"alpah"};
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), network(), kRender, options), doctest::Contains("alpha"), Error);
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), network(), {0, 9}), doctest::Contains("0x9"), Error);
    CHECK_THROWS_WITH_AS(Model::filter("bilinear", 0.5), doctest::Contains("0.5"), Error);
    CHECK_THROWS_WITH_AS(Model::filter("bilinear", NAN), doctest::Contains("nan"), Error);
    CHECK_THROWS_WITH_AS(Model::filter("bilinear", INFINITY), doctest::Contains("inf"), Error);
    CHECK_THROWS_WITH_AS(Upscaler(test_device(), Model::filter("bilinear", 1e300), {1, 1}), doctest::Contains("1e+300"),
                         Error);
    CHECK_THROWS_WITH_AS(Model::find("enss-xl-x9"), doctest::Contains("bicubic"), Error);
}

TEST_CASE("a buffer that is too small, or another context's, is refused") {
    const Device device = test_device();
    Upscaler upscaler(device, network(), kRender);
    Inputs inputs(9);
    std::vector<float> output;
    FrameDescription frame = inputs.describe(output);
    const size_t bytes = sizeof(float) * inputs.depth.size();
    const cl::Buffer fits(device.context().context(), CL_MEM_READ_WRITE, bytes);
    frame.depth = {.buffer = fits(), .offset = 4, .size = kRender};
    CHECK(error_of(upscaler, frame, "depth") == ErrorKind::invalid_argument);
    const cl::Context elsewhere(device.context().device());
    const cl::Buffer foreign(elsewhere, CL_MEM_READ_WRITE, bytes);
    frame.depth = {.buffer = foreign(), .size = kRender};
    CHECK(error_of(upscaler, frame, "depth") == ErrorKind::invalid_argument);
}

TEST_CASE("a frame that cannot be enqueued does not spoil those after it") {
    Upscaler upscaler(test_device(), network(), kRender);
    Inputs inputs(10);
    const std::vector<float> alone = run(upscaler, inputs);
    std::vector<float> output;
    FrameDescription frame = inputs.describe(output);
    const cl::Context elsewhere(test_device().context().device());
    const cl::UserEvent foreign(elsewhere);  // a wait list is of one context
    const cl_event events[] = {foreign()};
    frame.wait_for = events;
    CHECK_THROWS_AS(upscaler.submit(frame), Error);
    CHECK(run(upscaler, inputs) == alone);  // it starts anew
}

TEST_CASE("an upscaler says once, in the end, how far jitter was from what its model has kernels for") {
    std::vector<std::string> warnings;
    set_log_callback([&](LogLevel level, std::string_view message) {
        if (level == LogLevel::warning) warnings.emplace_back(message);
    });
    Inputs inputs(11);
    const auto run_with = [&](std::initializer_list<float> distances) {
        std::vector<float> output;
        Upscaler first(test_device(), network(), kRender), upscaler = std::move(first);
        FrameDescription frame = inputs.describe(output);
        const float entry = frame.jitter.y;
        for (const float distance : distances) {
            frame.jitter.y = entry + distance;
            upscaler.submit(frame).wait();
        }
        CHECK(warnings.empty());
    };
    run_with({});
    run_with({0, 0.0005f, -0.009f});
    CHECK(warnings.empty());
    run_with({0.02f, 0.05f, -0.03f});
    set_log_callback({});
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("0.050 pixels") != std::string::npos);
}

TEST_CASE("the memory plan stays within a tenth of what is live at the worst moment") {
    for (const Size size : {Size{960, 540}, Size{61, 43}}) {
        const Upscaler upscaler(test_device(), network(), size);
        const MemoryRequirements memory = upscaler.memory_requirements();
        CHECK(memory.peak_live_bytes > 0);
        CHECK(memory.arena <= 1.1 * memory.peak_live_bytes);
    }
}

TEST_CASE("a second start compiles nothing, and a frame after the first neither") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Inputs inputs(6);
    const auto start = [&] {
        const Device device = Device::open(test_selector());
        Upscaler upscaler(device, network(), kRender);
        run(upscaler, inputs);
        const int compiled = device.programs_compiled();
        run(upscaler, inputs);
        CHECK(device.programs_compiled() == compiled);
        return compiled;
    };
    const int first = start(), second = start();
    CHECK(first > 0);
    CHECK(second == 0);
}

TEST_CASE("measuring chooses kernels that compute the same, and remembers them") {
    const TemporaryFolder folder;
    const CacheFolder cache(folder.path());
    Inputs inputs(7);
    UpscalerOptions fixed, measured;
    fixed.tuning = Tuning::fixed;
    measured.tuning = Tuning::measure;
    Upscaler plain(test_device(), network(), kRender, fixed), tuned(test_device(), network(), kRender, measured);
    const std::vector<float> expected = run(plain, inputs), output = run(tuned, inputs);
    float largest = 0;
    for (size_t i = 0; i < expected.size(); ++i) largest = std::max(largest, std::abs(expected[i] - output[i]));
    CHECK(largest < 1e-4);
    CHECK(std::filesystem::exists(folder / "tuning"));
}

TEST_CASE("stages are profiled in the order in which they run") {
    UpscalerOptions options;
    options.profile = true;
    Upscaler upscaler(test_device(), network(), kRender, options);
    Inputs inputs(8);
    run(upscaler, inputs);
    run(upscaler, inputs);
    const std::vector<StageProfile> stages = upscaler.take_profile();
    REQUIRE(stages.size() >= 8);
    double operations = 0;
    for (const StageProfile& stage : stages) {
        CAPTURE(stage.name);
        CHECK(stage.spans.size() >= 2);
        CHECK(stage.seconds >= 0);
        if (stage.name.find("convolution") != std::string::npos) operations += stage.operations;
    }
    CHECK(operations == 2.0 * 9 * (22 * 16 + 16 * 16 + 16 * 20) * 13 * 9);
    CHECK(upscaler.take_profile().empty());
}
