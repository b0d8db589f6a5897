// A render size that changes from frame to frame, and images that are parts of larger ones.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "api/build_graph.h"
#include "cl/context.h"
#include "clarus/error.h"
#include "clarus/interpolator.h"
#include "clarus/jitter.h"
#include "clarus/upscaler.h"
#include "film.h"
#include "runtime/executor.h"
#include "runtime/tuner.h"
#include "test_device.h"

using namespace clarus;

namespace {

using Pixels = std::vector<float>;

Pixels random_pixels(Size size, int channels, unsigned seed) {
    std::mt19937 random(seed);
    Pixels pixels(static_cast<size_t>(channels) * size.width * size.height);
    for (float& value : pixels) value = static_cast<float>(random() % 1024) / 1023;
    return pixels;
}

double keys_weight(double distance) {
    const double d = std::abs(distance);
    if (d < 1) return (1.5 * d - 2.5) * d * d + 1;
    return d < 2 ? ((-0.5 * d + 2.5) * d - 4) * d + 2 : 0;
}

/// A line by Keys' cubic, held between the two values around.
std::vector<double> resized_line(const std::vector<double>& line, int to) {
    const int from = static_cast<int>(line.size());
    const auto at = [&](int i) { return line[std::clamp(i, 0, from - 1)]; };
    std::vector<double> result;
    for (int x = 0; x < to; ++x) {
        const double u = (x + 0.5) * from / to - 0.5;
        const int left = static_cast<int>(std::floor(u));
        double sum = 0;
        for (int i = left - 1; i <= left + 2; ++i) sum += keys_weight(u - i) * at(i);
        const auto [low, high] = std::minmax({at(left), at(left + 1)});
        result.push_back(std::clamp(sum, low, high));
    }
    return result;
}

Pixels resized(const Pixels& image, Size from, Size to, int channels) {
    Pixels result(static_cast<size_t>(channels) * to.width * to.height);
    for (int c = 0; c < channels; ++c) {
        std::vector<std::vector<double>> columns;
        for (int x = 0; x < from.width; ++x) {
            std::vector<double> column;
            for (int y = 0; y < from.height; ++y)
                column.push_back(image[(static_cast<size_t>(y) * from.width + x) * channels + c]);
            columns.push_back(resized_line(column, to.height));
        }
        for (int y = 0; y < to.height; ++y) {
            std::vector<double> row;
            for (const std::vector<double>& column : columns) row.push_back(column[y]);
            row = resized_line(row, to.width);
            for (int x = 0; x < to.width; ++x)
                result[(static_cast<size_t>(y) * to.width + x) * channels + c] = static_cast<float>(row[x]);
        }
    }
    return result;
}

/// Shows the frame before, and carries a picture of one channel more.
graph::Graph delay(Size size, int channels) {
    graph::Graph graph;
    const graph::Value color = graph.input(graph::Resource::color, size);
    const graph::Value all = channels == 3 ? color : graph.concat({color, graph.slice(color, 0, channels - 3)});
    const graph::Value before = graph.previous({channels, size.height, size.width}, "history");
    graph.carry(before, graph.linear({all}, {1}, 0, "kept"));
    graph.output = graph.linear({graph.slice(before, channels - 3, 3)}, {1}, 0, "shown");
    return graph;
}

struct Delay {
    std::unique_ptr<runtime::Plan> plan(Size size) const {
        const DeviceProfile profile = test_device().profile();
        return runtime::make_plan(delay(size, channels), options, profile, [&](const runtime::Problem& problem) {
            return runtime::built_in_selection(problem, profile);
        });
    }
    Pixels show(runtime::Executor& executor, Pixels color, Size size) const {
        Pixels output(color.size(), -1);
        FrameDescription frame;
        frame.color = {.host = color.data(), .size = size};
        frame.output = {.host = output.data(), .size = size};
        executor.submit(frame, {})->done.wait();
        return output;
    }

    int channels;
    runtime::PlanOptions options = {};
};

struct Case {
    std::string name;
    double scale;
};

}  // namespace

TEST_SUITE("small") {
    TEST_CASE("what is carried is resampled to another size, larger, smaller and of one pixel") {
        for (const int channels : {3, 5}) {
            const Delay delay{channels};
            const std::vector<Size> sizes{{9, 7}, {5, 3}, {5, 3}, {1, 1}, {4, 6}, {83, 17}, {45, 20}, {9, 7}};
            std::vector<std::unique_ptr<runtime::Plan>> plans;
            for (const Size size : sizes) plans.push_back(delay.plan(size));
            runtime::Executor executor(test_device().context(), *plans[5], std::span(plans).first(2), delay.options,
                                       runtime::HandedIn{}, {});
            Size before = sizes[5];
            Pixels kept(static_cast<size_t>(3) * before.width * before.height, 0);
            delay.show(executor, kept, before);
            for (size_t i = 0; i < sizes.size(); ++i) {
                CAPTURE(i);
                const Size size = sizes[i];
                executor.change_plan(*plans[i], true);
                const Pixels color = random_pixels(size, 3, static_cast<unsigned>(i));
                const Pixels shown = delay.show(executor, color, size);
                // Of five channels, the last three are blue, red, green.
                const Pixels expected = resized(kept, before, size, 3);
                const int turn = channels == 5 ? 2 : 0;
                for (size_t pixel = 0; pixel < shown.size(); pixel += 3)
                    for (int c = 0; c < 3; ++c)
                        CHECK(shown[pixel + c] == doctest::Approx(expected[pixel + (c + turn) % 3]).epsilon(1e-5));
                kept = color;
                before = size;
            }
        }
    }
}

TEST_CASE("a plan that needs more memory than those before gets it") {
    const Delay delay{3};
    const auto small = delay.plan({5, 3}), large = delay.plan({64, 48});
    REQUIRE(large->memory.bytes > small->memory.bytes);
    runtime::Arena arena(test_device().context(), *small);
    for (const auto* plan : {large.get(), small.get(), large.get()}) {
        arena.lay_out(*plan);
        for (int memory = 0; memory < static_cast<int>(plan->memory.places.size()); ++memory)
            CHECK(arena.memory(memory).getInfo<CL_MEM_SIZE>() == plan->memory.places[memory].bytes);
    }
}

namespace {

/// A scene that goes to and fro, seen by a camera whose resolution changes.
class Pan {
  public:
    Pan(const Model& model, Size largest, bool dynamic)
        : scale_(model.scale()),
          output_{static_cast<int>(largest.width * model.scale()), static_cast<int>(largest.height * model.scale())},
          mnss_(model.pipeline() == "mnss"),
          upscaler_(test_device(), model, largest, options(dynamic, output_)) {}

    /// PSNR of the frame.
    double show(Size render) {
        const double s = static_cast<double>(output_.width) / render.width;
        const Vec2 jitter = mnss_ ? mnss_jitter(shown_, static_cast<int>(scale_)) : halton_jitter(shown_, 16);
        Pixels color, depth(static_cast<size_t>(render.width) * render.height, 0.5f), motion;
        for (int y = 0; y < render.height; ++y)
            for (int x = 0; x < render.width; ++x) {
                const test::Color at = test::scene((x + 0.5 + jitter.x) * s + pan(shown_), (y + 0.5 + jitter.y) * s);
                for (const double c : at) color.push_back(static_cast<float>(c));
                motion.push_back(static_cast<float>((pan(shown_) - pan(shown_ - 1)) / s));
                motion.push_back(0);
            }
        Pixels output(static_cast<size_t>(3) * output_.width * output_.height);
        FrameDescription frame;
        frame.render_size = render;
        frame.jitter = jitter;
        frame.color = {.host = color.data(), .size = render};
        frame.depth = {.host = depth.data(), .size = render};
        frame.motion = {.host = motion.data(), .size = render};
        frame.output = {.host = output.data(), .size = output_};
        upscaler_.submit(frame).wait();
        const double result = psnr(output);
        ++shown_;
        return result;
    }

  private:
    /// In output pixels.
    static double pan(int frame) { return 6 * std::sin(0.25 * frame); }

    double psnr(const Pixels& output) const {
        constexpr int kBorder = 8, kSamples = 4;
        double sum = 0;
        int count = 0;
        for (int y = kBorder; y < output_.height - kBorder; ++y)
            for (int x = kBorder; x < output_.width - kBorder; ++x) {
                test::Color mean{};
                for (int i = 0; i < kSamples * kSamples; ++i) {
                    const test::Color at = test::scene(x + (i % kSamples + 0.5) / kSamples + pan(shown_),
                                                       y + (i / kSamples + 0.5) / kSamples);
                    for (int c = 0; c < 3; ++c) mean[c] += at[c] / (kSamples * kSamples);
                }
                for (int c = 0; c < 3; ++c, ++count)
                    sum += std::pow(output[3 * (static_cast<size_t>(y) * output_.width + x) + c] - mean[c], 2);
            }
        return -10 * std::log10(sum / count);
    }

    static UpscalerOptions options(bool dynamic, Size output) {
        UpscalerOptions result;
        result.dynamic_resolution = dynamic;
        result.output_size = output;
        return result;
    }

    double scale_;
    Size output_;
    bool mnss_;  // what it was trained with
    Upscaler upscaler_;
    int shown_ = 0;
};

}  // namespace

TEST_CASE("a resolution that goes down and up again is as good as one that stayed") {
    for (const auto& [name, scale] : {Case{"enss-s-x2", 2}, {"mnss-x2", 2}, {"nsrr-fast-x4", 4}, {"fsr2", 2}}) {
        CAPTURE(name);
        const Model model = Model::find(name, scale);
        const Size largest = scale == 4 ? Size{40, 32} : Size{80, 64};
        Pan changing(model, largest, true), staying(model, largest, false);
        double changed = 0, stayed = 0;
        const auto both = [&](double share) {
            stayed = staying.show(largest);
            changed =
                changing.show({static_cast<int>(largest.width * share), static_cast<int>(largest.height * share)});
        };
        for (int frame = 0; frame < 8; ++frame) both(1);
        for (const double share : {0.9, 0.8, 0.7, 0.6, 0.6, 0.6, 0.7, 0.8, 0.9}) both(share);
        for (int frame = 0; frame < 16; ++frame) both(1);  // all jitters of a cycle
        CHECK(changed > stayed - 0.3);
    }
}

namespace {

Pixels submitted(Upscaler& upscaler, Size render, unsigned seed, bool reset = false) {
    Pixels color = random_pixels(render, 3, seed), depth = random_pixels(render, 1, seed + 1);
    Pixels motion(static_cast<size_t>(2) * render.width * render.height, 0.25f);
    const Size size = upscaler.output_size(render);
    Pixels output(static_cast<size_t>(3) * size.width * size.height, -1);
    FrameDescription frame;
    frame.render_size = render;
    frame.reset = reset;
    frame.jitter = {0.25f, -0.125f};
    frame.color = {.host = color.data(), .size = render};
    frame.depth = {.host = depth.data(), .size = render};
    frame.motion = {.host = motion.data(), .size = render};
    frame.output = {.host = output.data(), .size = size};
    upscaler.submit(frame).wait();
    return output;
}

UpscalerOptions dynamic_options() {
    UpscalerOptions options;
    options.dynamic_resolution = true;
    return options;
}

}  // namespace

TEST_CASE("after a cut, frames of another size are those of an upscaler of that size; nothing is compiled") {
    constexpr Size kLargest{24, 18};
    for (const char* file : {"clarus_x2", "enss_x2_table", "mnss_x2", "nsrr_x4", "nsrr_x2_rgb", "srpo_x2"})
        for (const int band_rows : {0, 8}) {
            CAPTURE(std::string(file));
            CAPTURE(band_rows);
            const Model model = Model::load(std::string(CLARUS_GOLDEN_DIR "/") + file + ".model.safetensors");
            UpscalerOptions options = dynamic_options();
            options.band_rows = band_rows;
            Upscaler upscaler(test_device(), model, kLargest, options);
            submitted(upscaler, kLargest, 1);
            for (const Size render : {Size{12, 9}, {13, 18}, {1, 1}, {23, 17}, {24, 18}}) {
                const int compiled = test_device().context().programs_compiled();
                const Pixels first = submitted(upscaler, render, 3, true), second = submitted(upscaler, render, 5);
                CHECK(test_device().context().programs_compiled() == compiled);
                UpscalerOptions fixed;
                fixed.band_rows = band_rows;
                Upscaler fresh(test_device(), model, render, fixed);
                CHECK(submitted(fresh, render, 3) == first);
                CHECK(submitted(fresh, render, 5) == second);
            }
        }
}

TEST_CASE("after a cut, each of a model's networks makes what an upscaler of that size makes; nothing is compiled") {
    constexpr Size kLargest{64, 48}, kOutput{96, 72};
    for (const char* name : {"clarus-s", "clarus-m"})
        for (const int band_rows : {0, 8}) {
            CAPTURE(std::string(name));
            CAPTURE(band_rows);
            const Model model = Model::find(name);
            UpscalerOptions options = dynamic_options();
            options.output_size = kOutput;
            options.band_rows = band_rows;
            Upscaler upscaler(test_device(), model, kLargest, options);
            CHECK(upscaler.memory_requirements().weights > 38919 * sizeof(float));
            submitted(upscaler, kLargest, 1);
            // At scales of 3, 4, 2, 1.5, 2.4, 3.69 and 2.02; the last is a little more than x2's own.
            for (const Size render : {Size{32, 24}, {24, 18}, {48, 36}, {64, 48}, {40, 30}, {26, 20}, {47, 36}}) {
                CAPTURE(render.width);
                const int compiled = test_device().context().programs_compiled();
                const Pixels first = submitted(upscaler, render, 3, true), second = submitted(upscaler, render, 5);
                CHECK(test_device().context().programs_compiled() == compiled);
                UpscalerOptions fixed;
                fixed.output_size = kOutput;
                fixed.band_rows = band_rows;
                Upscaler fresh(test_device(), model, render, fixed);
                CHECK(submitted(fresh, render, 3) == first);
                CHECK(submitted(fresh, render, 5) == second);
            }
        }
}

TEST_CASE("with an output size, it stays while the render size changes") {
    UpscalerOptions options = dynamic_options();
    const Model network = Model::load(CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors");
    const Model of_any_scale = Model::load(CLARUS_GOLDEN_DIR "/clarus_x2.5.model.safetensors", 2);
    for (const auto& [model, size] : {std::pair(Model::find("bicubic", 2), Size{48, 36}),
                                      {network, {48, 36}},
                                      {network, {40, 30}},
                                      {of_any_scale, {48, 36}},
                                      {of_any_scale, {60, 45}},
                                      {of_any_scale, {49, 37}}}) {
        options.output_size = size;
        Upscaler upscaler(test_device(), model, {24, 18}, options);
        CHECK(upscaler.output_size({13, 9}) == size);
        submitted(upscaler, {24, 18}, 1);
        const int compiled = test_device().context().programs_compiled();
        for (const Size render : {Size{12, 9}, {20, 15}, {20, 18}, {19, 15}, {24, 13}, {24, 18}, {16, 12}, {13, 9}}) {
            CAPTURE(render.width);
            CAPTURE(render.height);
            CAPTURE(size.width);
            CAPTURE(model.pipeline());
            const Pixels output = submitted(upscaler, render, 1);
            CHECK(std::all_of(output.begin(), output.end(), [](float value) { return std::isfinite(value); }));
            CHECK(test_device().context().programs_compiled() == compiled);
        }
    }
}

TEST_CASE("a model of any scale serves an output size at the ratio of the sizes, rounded as they are") {
    const Model model = Model::find("fsr2", 2);
    for (const Size largest : {Size{960, 540}, {540, 960}, {640, 640}}) {
        const Size output{2 * largest.width, 2 * largest.height};
        for (double share = 0.5; share < 1; share += 0.01) {
            const Size render{static_cast<int>(std::lround(largest.width * share)),
                              static_cast<int>(std::lround(largest.height * share))};
            const auto [scale, own] = model_sizes(model, render, output);
            CHECK(own == output);
            CHECK(scale == doctest::Approx(2 / share).epsilon(0.002));
        }
    }
    CHECK(model_sizes(model, {960, 270}, Size{1920, 1080}).scale == 2);  // no one scale
    // Beyond its scales, the nearest, and what that makes.
    const Model to_four = Model::find("clarus-s");
    for (const auto& [render, output, own, nearest] :
         {std::tuple(Size{341, 192}, Size{1366, 768}, Size{1364, 768}, 4.0),
          {{20, 10}, {100, 50}, {80, 40}, 4.0},
          {{20, 10}, {19, 9}, {20, 10}, 1.0}}) {
        const ModelSizes made = model_sizes(to_four, render, output);
        CHECK(made.scale == nearest);
        CHECK(made.own == own);
    }
    CHECK(model_sizes(model, {20, 10}, Size{19, 9}).own == Size{20, 10});
    CHECK(model_sizes(Model::load(CLARUS_GOLDEN_DIR "/srpo_x2.model.safetensors"), {90, 50}, Size{200, 100}).scale ==
          2);
}

TEST_CASE("history may grow beyond that of the largest frames") {
    UpscalerOptions options = dynamic_options();
    options.output_size = Size{48, 36};
    Upscaler upscaler(test_device(), Model::find("fsr2", 1.5), {24, 22}, options);
    for (const Size render : {Size{24, 22}, {24, 18}, {23, 21}, {24, 18}, {24, 22}})
        for (const float value : submitted(upscaler, render, 1)) CHECK(std::isfinite(value));
}

TEST_CASE("an interpolator's render size may change, too") {
    InterpolatorOptions options;
    options.dynamic_resolution = true;
    constexpr Size kOutput{24, 16};
    Interpolator interpolator(test_device(), {12, 8}, kOutput, options);
    Pixels color(static_cast<size_t>(3) * kOutput.width * kOutput.height, 0.5f);
    for (const Size render : {Size{12, 8}, {9, 6}, {11, 7}, {12, 8}}) {
        Pixels depth(static_cast<size_t>(render.width) * render.height, 0.5f), motion(2 * depth.size(), 0),
            output(color.size(), -1);
        FrameDescription frame;
        frame.render_size = render;
        frame.color = {.host = color.data(), .size = kOutput};
        frame.depth = {.host = depth.data(), .size = render};
        frame.motion = {.host = motion.data(), .size = render};
        frame.output = {.host = output.data(), .size = kOutput};
        interpolator.submit(frame).wait();
        for (const float value : output) CHECK(value == doctest::Approx(0.5));
    }
}

TEST_CASE("a render size that cannot be is refused by name, and the next frame goes on") {
    Upscaler fixed(test_device(), Model::find("bilinear", 2), {8, 6});
    CHECK_THROWS_WITH_AS(submitted(fixed, {4, 3}, 1), doctest::Contains("options.dynamic_resolution"), Error);
    Upscaler upscaler(test_device(), Model::find("bilinear", 2), {8, 6}, dynamic_options());
    const Pixels before = submitted(upscaler, {8, 6}, 1);
    for (const Size render : {Size{9, 6}, {8, 7}, {0, 6}, {-1, 3}}) {
        FrameDescription frame;
        frame.render_size = render;
        CHECK_THROWS_WITH_AS(upscaler.submit(frame), doctest::Contains("frame.render_size"), Error);
        CHECK_THROWS_WITH_AS(upscaler.output_size(render), doctest::Contains("frame.render_size"), Error);
    }
    CHECK(submitted(upscaler, {8, 6}, 1) == before);
    UpscalerOptions options = dynamic_options();
    options.output_size = Size{16, 12};
    Upscaler shown(test_device(), Model::load(CLARUS_GOLDEN_DIR "/srpo_x2.model.safetensors"), {8, 6}, options);
    CHECK_THROWS_WITH_AS(submitted(shown, {1, 1}, 1), doctest::Contains("output size 16x12"), Error);
}

TEST_CASE("motion vectors of a frame have the scale that the frame says") {
    const Model model = Model::load(CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors");
    constexpr Size kRender{24, 18};
    const auto last = [&](float vector, std::optional<Vec2> scale) {
        Upscaler upscaler(test_device(), model, kRender);
        Pixels output(static_cast<size_t>(12) * kRender.width * kRender.height);
        for (unsigned seed = 1; seed < 3; ++seed) {
            Pixels color = random_pixels(kRender, 3, seed), depth = random_pixels(kRender, 1, 9);
            Pixels motion(static_cast<size_t>(2) * kRender.width * kRender.height, vector);
            FrameDescription frame;
            frame.motion_scale = scale;
            frame.color = {.host = color.data(), .size = kRender};
            frame.depth = {.host = depth.data(), .size = kRender};
            frame.motion = {.host = motion.data(), .size = kRender};
            frame.output = {.host = output.data(), .size = upscaler.output_size()};
            upscaler.submit(frame).wait();
        }
        return output;
    };
    CHECK(last(0.25f, Vec2{6, 6}) == last(1.5f, std::nullopt));
    CHECK(last(0.25f, Vec2{6, 6}) != last(0.25f, std::nullopt));
}

namespace {

/// An image within a larger one, whose other pixels are 7.
struct Part {
    Part(const Pixels& pixels, Size part, int pixel_channels, Position at)
        : size(part), channels(pixel_channels), origin(at), whole{part.width + at.x + 2, part.height + at.y + 1} {
        values.assign(static_cast<size_t>(channels) * whole.width * whole.height, 7);
        for (size_t i = 0; i < pixels.size(); ++i) values[index(i)] = pixels[i];
    }
    size_t index(size_t i) const {
        const size_t row = static_cast<size_t>(size.width) * channels;
        return (i / row + origin.y) * whole.width * channels + static_cast<size_t>(origin.x) * channels + i % row;
    }
    Image image() {
        Image result{.host = values.data(), .size = size, .origin = origin};
        result.row_pitch = sizeof(float) * channels * whole.width;
        return result;
    }
    Image image_in(cl::Buffer& buffer) {
        const size_t bytes = sizeof(float) * values.size();
        buffer = cl::Buffer(test_device().context().context(), CL_MEM_READ_WRITE, bytes);
        test_device().context().queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, values.data());
        Image result = image();
        result.host = nullptr;
        result.buffer = buffer();
        return result;
    }
    Pixels pixels() const {
        Pixels result(static_cast<size_t>(channels) * size.width * size.height);
        for (size_t i = 0; i < result.size(); ++i) result[i] = values[index(i)];
        return result;
    }
    Size size;
    int channels;
    Position origin;
    Size whole;
    Pixels values;
};

}  // namespace

TEST_CASE("images may be parts of larger ones, on the host and in buffers, and the rest is left alone") {
    constexpr Size kRender{7, 5};
    Upscaler upscaler(test_device(), Model::find("bicubic", 2), kRender);
    const Size size = upscaler.output_size();
    const Pixels color = random_pixels(kRender, 3, 1);
    const auto run = [&](const Image& input, const Image& output) {
        FrameDescription frame;
        frame.color = input;
        frame.output = output;
        upscaler.submit(frame).wait();
    };
    Part plain(color, kRender, 3, {0, 0}), plain_output(Pixels(), size, 3, {0, 0});
    run(plain.image(), plain_output.image());
    const Pixels expected = plain_output.pixels();

    Part input(color, kRender, 3, {3, 2}), output(Pixels(), size, 3, {1, 4});
    run(input.image(), output.image());
    CHECK(output.pixels() == expected);
    CHECK(std::count(output.values.begin(), output.values.end(), 7) ==
          static_cast<long>(output.values.size() - expected.size()));

    Part device_output(Pixels(), size, 3, {2, 1});
    cl::Buffer from, to;
    run(input.image_in(from), device_output.image_in(to));
    test_device().context().queue().enqueueReadBuffer(to, CL_TRUE, 0, sizeof(float) * device_output.values.size(),
                                                      device_output.values.data());
    CHECK(device_output.pixels() == expected);
    CHECK(std::count(device_output.values.begin(), device_output.values.end(), 7) ==
          static_cast<long>(device_output.values.size() - expected.size()));

    Image outside = input.image();
    outside.origin.x = -1;
    CHECK_THROWS_WITH_AS(run(outside, output.image()), doctest::Contains("frame.color: origin (-1, 2)"), Error);
    outside = input.image();
    outside.origin.x = 6;
    CHECK_THROWS_WITH_AS(run(outside, output.image()), doctest::Contains("frame.color: row_pitch"), Error);
    outside.row_pitch = 0;
    CHECK_THROWS_WITH_AS(run(outside, output.image()), doctest::Contains("frame.color: an origin"), Error);
    Image below = device_output.image_in(to);
    below.origin.y = 3;
    CHECK_THROWS_WITH_AS(run(input.image(), below), doctest::Contains("frame.output: the buffer has"), Error);
}
