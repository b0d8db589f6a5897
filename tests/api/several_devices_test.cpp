// One network on several devices: of one context, whose memory both see, and of two, between which it is copied.

#include "several_devices.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <future>
#include <latch>
#include <list>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "cache_folder.h"
#include "clarus/error.h"
#include "io/file.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::test;

namespace {

/// Rules that place each stage by chance.
std::string random_rules(const Upscaler& upscaler, unsigned seed) {
    std::mt19937 random(seed);
    std::string rules;
    for (const PlacedPart& part : upscaler.placement())
        for (const std::string& stage : part.stages)
            if (random() % 2 == 0) rules += stage + "=1,";
    return rules;
}

}  // namespace

TEST_CASE("a network that is cut anywhere computes the same bits") {
    const Device one_context = of_one_context(), two_contexts = of_two_contexts();
    const std::pair<const char*, const char*> cases[] = {
        {"enss_x2_held", "*convolution*=1"}, {"enss_x2_mlp", "*convolution*=1"},
        {"clarus_x2", "*convolution*=1"},    {"mnss_x2_checked", "*convolution*=1"},
        {"nsrr_x2_checked", "unet.*=1"},     {"srpo_x2", "convolution*=1"},
        {"nss_x2", "*=1, *input*=0"},        {"stack_int8_x2", ""}};
    for (const auto& [name, network] : cases) {
        CAPTURE(std::string(name));
        const test::Golden golden(name);
        Film film(golden);
        Upscaler alone(test_device(), golden.model, golden.render, options_for(golden));
        CHECK(alone.placement().empty());
        const Images expected = film.run(alone);
        const std::string random =
            random_rules(Upscaler(one_context, golden.model, golden.render, options_for(golden, "")), 7);
        for (const std::string& rules : {std::string(network), std::string("*=1"), random}) {
            CAPTURE(rules);
            for (const Device& device : {one_context, two_contexts}) {
                Upscaler upscaler(device, golden.model, golden.render, options_for(golden, rules));
                CHECK(film.run(upscaler) == expected);
                CHECK(film.run(upscaler).front() == expected.front());  // it goes on, from a reset
            }
        }
    }
}

TEST_CASE("a network in whole numbers that is cut between a CPU's kernels and a DSP's computes the same bits") {
    if (!test_device().profile().sub_devices) return;
    const std::string core = test_device().profile().selector + "/1";
    const Device both = Device::open(core + ", " + core + "=dsp");
    for (const auto& [name, rules] : {std::pair{"stack_int8_x2", "convolution 4=dsp"}, {"stack_int8_x2", "*=dsp"}}) {
        CAPTURE(std::string(rules));
        const test::Golden golden(name);
        Film film(golden);
        Upscaler alone(test_device(), golden.model, golden.render, options_for(golden));
        Upscaler cut(both, golden.model, golden.render, options_for(golden, rules));
        CHECK(film.run(cut) == film.run(alone));
    }
}

TEST_CASE("what whole numbers alone read is copied to another device in bytes, and stays in place where none is") {
    const test::Golden golden("mnss_x2");
    const Model model = Model::find("mnss-x2-int8");
    Film film(golden);
    Upscaler alone(test_device(), model, golden.render, options_for(golden));
    const Images expected = film.run(alone);
    const auto bytes_of = [&](const Device& device, const std::string& value) {
        Upscaler cut(device, model, golden.render, options_for(golden, "blending: convolution*=1"));
        CHECK(film.run(cut) == expected);
        size_t bytes = 0;
        for (const PlacedPart& part : cut.placement())
            for (const PlacedPart::Input& input : part.inputs)
                if (part.device == 1 && input.value == value) bytes += input.bytes;
        return bytes;
    };
    const size_t copied = bytes_of(of_two_contexts(), "blending: placed samples in bytes");
    const size_t read = bytes_of(of_one_context(), "blending: placed samples");
    CHECK(copied > 0);
    CHECK(copied < read / 3);  // a quarter, but for what stands after the last pixel
}

TEST_CASE("a network that is cut between two contexts computes the same bits") {
    const test::Golden golden("stack_int8_x2");
    Film film(golden);
    Upscaler alone(test_device(), golden.model, golden.render, options_for(golden));
    Upscaler cut(of_two_contexts(), golden.model, golden.render,
                 options_for(golden, "convolution 2=1, convolution 6=1"));
    CHECK(film.run(cut) == film.run(alone));
    CHECK(film.run(cut) == film.run(alone));  // what is handed over is written again
}

TEST_CASE("what is copied in bytes is the same by any storage and by kernels for a DSP") {
    for (const char* name : {"mnss-x2-int8", "enss-s-x2-int8"}) {
        const test::Golden golden(std::string(name).starts_with("mnss") ? "mnss_x2" : "enss_x2_table");
        const Model model = Model::find(name);
        Film film(golden);
        for (const Precision precision : {Precision::fp32, Precision::fp16}) {
            UpscalerOptions options = options_for(golden, "*convolution*=1");
            options.precision = precision;
            Upscaler cut(of_two_contexts(), model, golden.render, options);
            options.placement = "auto";
            Upscaler alone(test_device(), model, golden.render, options);
            CHECK(film.run(cut) == film.run(alone));
        }
        const Device dsp = Device::together({test_device(), Device::open(test_selector() + "=dsp")});
        Upscaler cut(dsp, model, golden.render, options_for(golden, "*convolution*=dsp"));
        Upscaler alone(test_device(), model, golden.render, options_for(golden));
        CHECK(film.run(cut) == film.run(alone));
    }
}

TEST_CASE("streams that share devices, each on a thread of its own, compute the same bits") {
    const test::Golden golden("mnss_x2_checked");
    for (const Device& device : {test_device(), of_one_context(), of_two_contexts()}) {
        const bool cuts = device.contexts().size() > 1;
        Film film(golden);
        Upscaler alone(test_device(), golden.model, golden.render, options_for(golden));
        const Images expected = film.run(alone);
        std::vector<std::future<Images>> streams;
        for (int stream = 0; stream < 4; ++stream)
            streams.push_back(std::async(std::launch::async, [&, stream] {
                Film own(golden);
                const std::string rules = stream % 2 == 0 ? "*convolution*=1" : "blending*=1";
                Upscaler upscaler(device, golden.model, golden.render, options_for(golden, cuts ? rules : "auto"));
                return own.run(upscaler);
            }));
        for (std::future<Images>& stream : streams) CHECK(stream.get() == expected);
    }
}

TEST_CASE("of ten streams on one device each has had a frame when the first has had all of its") {
    constexpr int streams = 10, frames = 30;
    constexpr Size size{480, 270};
    const std::vector<float> color(static_cast<size_t>(size.width) * size.height * 3, 0.5f);
    std::list<Upscaler> upscalers;
    for (int stream = 0; stream < streams; ++stream)
        upscalers.emplace_back(test_device(), Model::filter("lanczos", 2), size).prepare();
    std::array<std::atomic<int>, streams> done{};
    std::latch begun(streams);
    std::vector<std::future<int>> fewest;
    for (Upscaler& upscaler : upscalers)
        fewest.push_back(std::async(std::launch::async, [&, own = &done[fewest.size()]] {
            std::vector<float> output(4 * color.size());
            FrameDescription frame;
            frame.color = {.host = const_cast<float*>(color.data()), .size = size};
            frame.output = {.host = output.data(), .size = upscaler.output_size()};
            begun.arrive_and_wait();
            for (int number = 0; number < frames; ++number) {
                upscaler.submit(frame).wait();
                ++*own;
            }
            return std::min_element(done.begin(), done.end())->load();
        }));
    for (std::future<int>& each : fewest) CHECK(each.get() >= 1);
}

TEST_CASE("auto places by measuring and computes the same bits") {
    const test::Golden golden("srpo_x2");
    Film film(golden);
    Upscaler alone(test_device(), golden.model, golden.render, options_for(golden));
    const Images expected = film.run(alone);
    Upscaler upscaler(of_two_contexts(), golden.model, golden.render, options_for(golden));
    upscaler.prepare();
    double seconds = 0;
    size_t stages = 0;
    for (const PlacedPart& part : upscaler.placement()) {
        seconds += part.seconds;
        stages += part.stages.size();
    }
    CHECK(seconds > 0);
    CHECK(stages > 2);
    REQUIRE(upscaler.seconds_alone().size() == 2);
    for (const double each : upscaler.seconds_alone()) CHECK(each > 0);
    CHECK(film.run(upscaler) == expected);
}

TEST_CASE("what auto has chosen is kept, and nothing else that lies there is taken") {
    const test::Golden golden("srpo_x2");
    const TemporaryFolder folder;
    const CacheFolder cache(folder / "cache");
    const auto placed = [&](Tuning tuning = Tuning::stored) {
        UpscalerOptions options = options_for(golden);
        options.tuning = tuning;
        Upscaler upscaler(of_two_contexts(), golden.model, golden.render, options);
        upscaler.prepare();
        return upscaler.placement();
    };
    const std::filesystem::path placements = folder / "cache/placements";
    const std::vector<PlacedPart> first = placed();
    REQUIRE(std::distance(std::filesystem::directory_iterator(placements), {}) == 1);
    const std::filesystem::path file = std::filesystem::directory_iterator(placements)->path();
    nlohmann::json json = nlohmann::json::parse(io::read_file(file));
    const auto write = [&](const std::string& text) { std::ofstream(file) << text; };

    for (auto& place : json["places"]) place = 1;
    for (auto& device : json["seconds"])
        for (auto& seconds : device) seconds = 1e6;
    write(json.dump());
    const std::vector<PlacedPart> taken = placed();
    REQUIRE(taken.size() == 1);
    CHECK(taken[0].device == 1);
    CHECK(taken[0].seconds >= 1e6);

    for (const std::string& text : {std::string("{"), std::string("{}"), json.dump().substr(0, 20),
                                    std::string(R"({"places": [1], "seconds": [[0], [0]]})"),
                                    std::string(R"({"places": ["a"], "seconds": 3})")}) {
        write(text);
        CHECK(placed().front().seconds < 1e6);
    }
    json["places"][0] = 2;
    write(json.dump());
    CHECK(placed().front().seconds < 1e6);
    json["places"][0] = 1;
    write(json.dump());
    CHECK(placed(Tuning::measure).front().seconds < 1e6);
    CHECK(placed(Tuning::fixed).front().seconds < 1e6);
}

TEST_CASE("views, profiles and what was invalid come from the device that has them") {
    const test::Golden golden("mnss_x2_checked");
    Film film(golden);
    UpscalerOptions options = options_for(golden, "blending*=1");
    options.views = {"warped", "placed"};
    options.profile = true;
    UpscalerOptions alone_options = options;
    alone_options.placement = "auto";
    Upscaler upscaler(of_two_contexts(), golden.model, golden.render, options);
    Upscaler alone(test_device(), golden.model, golden.render, alone_options);
    const size_t count = static_cast<size_t>(golden.render.width) * golden.render.height;
    film.motion[2 * count + 4] = std::numeric_limits<float>::quiet_NaN();  // of the second frame
    std::vector<float> output;
    for (const int number : {0, 1}) {
        const unsigned invalid = alone.submit(film.frame(number, alone, output)).invalid_motion_vectors();
        CHECK(upscaler.submit(film.frame(number, upscaler, output)).invalid_motion_vectors() == invalid);
        if (number == 1) CHECK(invalid >= 1);
    }
    for (const std::string& view : options.views) CHECK(upscaler.view(view).pixels == alone.view(view).pixels);
    bool transfers = false;
    for (const StageProfile& stage : upscaler.take_profile()) {
        transfers = transfers || stage.name.starts_with("transfer: ");
        CHECK((stage.device < 0) == stage.name.starts_with("transfer: "));
        CHECK(stage.spans.size() >= 2);
    }
    CHECK(transfers);
    CHECK(upscaler.memory_requirements().arena > 0);
}

TEST_CASE("a frame that cannot be enqueued does not spoil those after it, on several devices") {
    const test::Golden golden("mnss_x2_checked");
    Film film(golden);
    Upscaler upscaler(of_two_contexts(), golden.model, golden.render, options_for(golden, "*convolution*=1"));
    const Images expected = film.run(upscaler);
    std::vector<float> output;
    FrameDescription frame = film.frame(0, upscaler, output);
    const cl::Context elsewhere(test_device().context().device());
    const cl::UserEvent foreign(elsewhere);
    const cl_event events[] = {foreign()};
    frame.wait_for = events;
    CHECK_THROWS_AS(upscaler.submit(frame), Error);
    CHECK(film.run(upscaler) == expected);
}

TEST_CASE("frames wait for the caller's events on whichever device reads them") {
    const test::Golden golden("mnss_x2_checked");
    Film film(golden);
    Upscaler upscaler(of_two_contexts(), golden.model, golden.render, options_for(golden, "*=1"));
    std::vector<float> expected, output;
    upscaler.submit(film.frame(0, upscaler, expected)).wait();
    FrameDescription frame = film.frame(0, upscaler, output);
    cl::UserEvent drawn(test_device().context().context());
    const cl_event events[] = {drawn()};
    frame.wait_for = events;
    const FrameEvent event = upscaler.submit(frame);
    CHECK(cl::Event(event.get(), true).getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() != CL_COMPLETE);
    drawn.setStatus(CL_COMPLETE);
    event.wait();
    CHECK(output == expected);
}

TEST_CASE("what several devices cannot do is refused") {
    const test::Golden golden("mnss_x2_checked");
    Film film(golden);
    const auto message = [&](const Device& device, const UpscalerOptions& options) -> std::string {
        try {
            Upscaler upscaler(device, golden.model, golden.render, options);
        } catch (const Error& error) {
            CHECK(error.kind() == ErrorKind::invalid_argument);
            return error.what();
        }
        return "";
    };
    CHECK(message(test_device(), options_for(golden, "*=0")).find("there is one") != std::string::npos);
    CHECK(message(of_one_context(), options_for(golden, "nothing=1")).find("nothing") != std::string::npos);
    UpscalerOptions dynamic = options_for(golden);
    dynamic.dynamic_resolution = true;
    CHECK(message(of_one_context(), dynamic).find("dynamic_resolution") != std::string::npos);
    UpscalerOptions exposed = options_for(golden);
    exposed.color_space = ColorSpace::linear;
    exposed.automatic_exposure = true;
    CHECK(message(of_one_context(), exposed).find("options.automatic_exposure: of one device") != std::string::npos);
    CHECK_THROWS_AS(Device::together({}), Error);

    Upscaler upscaler(of_two_contexts(), golden.model, golden.render, options_for(golden, ""));
    std::vector<float> output;
    FrameDescription frame = film.frame(0, upscaler, output);
    const cl::Buffer buffer(test_device().context().context(), CL_MEM_READ_WRITE, film.depth.size() * sizeof(float));
    frame.depth = {.buffer = buffer(), .size = golden.render};
    CHECK_THROWS_WITH_AS(upscaler.submit(frame), doctest::Contains("share no context"), Error);
}
