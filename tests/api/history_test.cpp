// What upscalers keep of earlier frames, taken from one and given to another.

#include <doctest/doctest.h>

#include <cstddef>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "clarus/interpolator.h"
#include "clarus/log.h"
#include "several_devices.h"
#include "test_device.h"

using namespace clarus;
using namespace clarus::test;

namespace {

using Bytes = std::vector<std::byte>;
using Change = std::function<void(int, FrameDescription&)>;

/// Frames [first, last).
Images shown(Film& film, Upscaler& upscaler, int first, int last, const Change& change = {}) {
    Images outputs(last - first);
    for (int number = first; number < last; ++number) {
        FrameDescription frame = film.frame(number, upscaler, outputs[number - first]);
        if (change) change(number, frame);
        upscaler.submit(frame).wait();
    }
    return outputs;
}

/// Every run that ends and is gone on with by another upscaler, at any frame, makes what one run makes.
void check_goes_on(const Golden& golden, const Device& device, const UpscalerOptions& options,
                   const Change& change = {}) {
    Film film(golden);
    const auto made = [&] { return Upscaler(device, golden.model, golden.render, options); };
    Upscaler one = made();
    const Images expected = shown(film, one, 0, golden.frames, change);
    bool matters = false;
    for (int split = 0; split <= golden.frames; ++split) {
        CAPTURE(split);
        Upscaler before = made(), after = made();
        Images outputs = shown(film, before, 0, split, change);
        after.restore_history(before.save_history());
        for (std::vector<float>& output : shown(film, after, split, golden.frames, change))
            outputs.push_back(std::move(output));
        CHECK(outputs == expected);
        Upscaler without = made();
        matters |= split < golden.frames && shown(film, without, split, split + 1, change).front() != expected[split];
    }
    CHECK(matters == one.keeps_history());
}

Upscaler of(const Golden& golden, UpscalerOptions options = {}) {
    return Upscaler(test_device(), golden.model, golden.render, std::move(options));
}

Bytes history_of(const Golden& golden, int frames) {
    Film film(golden);
    Upscaler upscaler = of(golden, options_for(golden));
    shown(film, upscaler, 0, frames);
    return upscaler.save_history();
}

void check_refused(Upscaler&& upscaler, const Bytes& history, const std::string& why) {
    try {
        upscaler.restore_history(history);
        FAIL("nothing is wrong");
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::invalid_argument);
        CHECK_MESSAGE(std::string(error.what()).find(why) != std::string::npos, error.what());
    }
}

/// Warnings as long as it lives.
class Warnings {
  public:
    Warnings() {
        set_log_callback([this](LogLevel level, std::string_view text) {
            if (level == LogLevel::warning) all += std::string(text) + '\n';
        });
    }
    ~Warnings() { set_log_callback({}); }
    std::string all;
};

}  // namespace

TEST_CASE("history that another upscaler goes on with makes the bits of one run" * doctest::test_suite("golden")) {
    for (const char* name : {"enss_x2_table", "enss_x2_held", "mnss_x2_checked", "nsrr_x2_checked", "nsrr_x4", "nss_x2",
                             "srpo_x2", "clarus_x2"}) {
        CAPTURE(name);
        const Golden golden(name);
        check_goes_on(golden, test_device(), options_for(golden));
    }
}

TEST_CASE("filters' history, likewise, and whether there is any") {
    Golden golden("enss_x2_table");
    CHECK(of(golden).keeps_history());
    golden.model = Model::filter("fsr2", 2);
    CHECK(of(golden).keeps_history());
    check_goes_on(golden, test_device(), options_for(golden));
    golden.model = Model::filter("bicubic", 2);
    CHECK_FALSE(of(golden).keeps_history());
    check_goes_on(golden, test_device(), options_for(golden));
}

TEST_CASE("history with masks, effects, motion that has jitter in it, and half precision") {
    const Golden golden("enss_x2_table");
    const size_t pixels = static_cast<size_t>(golden.render.width) * golden.render.height;
    std::vector<float> mask(pixels);
    std::mt19937 random(3);
    for (float& value : mask) value = static_cast<float>(random() % 3) / 2;
    UpscalerOptions options = options_for(golden);
    options.reactive_format = ImageFormat{ElementType::f32, 1};
    options.antialias = options.antialias_input = Antialiasing::mlaa;
    options.sharpen = 0.3f;
    options.motion.jittered = true;
    options.precision = Precision::fp16;
    check_goes_on(golden, test_device(), options, [&](int number, FrameDescription& frame) {
        if (number % 2 == 1) frame.reactive_mask = {.host = mask.data(), .size = golden.render};
    });
}

TEST_CASE("history that goes on at another size of frames") {
    for (const char* name : {"enss_x2_table", "mnss_x2"}) {
        CAPTURE(name);
        const Golden golden(name);
        UpscalerOptions options = options_for(golden);
        options.dynamic_resolution = true;
        options.output_size = Size{2 * golden.render.width, 2 * golden.render.height};
        const auto [width, height] = golden.render;
        const std::vector<Size> sizes{
            golden.render, {width - 3, height - 2}, {width - 3, height - 2}, {width / 2, height / 2}, golden.render};
        check_goes_on(golden, test_device(), options, [&](int number, FrameDescription& frame) {
            const Size size = sizes[number % sizes.size()];
            frame.render_size = size;
            for (Image* image : {&frame.color, &frame.depth, &frame.motion}) image->size = size;
        });
    }
}

TEST_CASE("history that several devices keep") {
    const Device one_context = of_one_context(), two_contexts = of_two_contexts();
    for (const auto& [name, rules] : {std::pair("enss_x2_held", "*convolution*=1"), {"nss_x2", "*=1, *input*=0"}})
        for (const Device& device : {one_context, two_contexts}) {
            CAPTURE(name);
            const Golden golden(name);
            check_goes_on(golden, device, options_for(golden, rules));
            check_refused(Upscaler(device, golden.model, golden.render, options_for(golden, rules)),
                          history_of(golden, 2), "history: ");
        }
}

TEST_CASE("an interpolator goes on from the frame before") {
    const Size render{20, 14}, output{40, 28};
    std::mt19937 random(5);
    std::vector<std::vector<float>> colors(4, std::vector<float>(size_t{3} * output.width * output.height));
    for (std::vector<float>& color : colors)
        for (float& value : color) value = static_cast<float>(random() % 256) / 255;
    std::vector<float> depth(size_t{1} * render.width * render.height, 0.5f), motion(2 * depth.size(), 0.75f);
    const auto submit = [&](Interpolator& interpolator, size_t number) {
        std::vector<float> between(colors[number].size());
        FrameDescription frame;
        frame.color = {.host = colors[number].data(), .size = output};
        frame.depth = {.host = depth.data(), .size = render};
        frame.motion = {.host = motion.data(), .size = render};
        frame.output = {.host = between.data(), .size = output};
        interpolator.submit(frame).wait();
        return between;
    };
    Interpolator one(test_device(), render, output);
    Images expected;
    for (size_t number = 0; number < colors.size(); ++number) expected.push_back(submit(one, number));
    for (size_t split = 0; split < colors.size(); ++split) {
        Interpolator before(test_device(), render, output), after(test_device(), render, output);
        for (size_t number = 0; number < split; ++number) submit(before, number);
        after.restore_history(before.save_history());
        for (size_t number = split; number < colors.size(); ++number) CHECK(submit(after, number) == expected[number]);
    }
    CHECK(expected[1] != expected[2]);
}

TEST_CASE("frames in flight are in the history, and a reset leaves none") {
    const Golden golden("enss_x2_table");
    Film film(golden);
    const Bytes expected = history_of(golden, 3);
    Upscaler upscaler = of(golden, options_for(golden));
    Images outputs(3);
    std::vector<FrameEvent> events;
    for (int number = 0; number < 3; ++number)
        events.push_back(upscaler.submit(film.frame(number, upscaler, outputs[number])));
    CHECK(upscaler.save_history() == expected);
    events.back().wait();
    upscaler.reset();
    CHECK(upscaler.save_history() == of(golden).save_history());
    CHECK(upscaler.save_history().size() < expected.size());
    // It may go back, too.
    upscaler.restore_history(expected);
    Upscaler other = of(golden, options_for(golden));
    other.restore_history(expected);
    CHECK(shown(film, upscaler, 3, golden.frames) == shown(film, other, 3, golden.frames));
}

TEST_CASE("history that does not fit is refused, with what differs, and then there is none") {
    const Golden golden("enss_x2_table");
    const Bytes history = history_of(golden, 3);
    const auto text = [&](const std::string& bytes) {
        const auto span = std::as_bytes(std::span(bytes));
        return Bytes(span.begin(), span.end());
    };
    check_refused(of(golden), {}, "history");
    check_refused(of(golden), text("no history at all"), "history");
    for (const size_t size : {size_t{7}, size_t{200}, history.size() / 2, history.size() - 1})
        check_refused(of(golden), Bytes(history.begin(), history.begin() + static_cast<std::ptrdiff_t>(size)),
                      "history");
    check_refused(of(Golden("enss_x2_held")), history, "hash");
    check_refused(of(Golden("mnss_x2")), history, "hash");
    Golden filter("enss_x2_table");
    filter.model = Model::filter("fsr2", 2);
    check_refused(of(filter), history, "and this is fsr2 x2");
    check_refused(Upscaler(test_device(), golden.model, {golden.render.width + 2, golden.render.height}), history,
                  "its last frame was");
    UpscalerOptions half;
    half.precision = Precision::fp16;
    check_refused(of(golden, half), history, "f16");

    // What is forged is compared with what there is before it is used.
    std::string forged(reinterpret_cast<const char*>(history.data()), history.size());
    const auto replaced = [&](const std::string& old, const std::string& by) {
        REQUIRE(old.size() == by.size());
        std::string changed = forged;
        const size_t place = changed.find(old);
        REQUIRE(place != std::string::npos);
        return text(changed.replace(place, old.size(), by));
    };
    check_refused(of(golden), replaced("layout of part 0", "layout of part 1"), "layout of part 0");
    check_refused(of(golden), replaced("clarus history 1", "clarus history 2"), "clarus history 2");
    check_refused(of(golden), replaced("x4 f32", "x3 f32"), "x3 f32");

    Film film(golden);
    Upscaler upscaler = of(golden, options_for(golden)), fresh = of(golden, options_for(golden));
    shown(film, upscaler, 0, 2);
    CHECK_THROWS_AS(upscaler.restore_history(text("nonsense")), Error);
    CHECK(shown(film, upscaler, 2, 4) == shown(film, fresh, 2, 4));
}

TEST_CASE("history that other kernels go on with is told") {
    const Golden golden("enss_x2_table");
    const Bytes history = history_of(golden, 2);
    const Warnings warnings;
    of(golden).restore_history(history);
    CHECK(warnings.all == "");
    UpscalerOptions options;
    options.tuning = Tuning::obvious;
    of(golden, options).restore_history(history);
    CHECK_MESSAGE(warnings.all.find("last bits") != std::string::npos, warnings.all);
}
