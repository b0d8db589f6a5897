#include <doctest/doctest.h>
#include <fmt/format.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "cache_folder.h"
#include "clarus/error.h"
#include "clarus/jitter.h"
#include "cli/output_folder.h"
#include "cli/quality_text.h"
#include "io/file.h"
#include "io/frames.h"
#include "io/image.h"
#include "io/sequence.h"
#include "metrics/display.h"
#include "metrics/if_ssim.h"
#include "metrics/masks.h"
#include "metrics/pixel_std.h"
#include "metrics/quality.h"
#include "metrics/radiance.h"
#include "model_file.h"
#include "noise_sequence.h"
#include "program.h"
#include "temporary_folder.h"
#include "test_device.h"

using namespace clarus;
using clarus::test::noise;
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr Size render_size{24, 16};
constexpr Size output_size{48, 32};
constexpr int frame_count = 4;
const std::string network = CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors";
const std::string network_x3 = CLARUS_GOLDEN_DIR "/enss_x3_table.model.safetensors";

struct Outcome {
    int exit_code = 0;
    std::string out, err;
};

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// Runs the tool in a shell, with what stands before it: variables, limits.
Outcome run_tool_after(const std::string& before, const std::vector<std::string>& arguments) {
    const TemporaryFolder folder;
    std::string line = before + " '" CLARUS_TOOL "'";
    for (const std::string& argument : arguments) line += " '" + argument + "'";
    line += fmt::format(" >'{}' 2>'{}'", (folder / "out").string(), (folder / "err").string());
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, io::read_file(folder / "out"), io::read_file(folder / "err")};
}

/// No file of more than 2 MiB, which is what PoCL writes while it looks up what it has compiled.
constexpr const char* kSmallFiles = "ulimit -f 4096; trap '' XFSZ;";

Outcome run_tool(const std::vector<std::string>& arguments) { return run_tool_after("", arguments); }

// A sequence of noise, written as a renderer would write one, and a place for results.
class Workplace {
  public:
    explicit Workplace(ColorSpace color_space = ColorSpace::srgb) {
        clarus::test::write_noise_sequence(sequence(), render_size, frame_count, color_space);
    }

    fs::path sequence() const { return folder_ / "sequence"; }
    fs::path output() const { return folder_ / "output"; }
    fs::path operator/(const fs::path& name) const { return folder_ / name; }

    /// Frames of another size, of colour alone.
    void enlarge(Size size) const {
        json changed = description();
        changed["render_size"] = {size.width, size.height};
        for (json& frame : changed["frames"]) {
            const std::string color = frame["color"];
            io::write_image(sequence() / color, noise(size, 3, 0, 1, 1), io::SampleType::u8);
            for (const char* key : {"depth", "motion", "reference"}) frame.erase(key);
        }
        describe(changed);
    }

    Outcome upscale(const std::string& model, std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments{"upscale",  sequence().string(), "--model",  model,
                                           "--output", output().string(),   "--device", test_selector()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_tool(arguments);
    }

    json description() const { return json::parse(io::read_file(sequence() / "sequence.json")); }
    void describe(const json& description) const { write("sequence/sequence.json", description.dump()); }
    void write(const fs::path& name, const std::string& text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }

    // Files in the output folder, "0000.png" or "views/alpha/0000.png". While a run writes and renames, too.
    std::set<std::string> outputs() const {
        std::set<std::string> names;
        if (!fs::is_directory(output())) return names;
        std::error_code gone;
        for (const auto& entry : fs::recursive_directory_iterator(output()))
            if (!entry.is_directory(gone)) names.insert(entry.path().lexically_relative(output()).string());
        return names;
    }

  private:
    TemporaryFolder folder_;
};

/// Without the state of a run that has not ended, which must be there.
std::set<std::string> without_state(std::set<std::string> outputs) {
    CHECK(outputs.erase(".clarus-run.safetensors") == 1);
    return outputs;
}

const std::set<std::string> all_png{"0000.png", "0001.png", "0002.png", "0003.png"};

// Exit code 1, one message that names the culprit, and nothing written.
void check_refused(const Workplace& place, const Outcome& outcome, const std::string& culprit) {
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.out == "");
    CHECK_MESSAGE(contains(outcome.err, "clarus: error: "), outcome.err);
    CHECK_MESSAGE(contains(outcome.err, culprit), outcome.err);
    CHECK(place.outputs().empty());
}

metrics::FrameQuality quality(const fs::path& image, const fs::path& reference) {
    return metrics::measure(metrics::display_values(io::read_image(image), ColorSpace::srgb),
                            metrics::display_values(io::read_image(reference), ColorSpace::srgb));
}

}  // namespace

TEST_CASE("upscale writes a PNG a frame, numbered like the input") {
    const Workplace place;
    for (const std::string& model : {std::string("bicubic"), network}) {
        const Outcome outcome = place.upscale(model);
        CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
        CHECK(contains(outcome.out, "PSNR"));
        CHECK(place.outputs() == all_png);
        CHECK(io::read_image_header(place.output() / "0003.png").size == output_size);
    }
}

TEST_CASE("upscale --format exr holds the same picture without rounding") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic", {"--format", "exr"}).exit_code == 0);
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const io::Pixels exact = io::read_image(place.output() / "0001.exr");
    const io::Pixels rounded = io::read_image(place.output() / "0001.png");
    REQUIRE(exact.values.size() == rounded.values.size());
    float largest = 0;
    for (size_t i = 0; i < exact.values.size(); ++i)
        largest = std::max(largest, std::abs(exact.values[i] - rounded.values[i]));
    CHECK(largest > 0);
    CHECK(largest <= 0.5f / 255 + 1e-5f);
}

TEST_CASE("upscale --png-compression changes files' sizes, never pixels") {
    const Workplace place;
    std::vector<std::vector<float>> values;
    std::vector<uintmax_t> sizes;
    for (const char* level : {"0", "1", "6", "9"}) {
        REQUIRE(place.upscale(network, {"--png-compression", level, "--view", "alpha"}).exit_code == 0);
        const fs::path file = place.output() / "0003.png";
        values.push_back(io::read_image(file).values);
        sizes.push_back(fs::file_size(file));
        CHECK(values.back() == values.front());
    }
    CHECK(sizes[0] > sizes[1]);
    CHECK(sizes[1] > sizes[2]);
    REQUIRE(place.upscale(network).exit_code == 0);
    CHECK(fs::file_size(place.output() / "0003.png") == sizes[1]);  // the default
    CHECK(place.upscale(network, {"--png-compression", "10"}).exit_code == 2);
}

TEST_CASE("frames are the same however many are under way at once") {
    const Workplace one_core, all_cores;
    const auto repeat = [](const Workplace& place) {  // more frames than most machines have cores
        json description = place.description();
        const json frames = description["frames"];
        for (int i = 1; i < 16; ++i)
            for (const json& frame : frames) description["frames"].push_back(frame);
        place.describe(description);
    };
    repeat(one_core);
    repeat(all_cores);
    const Outcome outcome =
        run_tool_after("taskset -c 0", {"upscale", one_core.sequence().string(), "--model", network, "--output",
                                        one_core.output().string(), "--device", test_selector()});
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    REQUIRE(all_cores.upscale(network).exit_code == 0);
    CHECK(all_cores.outputs() == one_core.outputs());
    CHECK(all_cores.outputs().size() == 16 * frame_count);
    for (const std::string& name : one_core.outputs())
        CHECK_MESSAGE(io::read_file(one_core.output() / name) == io::read_file(all_cores.output() / name), name);
}

TEST_CASE("upscale --frames takes a part, which starts anew") {
    const Workplace place;
    REQUIRE(place.upscale(network, {"--frames", "2:"}).exit_code == 0);
    CHECK(place.outputs() == std::set<std::string>{"0002.png", "0003.png"});
    const std::string started_at_2 = io::read_file(place.output() / "0002.png");

    json description = place.description();
    description["frames"][2]["reset"] = true;
    place.describe(description);
    REQUIRE(place.upscale(network).exit_code == 0);
    CHECK(io::read_file(place.output() / "0002.png") == started_at_2);

    const Workplace untouched;
    check_refused(untouched, untouched.upscale("bicubic", {"--frames", "2:5"}), "--frames 2:5");
}

TEST_CASE("upscale --frame-rate x2 writes a picture before each frame but the first") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const std::string without = io::read_file(place.output() / "0002.png");
    REQUIRE(place.upscale("bicubic", {"--frame-rate", "x2"}).exit_code == 0);
    std::set<std::string> names = all_png;
    names.insert({"0001-before.png", "0002-before.png", "0003-before.png"});
    CHECK(place.outputs() == names);
    CHECK(std::string("0001-before.png") < "0001.png");  // sorted by name they are in the order of time
    CHECK(io::read_file(place.output() / "0002.png") == without);
    CHECK(io::read_image_header(place.output() / "0001-before.png").size == output_size);
    // Compared are the frames that have references.
    CHECK(run_tool({"compare", place.output().string(), place.sequence().string()}).err == "");
    CHECK(contains(place.upscale("bicubic", {"--frame-rate", "x3"}).err, "x3"));
}

TEST_CASE("upscale of linear HDR writes linear EXR and refuses PNG") {
    const Workplace place(ColorSpace::linear);
    check_refused(place, place.upscale("bilinear", {"--format", "png"}), "--format exr");
    REQUIRE(place.upscale("bilinear").exit_code == 0);
    CHECK(place.outputs() == std::set<std::string>{"0000.exr", "0001.exr", "0002.exr", "0003.exr"});
    const io::Pixels image = io::read_image(place.output() / "0000.exr");
    CHECK(*std::max_element(image.values.begin(), image.values.end()) > 2);
}

TEST_CASE("pictures are as exact as the sequence's colour, unless told") {
    const Workplace place;
    const auto picture = [&](const std::vector<std::string>& options) {
        REQUIRE(place.upscale("bicubic", options).exit_code == 0);
        return place.output() / (std::count(options.begin(), options.end(), "exr") ? "0000.exr" : "0000.png");
    };
    const auto type = [&](const std::vector<std::string>& options) {
        return io::read_image_header(picture(options)).type;
    };
    const auto in_steps = [](const io::Pixels& pixels) {
        std::vector<long> steps;
        for (const float value : pixels.values) steps.push_back(std::lround(value * 65535));
        return steps;
    };
    const io::Pixels exact = io::read_image(picture({"--format", "exr"}));
    CHECK(type({}) == io::SampleType::u8);
    CHECK(type({"--format", "exr"}) == io::SampleType::f32);
    CHECK(type({"--bits", "16"}) == io::SampleType::u16);
    CHECK(in_steps(io::read_image(place.output() / "0000.png")) == in_steps(io::as_stored(exact, io::SampleType::u16)));
    CHECK(type({"--format", "exr", "--bits", "16"}) == io::SampleType::f16);
    CHECK(io::read_image(place.output() / "0000.exr").values == io::as_stored(exact, io::SampleType::f16).values);

    io::write_image(place.sequence() / "color/0000.png", noise(render_size, 3, 0, 1, 1), io::SampleType::u16);
    CHECK(type({}) == io::SampleType::u16);
    CHECK(type({"--bits", "8"}) == io::SampleType::u8);
    CHECK(type({"--format", "exr"}) == io::SampleType::f32);

    const Workplace linear(ColorSpace::linear);
    io::write_image(linear.sequence() / "color/0000.exr", noise(render_size, 3, 0, 5, 1), io::SampleType::f16);
    REQUIRE(linear.upscale("bicubic").exit_code == 0);
    CHECK(io::read_image_header(linear.output() / "0000.exr").type == io::SampleType::f16);
    REQUIRE(linear.upscale("bicubic", {"--bits", "32"}).exit_code == 0);
    CHECK(io::read_image_header(linear.output() / "0000.exr").type == io::SampleType::f32);
}

TEST_CASE("bits that a format has not are refused") {
    const Workplace place;
    check_refused(place, place.upscale("bicubic", {"--bits", "32"}), "use --format exr");
    check_refused(place, place.upscale("bicubic", {"--format", "exr", "--bits", "8"}), "use --format png");
    CHECK(contains(place.upscale("bicubic", {"--bits", "12"}).err, "--bits"));
}

TEST_CASE("alpha is upscaled as bicubic upscales a grey colour, and kept unless told") {
    constexpr float close = 1e-6f;
    // Frame 0 has noise for alpha, frame 1 has none, frame 2 is opaque.
    const auto set_jitter = [](const Workplace& place, Vec2 jitter) {
        json changed = place.description();
        for (json& frame : changed["frames"]) frame["jitter"] = {jitter.x, jitter.y};
        place.describe(changed);
    };
    const auto save = [](const Workplace& place, const char* name, const io::Pixels& pixels) {
        io::write_image(place.sequence() / "color" / name, pixels, io::SampleType::u8);
    };
    const Workplace with, without, grey;
    io::Pixels color = noise(render_size, 4, 0, 1, 1), rest{render_size, 3, {}}, mask{render_size, 3, {}};
    for (size_t i = 0; i < color.values.size(); i += 4) {
        rest.values.insert(rest.values.end(), &color.values[i], &color.values[i] + 3);
        mask.values.insert(mask.values.end(), 3, color.values[i + 3]);
    }
    save(with, "0000.png", color);
    save(without, "0000.png", rest);
    save(grey, "0000.png", mask);
    for (size_t i = 3; i < color.values.size(); i += 4) color.values[i] = 1;
    save(with, "0002.png", color);
    save(without, "0002.png", rest);
    const auto upscaled = [](const Workplace& place, const std::string& model, const char* name,
                             std::vector<std::string> more = {}) {
        more.insert(more.end(), {"--format", "exr"});
        const Outcome outcome = place.upscale(model, more);
        REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
        return io::read_image(place.output() / name);
    };
    const auto check = [&](const std::string& model) {
        const io::Pixels result = upscaled(with, model, "0000.exr");
        const io::Pixels opaque = io::read_image(with.output() / "0002.exr");
        CHECK(io::read_image_header(with.output() / "0001.exr").channels == 3);
        const io::Pixels colors = upscaled(without, model, "0000.exr"), alpha = upscaled(grey, "bicubic", "0000.exr");
        REQUIRE(result.channels == 4);
        REQUIRE(opaque.channels == 4);
        REQUIRE(result.size == output_size);
        size_t wrong = 0;
        for (size_t i = 0; i < result.values.size() / 4; ++i) {
            for (size_t c = 0; c < 3; ++c) wrong += result.values[4 * i + c] != colors.values[3 * i + c];
            wrong += std::abs(result.values[4 * i + 3] - std::clamp(alpha.values[3 * i], 0.0f, 1.0f)) > close;
            wrong += opaque.values[4 * i + 3] != 1;
        }
        CHECK(wrong == 0);
    };
    for (const Workplace* place : {&with, &without, &grey}) set_jitter(*place, {0.25f, -0.125f});
    check("bicubic");
    set_jitter(grey, {});  // as a model that does not take jitter out
    check(CLARUS_GOLDEN_DIR "/srpo_x2.model.safetensors");

    CHECK(with.upscale("bicubic").err == "");
    CHECK(io::read_image_header(with.output() / "0000.png").channels == 4);
    CHECK(with.upscale("bicubic", {"--alpha", "drop"}).err == "");
    CHECK(io::read_image_header(with.output() / "0000.png").channels == 3);
    const Outcome doubled = with.upscale("bicubic", {"--frame-rate", "x2"});
    CHECK_MESSAGE(contains(doubled.err, "frames in between (--frame-rate x2) have no alpha"), doubled.err);
    CHECK(io::read_image_header(with.output() / "0000.png").channels == 3);
    CHECK(with.upscale("bicubic", {"--frame-rate", "x2", "--alpha", "drop"}).err == "");
    const Outcome refused = with.upscale("bicubic", {"--frame-rate", "x2", "--alpha", "keep"});
    CHECK(refused.exit_code == 1);
    CHECK_MESSAGE(contains(refused.err, "leave --alpha keep out"), refused.err);
}

TEST_CASE("a filter takes any scale") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic", {"--scale", "1.5"}).exit_code == 0);
    CHECK(io::read_image_header(place.output() / "0000.png").size == Size{36, 24});
}

TEST_CASE("a network of any scale whose file says none takes the sequence's, or any") {
    const TemporaryFolder folder;
    const fs::path published = folder / "published.safetensors";
    ModelFile file = ModelFile::read(CLARUS_GOLDEN_DIR "/nss_x2.model.safetensors");
    file.header.erase("__metadata__");
    file.write(published);
    const Workplace place;
    REQUIRE(place.upscale(published.string()).exit_code == 0);
    CHECK(io::read_image_header(place.output() / "0000.png").size == output_size);
    REQUIRE(place.upscale(published.string(), {"--scale", "1.5"}).exit_code == 0);
    CHECK(io::read_image_header(place.output() / "0000.png").size == Size{36, 24});
    const Workplace untouched;
    check_refused(untouched, untouched.upscale(published.string(), {"--scale", "4"}),
                  "scale 4; this model's are from 1 to 3");
    check_refused(untouched, untouched.upscale(CLARUS_GOLDEN_DIR "/nss_x2.model.safetensors", {"--scale", "1.5"}),
                  "not by --scale 1.5");
}

TEST_CASE("upscale --output-size resamples what a model makes, or asks a model of any scale for it") {
    const Workplace place;
    const auto size = [&] { return io::read_image_header(place.output() / "0002.png").size; };
    Outcome outcome = place.upscale(network, {"--output-size", "60x25", "--profile", "--view", "alpha"});
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    CHECK(size() == Size{60, 25});
    CHECK(contains(outcome.out, "resampling 48x32 to 60x25\n"));
    CHECK(contains(outcome.out, "output size"));
    CHECK_FALSE(contains(outcome.out, "PSNR"));
    CHECK(io::read_image_header(place.output() / "views/alpha/0002.png").size == output_size);
    // Made for another scale than the sequence.
    REQUIRE(place.upscale(network_x3, {"--output-size", "48x32"}).exit_code == 0);
    CHECK(size() == output_size);
    // A filter's own scale does it, where one does.
    outcome = place.upscale("bicubic", {"--output-size", "36x24", "--profile"});
    CHECK(size() == Size{36, 24});
    CHECK_FALSE(contains(outcome.out, "output size"));
    CHECK(contains(place.upscale("bicubic", {"--output-size", "36x30"}).out, "resampling 45x30 to 36x30\n"));
    CHECK(contains(place.upscale("bicubic", {"--output-size", "12x9"}).out, "resampling 24x16 to 12x9\n"));
    CHECK(contains(place.upscale("bicubic", {"--scale", "2", "--output-size", "36x24"}).out, "48x32 to 36x24\n"));
    CHECK_FALSE(contains(place.upscale("bicubic", {"--output-size", "40x27"}).out, "resampling"));
    // Pictures in between have one scale.
    REQUIRE(place.upscale("bicubic", {"--output-size", "36x24", "--frame-rate", "x2"}).exit_code == 0);
    CHECK(io::read_image_header(place.output() / "0002-before.png").size == Size{36, 24});

    const Workplace untouched;
    check_refused(untouched, untouched.upscale(network, {"--output-size", "193x32"}), "the model makes 48x32");
    check_refused(untouched, untouched.upscale(network, {"--output-size", "48x7"}), "output size 48x7");
    check_refused(untouched, untouched.upscale(network_x3), "--output-size");
    for (const char* wrong : {"48", "48x", "0x32", "48x-32", "48x32x2"}) {
        outcome = untouched.upscale(network, {"--output-size", wrong});
        CHECK(outcome.exit_code == 2);
        CHECK(contains(outcome.err, "not WIDTHxHEIGHT"));
    }
}

TEST_CASE("a sequence's references may have the output size that it says") {
    const Workplace place;
    const Size size{40, 29};
    json description = place.description();
    description["output_size"] = {size.width, size.height};
    place.describe(description);
    check_refused(place, place.upscale(network), "48x32 pixels where the sequence has 40x29 for the reference");
    for (const json& frame : description["frames"])
        io::write_image(place.sequence() / std::string(frame["reference"]), noise(size, 3, 0, 1, 7),
                        io::SampleType::u8);
    for (const std::string& model : {network, network_x3, std::string("bicubic")}) {
        const Outcome outcome = place.upscale(model);
        REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
        CHECK(contains(outcome.out, "to 40x29, the output_size of the sequence\n"));
        CHECK(contains(outcome.out, "PSNR"));
        CHECK(io::read_image_header(place.output() / "0001.png").size == size);
    }
    const Outcome compared = run_tool({"compare", place.output().string(), place.sequence().string()});
    CHECK_MESSAGE(compared.exit_code == 0, compared.err);
    CHECK(contains(compared.out, "PSNR"));
    // --scale alone is the output's.
    REQUIRE(place.upscale("bicubic", {"--scale", "1.5"}).exit_code == 0);
    CHECK(io::read_image_header(place.output() / "0001.png").size == Size{36, 24});
}

TEST_CASE("upscale takes a sequence whose resolution changes, to one output size") {
    const Workplace place;
    const Size size{18, 12};
    json description = place.description();
    json& changed = description["frames"][2];
    changed["render_size"] = {size.width, size.height};
    place.describe(description);
    check_refused(place, place.upscale(network), "24x16 pixels where the sequence has 18x12 for colour");
    io::write_image(place.sequence() / std::string(changed["color"]), noise(size, 3, 0, 1, 1), io::SampleType::u8);
    io::write_image(place.sequence() / std::string(changed["depth"]), noise(size, 1, 0, 1, 2), io::SampleType::f32);
    io::write_image(place.sequence() / std::string(changed["motion"]), noise(size, 2, -2, 2, 3), io::SampleType::f32);
    for (const std::string& model : {network, std::string("bicubic")}) {
        const Outcome outcome = place.upscale(model, {"--frame-rate", "x2"});
        REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
        CHECK(contains(outcome.out, "PSNR"));
        for (const auto& file : place.outputs())
            CHECK(io::read_image_header(place.output() / file).size == output_size);
        fs::remove_all(place.output());
    }
}

TEST_CASE("every filter is a model") {
    const Workplace place;
    for (const char* filter : {"nearest", "lanczos", "fsr1", "fsr2"}) {
        CAPTURE(std::string(filter));
        REQUIRE(place.upscale(filter, {"--scale", "1.7"}).exit_code == 0);
        CHECK(io::read_image_header(place.output() / "0000.png").size == Size{41, 27});
    }
    REQUIRE(place.upscale("fsr1", {"--sharpness", "0"}).exit_code == 0);
    const Workplace untouched;
    check_refused(untouched, untouched.upscale("fsr1", {"--sharpness", "2"}), "from 0 to 1");
    check_refused(untouched, untouched.upscale("bicubic", {"--sharpness", "0.5"}), "bicubic has no option sharpness");
}

TEST_CASE("upscale sharpens and antialiases where it is told to") {
    const Workplace place;
    io::Pixels stairs{render_size, 3, {}};
    for (int y = 0; y < render_size.height; ++y)
        for (int x = 0; x < render_size.width; ++x)
            stairs.values.insert(stairs.values.end(), 3, x / 4 < y ? 0.9f : 0.2f);
    io::write_image(place.sequence() / "color/0002.png", stairs, io::SampleType::u8);
    const auto picture = [&](const std::vector<std::string>& options) {
        const Outcome outcome = place.upscale("nearest", options);
        REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
        return io::read_image(place.output() / "0002.png").values;
    };
    const std::vector<float> plain = picture({}), sharper = picture({"--sharpen"});
    CHECK(sharper != plain);
    CHECK(picture({"--sharpen", "0.5"}) != sharper);
    CHECK(picture({"--sharpen", "0.15"}) == sharper);
    CHECK(picture({"--sharpen", "0"}) == plain);

    // Where an image only goes through, before and after are the same.
    const std::vector<float> smoother = picture({"--scale", "1", "--antialias", "mlaa"});
    CHECK(smoother != picture({"--scale", "1"}));
    CHECK(picture({"--scale", "1", "--antialias-input", "mlaa"}) == smoother);
    const Workplace untouched;
    check_refused(untouched, untouched.upscale("bicubic", {"--sharpen", "2"}), "sharpen");
    CHECK(untouched.upscale("bicubic", {"--antialias", "fxaa"}).exit_code == 2);
}

TEST_CASE("upscale --report says what was run, how well and with what") {
    const Workplace place;
    const fs::path file = place / "report.json";
    REQUIRE(place.upscale(network, {"--report", file.string()}).exit_code == 0);
    const json report = json::parse(io::read_file(file));
    CHECK(report["model"]["pipeline"] == "enss");
    CHECK(report["render_size"] == json{24, 16});
    CHECK(report["output_size"] == json{48, 32});
    CHECK(report["devices"][0]["driver_version"].get<std::string>() == test_device().profile().driver_version);
    CHECK(report["memory"]["arena"].get<size_t>() >= report["memory"]["peak_live_bytes"].get<size_t>());
    CHECK(report["memory"]["peak_live_bytes"].get<size_t>() > 0);
    REQUIRE(report["stages"].size() > 3);
    for (const json& stage : report["stages"]) CHECK(stage["seconds"].get<double>() >= 0);
    REQUIRE(report["frames"].size() == frame_count);

    double psnr_sum = 0;
    for (int i = 0; i < frame_count; ++i) {
        const std::string name = fmt::format("{:04}", i);
        CHECK(report["frames"][i]["name"] == name);
        CHECK(report["frames"][i]["invalid_motion_vectors"] == 0);
        // The report's figures come from before the PNG's rounding.
        const auto expected =
            quality(place.output() / (name + ".png"), place.sequence() / "reference" / (name + ".png"));
        CHECK(report["frames"][i]["psnr"].get<double>() == doctest::Approx(expected.psnr).epsilon(0.001));
        CHECK(report["frames"][i]["ssim"].get<double>() == doctest::Approx(*expected.ssim).epsilon(0.01));
        psnr_sum += report["frames"][i]["psnr"].get<double>();
    }
    CHECK(report["quality"]["psnr"].get<double>() == doctest::Approx(psnr_sum / frame_count));
}

TEST_CASE("upscale --trace writes spans of every stage and frame") {
    const Workplace place;
    const fs::path file = place / "trace.json";
    const Outcome outcome = place.upscale(network, {"--trace", file.string(), "--profile"});
    REQUIRE(outcome.exit_code == 0);
    CHECK(contains(outcome.out, "GFLOP/s"));

    const json trace = json::parse(io::read_file(file));
    std::map<std::string, std::set<std::string>> frames_of;
    std::map<int, std::string> tracks;
    std::map<int, std::map<double, double>> ends;  // by track and start
    for (const json& event : trace["traceEvents"]) {
        const int track = event["tid"];
        if (event["ph"] == "M") tracks[track] = event["args"]["name"];
        if (event["ph"] != "X") continue;
        CHECK(event["dur"].get<double>() >= 0);
        CHECK(contains(tracks[track], "writer") == (event["name"] == "write"));
        ends[track][event["ts"]] = event["ts"].get<double>() + event["dur"].get<double>();
        frames_of[event["name"]].insert(event["args"]["frame"].get<std::string>());
    }
    CHECK(frames_of["write"].size() == frame_count);
    for (const auto& [track, spans] : ends) {
        if (!contains(tracks[track], "writer")) continue;
        double last = 0;
        for (const auto& [start, end] : spans) {  // viewers show a track's spans side by side, or one inside another
            CHECK(start >= last);
            last = end;
        }
    }
    size_t stages = 0;
    for (const auto& [name, frames] : frames_of) {
        CHECK_MESSAGE(frames.size() == frame_count, name);
        stages += contains(outcome.out, name);
    }
    CHECK(stages > 3);
}

TEST_CASE("upscale --place names stages that only alpha brings") {
    if (!test_device().profile().sub_devices) return;
    const Workplace place;
    const std::vector<std::string> arguments{
        "upscale",  place.sequence().string(), "--model",  "bicubic",
        "--output", place.output().string(),   "--device", test_selector() + "/1, " + test_selector() + "/1=dsp",
        "--place",  "alpha channel*=dsp"};
    const Outcome without = run_tool(arguments);
    CHECK(without.exit_code == 1);
    CHECK_MESSAGE(contains(without.err, "no stage is called 'alpha channel*'"), without.err);
    io::write_image(place.sequence() / "color/0000.png", noise(render_size, 4, 0, 1, 1), io::SampleType::u8);
    const Outcome with = run_tool(arguments);
    CHECK_MESSAGE(with.exit_code == 0, with.err);
    CHECK(io::read_image_header(place.output() / "0000.png").channels == 4);
}

TEST_CASE("upscale --explain-placement prints what each device makes, by rules of any length or of a file") {
    if (!test_device().profile().sub_devices) return;
    const Workplace place;
    const auto explained = [&](const std::string& rules) {
        return run_tool({"upscale", place.sequence().string(), "--model", network, "--output", place.output().string(),
                         "--device", test_selector() + "/1, " + test_selector() + "/1=dsp", "--place", rules,
                         "--frames", ":1", "--explain-placement"});
    };
    std::string rules = "*convolution*=dsp";
    while (rules.size() < 300) rules += ", last convolution=dsp";
    const Outcome given = explained(rules);
    REQUIRE_MESSAGE(given.exit_code == 0, given.err);
    CHECK_MESSAGE(contains(given.out, "MB in  stages\n0: "), given.out);
    CHECK_MESSAGE(contains(given.out, "\n1: "), given.out);
    CHECK_MESSAGE(contains(given.out, "last convolution"), given.out);

    const std::filesystem::path file = place.sequence().parent_path() / "rules";
    std::ofstream(file) << "# the network\n*convolution*=dsp\n";
    const Outcome of_file = explained(file.string());
    REQUIRE_MESSAGE(of_file.exit_code == 0, of_file.err);
    const auto table = [](const std::string& out) {
        const size_t first = out.find("device "), end = out.find("made frames");
        return out.substr(first, end - first);
    };
    CHECK(table(of_file.out) == table(given.out));

    const Outcome measured = explained("auto");
    REQUIRE_MESSAGE(measured.exit_code == 0, measured.err);
    CHECK_MESSAGE(contains(measured.out, "\n0 alone "), measured.out);
    CHECK_MESSAGE(contains(measured.out, "\n1 alone "), measured.out);
    CHECK(!contains(given.out, "alone"));

    std::ofstream(file) << "# nothing yet\n";
    const Outcome of_nothing = explained(file.string());
    CHECK(of_nothing.exit_code == 1);
    CHECK_MESSAGE(contains(of_nothing.err, "has no rule"), of_nothing.err);
}

TEST_CASE("upscale --fallback goes on without a device that is lost") {
    if (!test_device().profile().sub_devices) return;
    const Workplace place;
    const std::vector<std::string> arguments{
        "upscale",  place.sequence().string(), "--model",  network,
        "--output", place.output().string(),   "--device", test_selector() + "/1, " + test_selector() + "/1=dsp",
        "--place",  "*convolution*=dsp"};
    const std::string lost = "OPENCL_LAYERS='" CLARUS_FAULTS_LAYER "' CLARUS_FAULTS='markers 0 2'";
    const Outcome without = run_tool_after(lost, arguments);
    CHECK(without.exit_code == 1);
    CHECK_MESSAGE(contains(without.err, "clarus: error: device "), without.err);
    std::vector<std::string> with = arguments;
    with.push_back("--fallback");
    const Outcome outcome = run_tool_after(lost, with);
    CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
    CHECK_MESSAGE(contains(outcome.err, "stages go on on device "), outcome.err);
    CHECK(place.outputs() == all_png);
}

TEST_CASE("upscale --view writes what the pipeline saw") {
    const Workplace place;
    const Outcome list = place.upscale(network, {"--view", "list"});
    REQUIRE(list.exit_code == 0);
    CHECK(contains(list.out, "alpha\n"));
    CHECK(place.outputs().empty());

    check_refused(place, place.upscale(network, {"--view", "entrails"}), "entrails");

    REQUIRE(place.upscale(network, {"--view", "alpha", "--view", "motion", "--frames", ":2"}).exit_code == 0);
    CHECK(place.outputs() == std::set<std::string>{".clarus-run.safetensors", "0000.png", "0001.png",
                                                   "views/alpha/0000.png", "views/alpha/0001.png",
                                                   "views/motion/0000.png", "views/motion/0001.png"});
    const io::Pixels alpha = io::read_image(place.output() / "views/alpha/0001.png");
    CHECK(alpha.size == output_size);
    CHECK(alpha.at(3, 3, 0) == alpha.at(3, 3, 2));
}

TEST_CASE("a second start compiles no kernel") {
    const Workplace place;
    const std::string cache = "CLARUS_CACHE_DIR='" + (place / "cache").string() + "'";
    const auto programs_compiled = [&] {
        const fs::path report = place / "report.json";
        const Outcome outcome =
            run_tool_after(cache, {"upscale", place.sequence().string(), "--model", network, "--output",
                                   place.output().string(), "--device", test_selector(), "--report", report.string()});
        REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
        return json::parse(io::read_file(report))["programs_compiled"].get<int>();
    };
    CHECK(programs_compiled() > 0);
    CHECK(programs_compiled() == 0);
}

TEST_CASE("motion that cannot be is counted and leaves no trace in later frames") {
    const Workplace place;
    const fs::path motion = place.sequence() / "motion/0001.exr";
    io::Pixels vectors = io::read_image(motion);
    vectors.at(3, 4, 0) = std::numeric_limits<float>::quiet_NaN();
    vectors.at(5, 6, 1) = std::numeric_limits<float>::infinity();
    vectors.at(7, 8, 0) = 1e30f;
    io::write_image(motion, vectors, io::SampleType::f32);

    const fs::path report = place / "report.json";
    const Outcome outcome = place.upscale(network, {"--format", "exr", "--report", report.string()});
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    CHECK_MESSAGE(contains(outcome.err, "3 motion vectors in 1 of 4 frames"), outcome.err);
    const json frames = json::parse(io::read_file(report))["frames"];
    CHECK(frames[1]["invalid_motion_vectors"] == 3);
    CHECK(frames[2]["invalid_motion_vectors"] == 0);
    for (const std::string& name : place.outputs())
        for (const float value : io::read_image(place.output() / name).values)
            if (!(value >= 0 && value <= 1)) FAIL(name << " holds " << value);
}

TEST_CASE("upscale warns once of jitter that the model has no kernels for") {
    const Workplace place;
    json description = place.description();
    const auto warnings = [&](const std::string& model, std::array<double, frame_count> distances) {
        for (int i = 0; i < frame_count; ++i)  // from the table's entry (-1/4, 1/6)
            description["frames"][i]["jitter"] = {-0.25, 1.0 / 6 - distances[i]};
        place.describe(description);
        const Outcome outcome = place.upscale(model);
        CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
        return outcome.err;
    };
    CHECK(warnings(network, {0, 0.009, 0.0005, 0}) == "");
    const std::string warning = warnings(network, {0, 0.012, 0.034, 0.02});
    CHECK_MESSAGE(contains(warning, "jitter up to 0.034 pixels away"), warning);
    CHECK(std::count(warning.begin(), warning.end(), '\n') == 1);

    const fs::path single = place / "single.safetensors";
    ModelFile::read(network).with_single_entry().write(single);
    CHECK(warnings(single, {0, 0.012, 0.034, 0.02}) == "");
}

TEST_CASE("an image that ends early ends the run at its frame") {
    const Workplace place, whole;
    const char* file = "";
    SUBCASE("colour") { file = "color/0002.png"; }
    SUBCASE("depth") { file = "depth/0002.exr"; }
    SUBCASE("motion") { file = "motion/0002.exr"; }
    SUBCASE("reference") { file = "reference/0002.png"; }
    const fs::path damaged = place.sequence() / file;
    fs::resize_file(damaged, fs::file_size(damaged) * 2 / 3);
    REQUIRE(io::read_image_header(damaged).size.width > 0);  // so that it is met in the middle

    REQUIRE(whole.upscale(network).exit_code == 0);
    const Outcome outcome = place.upscale(network, {"--report", (place / "report.json").string()});
    CHECK(outcome.exit_code == 1);
    CHECK_MESSAGE(contains(outcome.err, file), outcome.err);
    CHECK_FALSE(fs::exists(place / "report.json"));
    const std::set<std::string> outputs = without_state(place.outputs());
    CHECK(outputs == std::set<std::string>{"0000.png", "0001.png"});
    for (const std::string& name : outputs)
        CHECK(io::read_file(place.output() / name) == io::read_file(whole.output() / name));
}

TEST_CASE("frames before one that is broken are there, wherever it is") {
    const Workplace whole;
    REQUIRE(whole.upscale("bicubic").exit_code == 0);
    for (const size_t broken : {1, 2, 3}) {
        const Workplace place;
        const fs::path damaged = place.sequence() / fmt::format("color/{:04}.png", broken);
        fs::resize_file(damaged, fs::file_size(damaged) * 2 / 3);
        CHECK(place.upscale("bicubic").exit_code == 1);
        const std::set<std::string> outputs = without_state(place.outputs());
        CHECK(outputs.size() == broken);
        for (const std::string& name : outputs)
            CHECK(io::read_file(place.output() / name) == io::read_file(whole.output() / name));
    }
}

TEST_CASE("what is wrong with a picture is said by us alone, in a line") {
    const Workplace place;
    const fs::path damaged = place.sequence() / "color/0001.png";
    std::string bytes = io::read_file(damaged);
    for (const size_t part : {2, 3, 5}) {
        std::string wrong = bytes;
        wrong[wrong.size() / part] ^= 0x55;
        place.write("sequence/color/0001.png", wrong);
        const Outcome outcome = place.upscale("bicubic");
        CHECK(outcome.exit_code == 1);
        CHECK_MESSAGE(outcome.err.starts_with("clarus: error: cannot read image"), outcome.err);
        CHECK_MESSAGE(contains(outcome.err, "does not have its checksum"), outcome.err);
        CHECK_MESSAGE(std::ranges::count(outcome.err, '\n') == 1, outcome.err);
    }
}

TEST_CASE("without a home there is no cache, and the working folder's is not used") {
    const Workplace place;
    const std::vector<std::string> command{"upscale",  place.sequence().string(), "--model",  "bicubic",
                                           "--output", place.output().string(),   "--device", test_selector()};
    fs::create_directories(place / "clarus/programs");
    const std::string without =
        fmt::format("cd '{}' && env -u XDG_CACHE_HOME -u CLARUS_CACHE_DIR", (place / "").string());
    for (const char* home : {"HOME=relative", "HOME=relative XDG_CACHE_HOME=relative"}) {
        const Outcome outcome = run_tool_after(fmt::format("{} {}", without, home), command);
        CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
        CHECK(fs::is_empty(place / "clarus/programs"));
        CHECK_FALSE(fs::exists(place / "relative/clarus"));
        CHECK_FALSE(fs::exists(place / "relative/.cache/clarus"));
        fs::remove_all(place.output());
    }
}

TEST_CASE("what is printed and does not arrive is a failure") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const std::vector<std::vector<std::string>> commands{
        {"models"},
        {"--version"},
        {"upscale", "--help"},
        {"compare", place.output().string(), place.sequence().string(), "--json"},
        {"compare", place.output().string(), place.sequence().string(), "--csv"},
        {"devices"},
        {"model", "bicubic"},
        {"report", place.output().string(), "--sequence", place.sequence().string(), "-o",
         (place / "page.html").string()},
        {"upscale", place.sequence().string(), "--model", "bicubic", "--output", place.output().string(), "--device",
         test_selector()}};
    for (const std::vector<std::string>& command : commands) {
        CAPTURE(command.front());
        const Outcome full = run_tool_after("f() { \"$@\" >/dev/full; }; f", command);
        CHECK(full.exit_code == 1);
        CHECK_MESSAGE(contains(full.err, "cannot write to standard output: No space left"), full.err);
        const Outcome closed = run_tool_after("f() { \"$@\" >&-; }; f", command);
        CHECK(closed.exit_code == 1);
        CHECK_MESSAGE(contains(closed.err, "cannot write to standard output"), closed.err);
    }
}

TEST_CASE("names do not command a terminal") {
    const Workplace place;
    const std::string name = "\033]0;owned\a";
    const Outcome error = run_tool({"compare", (place / name).string(), place.sequence().string()});
    CHECK(error.exit_code == 1);
    CHECK_FALSE(contains(error.err, "\033"));
    CHECK_MESSAGE(contains(error.err, "\\x1b]0;owned\\x07"), error.err);
    for (const std::vector<std::string>& wrong : {std::vector<std::string>{name}, {"--bits", name}}) {
        const Outcome usage = place.upscale("bicubic", wrong);
        CHECK(usage.exit_code == 2);
        CHECK_FALSE(contains(usage.err, "\033"));
        CHECK_MESSAGE(contains(usage.err, "owned"), usage.err);
    }

    REQUIRE(place.upscale("bicubic").exit_code == 0);
    for (const char* other : {"one", "other"}) fs::copy(place.output(), place / (name + other));
    int terminal = -1;
    const pid_t tool = forkpty(&terminal, nullptr, nullptr, nullptr);
    REQUIRE(tool >= 0);
    if (tool == 0) {
        execl(CLARUS_TOOL, CLARUS_TOOL, "compare", (place / (name + "one")).c_str(), (place / (name + "other")).c_str(),
              place.sequence().c_str(), nullptr);
        _exit(127);
    }
    std::string shown;
    for (std::array<char, 4096> some; true;) {
        const ssize_t count = read(terminal, some.data(), some.size());
        if (count <= 0) break;
        shown.append(some.data(), static_cast<size_t>(count));
    }
    close(terminal);
    int status = -1;
    REQUIRE(waitpid(tool, &status, 0) == tool);
    CHECK_MESSAGE(status == 0, shown);
    CHECK_FALSE(contains(shown, "\033]"));
    CHECK_MESSAGE(contains(shown, "\\x1b]0;owned\\x07one"), shown);
    CHECK(contains(shown, "\033[1m"));
}

TEST_CASE("runs into one folder at a time do not meet, and one that is ended leaves nothing half-written") {
    const Workplace place;
    json many = place.description();
    const json few = many["frames"];
    for (int i = 0; i < 40; ++i)
        for (const json& frame : few) many["frames"].push_back(frame);
    place.describe(many);
    const std::vector<std::string> command{"upscale",  place.sequence().string(), "--model",  "bicubic",
                                           "--output", place.output().string(),   "--device", test_selector()};
    std::vector<std::unique_ptr<clarus::test::Program>> programs;
    for (int i = 0; i < 3; ++i) programs.push_back(std::make_unique<clarus::test::Program>(CLARUS_TOOL, command));
    for (const auto& program : programs) CHECK_MESSAGE(program->result() == 0, program->errors());
    for (const std::string& name : place.outputs()) CHECK(fs::path(name).extension() == ".png");

    size_t pictures = 3;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT, SIGUSR1, SIGUSR2, SIGALRM, SIGXCPU}) {
        CAPTURE(signal);
        fs::remove_all(place.output());
        clarus::test::Program program(CLARUS_TOOL, command);
        for (int i = 0; i < 6000 && place.outputs().size() < pictures; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        ++pictures;
        program.interrupt(signal);
        program.ended();
        for (const std::string& name : without_state(place.outputs())) CHECK(fs::path(name).extension() == ".png");
    }
}

TEST_CASE("sizes are compared before pixels are read") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    // A PNG of 16384x16384 pixels, of which only the header is there.
    std::string bytes = io::read_file(place.output() / "0003.png");
    for (const size_t side : {16, 20}) bytes.replace(side, 4, std::string("\0\0\x40\0", 4));
    uint32_t check = ~0u;
    for (size_t i = 12; i < 29; ++i) {
        check ^= static_cast<unsigned char>(bytes[i]);
        for (int bit = 0; bit < 8; ++bit) check = check & 1 ? check >> 1 ^ 0xedb88320u : check >> 1;
    }
    for (size_t i = 0; i < 4; ++i) bytes[29 + i] = static_cast<char>(~check >> (24 - 8 * i));
    fs::path claims;
    SUBCASE("a result") { claims = place.output() / "0003.png"; }
    SUBCASE("a reference") { claims = place.sequence() / "reference/0003.png"; }
    place.write(claims, bytes);
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"compare", place.output().string(), place.sequence().string()},
          {"report", place.output().string(), "--sequence", place.sequence().string(), "-o",
           (place / "page.html").string()}}) {
#ifdef __SANITIZE_ADDRESS__  // whose own addresses are more than that
        const Outcome outcome = run_tool_after("", command);
#else
        const Outcome outcome = run_tool_after("ulimit -v 4000000;", command);
#endif
        CHECK(outcome.exit_code == 1);
        CHECK_MESSAGE(contains(outcome.err, "0003.png"), outcome.err);
        CHECK_MESSAGE(contains(outcome.err, "16384x16384"), outcome.err);
    }
}

TEST_CASE("colours that are not numbers are told") {
    const Workplace place(ColorSpace::linear);
    io::Pixels color = io::read_image(place.sequence() / "color/0001.exr");
    std::fill(color.values.begin(), color.values.end(), std::numeric_limits<float>::quiet_NaN());
    io::write_image(place.sequence() / "color/0001.exr", color, io::SampleType::f32);
    const Outcome outcome = place.upscale("bicubic", {"--format", "exr"});
    CHECK(outcome.exit_code == 0);
    CHECK_MESSAGE(contains(outcome.err, fmt::format("{} pixels in 1 of 4 frames", color.values.size() / 3)),
                  outcome.err);

    io::Pixels result = io::read_image(place.output() / "0002.exr");
    result.values[7] = std::numeric_limits<float>::quiet_NaN();
    io::write_image(place.output() / "0002.exr", result, io::SampleType::f32);
    const Outcome compared = run_tool({"compare", place.output().string(), place.sequence().string()});
    CHECK(compared.exit_code == 0);
    CHECK_MESSAGE(contains(compared.err, "1 of the 4 images"), compared.err);
}

TEST_CASE("what a sequence hardly means is told, once") {
    const Workplace place;
    const json description = place.description();
    const auto told = [&](const json& changed, const std::string& model, const std::string& what) {
        place.describe(changed);
        const Outcome outcome = place.upscale(model);
        CHECK(outcome.exit_code == 0);
        CHECK_MESSAGE(contains(outcome.err, what), outcome.err);
        CHECK_MESSAGE(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1, outcome.err);
    };
    CHECK(place.upscale("bicubic").err == "");
    json uv = description;
    for (json& frame : uv["frames"]) frame["jitter"] = {0.4 / render_size.width, -0.4 / render_size.height};
    told(uv, "bicubic", "jitter is in render pixels");
    json jittered = description;
    for (json& frame : jittered["frames"]) frame["jitter"] = {0.25, -0.25};
    told(jittered, CLARUS_GOLDEN_DIR "/srpo_x2.model.safetensors", "does not take jitter out");
    const std::string mnss = CLARUS_GOLDEN_DIR "/mnss_x2.model.safetensors";
    place.upscale(mnss);  // now compilers have said what they have to say
    told(jittered, mnss, "MNSS's own pattern of jitter");
    json pattern = description;
    const std::array places{7, 8, 0, 1};  // anew after a cut
    pattern["frames"][2]["reset"] = true;
    for (size_t i = 0; i < frame_count; ++i) {
        const Vec2 jitter = mnss_jitter(places[i], 2);
        pattern["frames"][i]["jitter"] = {jitter.x, jitter.y};
    }
    for (const double bias : {-1.0, -1.4}) {
        pattern["mip_bias"] = bias;
        place.describe(pattern);
        CHECK(place.upscale(mnss).err == "");
    }
    pattern["mip_bias"] = 0;
    told(pattern, mnss, "a mip bias of 0, and mnss_x2.model wants -1 here: they come out blurred");
    pattern["mip_bias"] = -2;
    told(pattern, mnss, "they come out aliased");
    place.describe(pattern);
    CHECK(place.upscale("bicubic").err == "");  // takes any
    place.describe(description);
    for (const json& frame : description["frames"])
        io::write_image(place.sequence() / frame["depth"].get<std::string>(), noise(render_size, 1, 5, 50, 1),
                        io::SampleType::f32);
    const Outcome metres = place.upscale(network);
    CHECK_MESSAGE(contains(metres.err, "in 4 of 4 frames most of the depth is above 1"), metres.err);
}

TEST_CASE("upscale and compare have the same figures of the same files") {
    const Workplace place;
    const fs::path report = place / "report.json";
    for (const auto& options : {std::vector<std::string>{}, {"--bits", "16"}, {"--format", "exr", "--bits", "16"}}) {
        fs::remove_all(place.output());
        std::vector<std::string> all{"--report", report.string()};
        all.insert(all.end(), options.begin(), options.end());
        REQUIRE(place.upscale("bicubic", all).exit_code == 0);
        const json by_upscale = json::parse(io::read_file(report))["quality"];
        const json by_compare =
            json::parse(run_tool({"compare", place.output().string(), place.sequence().string(), "--json"}).out);
        for (const char* figure : {"psnr", "pooled_psnr", "ssim"})
            CHECK(by_upscale[figure].get<double>() == doctest::Approx(by_compare[figure].get<double>()).epsilon(1e-6));
    }
}

TEST_CASE("compare prints the metrics of the files") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    std::vector<metrics::FrameQuality> expected;
    for (const std::string& name : all_png)
        expected.push_back(quality(place.output() / name, place.sequence() / "reference" / name));
    const metrics::SequenceQuality overall = metrics::summarise(expected);

    for (const fs::path& reference : {place.sequence(), place.sequence() / "reference"}) {
        const Outcome text = run_tool({"compare", place.output().string(), reference.string()});
        CHECK(text.exit_code == 0);
        CHECK_MESSAGE(contains(text.out, fmt::format("PSNR {:.2f} dB (pooled {:.2f} dB), SSIM {:.4f}", overall.psnr,
                                                     overall.pooled_psnr, *overall.ssim)),
                      text.out);

        const Outcome full = run_tool({"compare", place.output().string(), reference.string(), "--json"});
        REQUIRE(full.exit_code == 0);
        const json figures = json::parse(full.out);
        CHECK(figures["psnr"].get<double>() == doctest::Approx(overall.psnr).epsilon(1e-9));
        CHECK(figures["pooled_psnr"].get<double>() == doctest::Approx(overall.pooled_psnr).epsilon(1e-9));
        REQUIRE(figures["frames"].size() == frame_count);
        CHECK(figures["frames"][2]["ssim"].get<double>() == doctest::Approx(*expected[2].ssim).epsilon(1e-9));
    }
}

TEST_CASE("a table shows each column's best in bold where it is told to") {
    cli::NamedQuality sharp{"sharp", {}}, steady{"steady", {}};
    sharp.quality.psnr = sharp.quality.pooled_psnr = 30;
    steady.quality.psnr = steady.quality.pooled_psnr = 20;
    sharp.quality.pixel_std = 2;
    steady.quality.pixel_std = 1;
    const std::array results{sharp, steady};
    const std::string plain = cli::quality_table(results, false), bold = cli::quality_table(results, true);
    CHECK(plain.find('\033') == std::string::npos);
    const std::string first = bold.substr(bold.find("\nsharp")), second = bold.substr(bold.find("\nsteady"));
    CHECK(first.find("30.00\033[0m") < first.find("\nsteady"));
    CHECK(second.find("20.00\033[0m") == std::string::npos);
    CHECK(second.find("1.00\033[0m") != std::string::npos);
}

TEST_CASE("compare prints one table of several results") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const std::string sequence = place.sequence().string(), one = place.output().string();
    const std::string other = (place / "with, comma").string(), best = (place.sequence() / "reference").string();
    fs::copy(one, other);
    fs::copy_file(fs::path(best) / "0001.png", fs::path(other) / "0001.png", fs::copy_options::overwrite_existing);

    std::vector<json> singly;
    for (const std::string& folder : {one, other, best})
        singly.push_back(json::parse(run_tool({"compare", folder, sequence, "--json"}).out));
    const Outcome all = run_tool({"compare", one, other, best, sequence, "--json"});
    CHECK_MESSAGE(json::parse(all.out) == json(singly), all.out);
    CHECK(singly[1]["result"] == other);
    CHECK(singly[1]["psnr"] > singly[0]["psnr"]);

    const Outcome table = run_tool({"compare", one, other, best, sequence});
    REQUIRE(table.exit_code == 0);
    std::vector<std::string> lines;
    for (std::istringstream text(table.out); std::getline(text, lines.emplace_back());) {
    }
    REQUIRE(lines.size() > 6);
    CHECK(lines[4].empty());
    CHECK(contains(lines[5], "PSNR (dB) in places"));
    for (const char* line : {"No figures in masks: the sequence has no reference_depth",
                             "Blocks worse than a baseline's are not counted: none of the"})
        CHECK_MESSAGE(contains(table.out, line), table.out);
    CHECK_FALSE(contains(table.out, "disoccl"));
    for (size_t i = 0; i < 3; ++i) {
        const json& row = singly[i];
        CHECK(lines[i + 1].starts_with(row["result"].get<std::string>()));
        CHECK(lines[i + 1].ends_with(fmt::format("  {:9.2f}  {:16.2f}  {:.4f}", row["psnr"].get<double>(),
                                                 row["pooled_psnr"].get<double>(), row["ssim"].get<double>())));
        CHECK(lines[i + 1].size() == lines[0].size());
    }
    CHECK_FALSE(contains(table.out, "\033"));  // no terminal
    CHECK_FALSE(contains(table.out, "IF-SSIM"));
    CHECK_FALSE(contains(table.out, "pixel std"));

    const Outcome csv = run_tool({"compare", other, sequence, "--csv"});
    const json& row = singly[1];
    CHECK(csv.out.starts_with("result,psnr,pooled_psnr,ssim,if_ssim,pixel_std,flip,"));
    CHECK(contains(csv.out, ",disoccluded_1_psnr,disoccluded_4_psnr,"));
    const std::string line = csv.out.substr(csv.out.find("\r\n") + 2);
    CHECK(line.starts_with(fmt::format("\"{}\",{},{},{},,,,", other, row["psnr"].get<double>(),
                                       row["pooled_psnr"].get<double>(), row["ssim"].get<double>())));
    CHECK(contains(line, fmt::format(",{},", row["worst_blocks_psnr"].get<double>())));
    const std::string header = csv.out.substr(0, csv.out.find("\r\n"));
    const auto commas = [](const std::string& text) { return std::ranges::count(text, ','); };
    CHECK(commas(line) == commas(header) + 1);  // one in the name
    CHECK(run_tool({"compare", one, sequence, "--csv", "--json"}).exit_code == 2);
    CHECK(run_tool({"compare", one}).exit_code == 2);
}

TEST_CASE("compare measures stability where the sequence has what that needs") {
    const Workplace place;
    // Three frames that show one thing, the last of them after a cut, and one that shows another, a render pixel away.
    json description = place.description();
    for (const char* folder : {"reference_depth", "reference_motion"})
        fs::create_directories(place.sequence() / folder);
    for (int i = 0; i < frame_count; ++i) {
        json& frame = description["frames"][i];
        const std::string file = fmt::format("{:04}.exr", i);
        frame["reset"] = i == 2;
        frame["reference_depth"] = "reference_depth/" + file;
        frame["reference_motion"] = "reference_motion/" + file;
        if (i < 3) frame["reference"] = "reference/0000.png";
        io::Pixels depth = noise(output_size, 1, 0.3f, 0.3f, 0), motion = noise(output_size, 2, 0, 0, 0);
        for (size_t k = 0; i == 3 && k < motion.values.size(); k += 2) motion.values[k] = -1.0f / render_size.width;
        io::write_image(place.sequence() / "reference_depth" / file, depth, io::SampleType::f32);
        io::write_image(place.sequence() / "reference_motion" / file, motion, io::SampleType::f32);
    }
    description["motion"]["unit"] = "uv";
    place.describe(description);
    REQUIRE(place.upscale("bicubic").exit_code == 0);

    std::vector<io::Pixels> results, references;
    for (int i = 0; i < frame_count; ++i) {
        const auto read = [](const fs::path& file) {
            return metrics::display_values(io::read_image(file), ColorSpace::srgb);
        };
        results.push_back(read(place.output() / fmt::format("{:04}.png", i)));
        references.push_back(read(place.sequence() / "reference" / (i < 3 ? "0000.png" : "0003.png")));
    }
    metrics::PixelStd spread;
    for (int i = 0; i < frame_count; ++i) spread.add(results[i], i == 1 || i == 2);

    const Outcome outcome = run_tool({"compare", place.output().string(), place.sequence().string(), "--json"});
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    const json figures = json::parse(outcome.out);
    CHECK(figures["pixel_std"].get<double>() == doctest::Approx(*spread.mean()).epsilon(1e-9));
    double sum = 0;
    for (int i = 0; i < frame_count; ++i) {
        const json& frame = figures["frames"][i];
        REQUIRE(frame.contains("if_ssim") == (i == 1 || i == 3));
        if (!frame.contains("if_ssim")) continue;
        io::GroundTruth truth{noise(output_size, 1, 0.3f, 0.3f, 0), noise(output_size, 2, 0, 0, 0)};
        for (size_t k = 0; i == 3 && k < truth.motion.values.size(); k += 2) truth.motion.values[k] = -2;
        const metrics::InterFrame inter_frame(references[i - 1], truth.depth, references[i], truth);
        const double expected = *inter_frame.ssim(results[i - 1], results[i]);
        CHECK(frame["if_ssim"].get<double>() == doctest::Approx(expected).epsilon(1e-9));
        sum += expected;
    }
    CHECK(figures["if_ssim"].get<double>() == doctest::Approx(sum / 2).epsilon(1e-9));
    CHECK(contains(run_tool({"compare", place.output().string(), place.sequence().string()}).out,
                   fmt::format(", IF-SSIM {:.4f}, pixel std {:.2f} over 4 frames", sum / 2, *spread.mean())));
}

TEST_CASE("compare measures in masks, and blocks against a baseline") {
    const Workplace place;
    const fs::path sequence = place / "rendered", bicubic = place / "bicubic", fsr2 = place / "fsr2";
    REQUIRE(run_tool({"render", "--scene", "demo", "--path", "1", "--first-frame", "5", "--size", "80x48", "--frames",
                      "4", "--reference-samples", "1", "--output-buffers", "-o", sequence.string()})
                .exit_code == 0);
    for (const fs::path& folder : {bicubic, fsr2})
        REQUIRE(run_tool({"upscale", sequence.string(), "--model", folder.filename().string(), "--device",
                          test_selector(), "--output", folder.string(), "--report", (folder / "report.json").string()})
                    .exit_code == 0);
    const auto compare = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "compare");
        arguments.push_back(sequence.string());
        return run_tool(arguments);
    };
    const auto compare_json = [&](std::vector<std::string> arguments) {
        arguments.push_back("--json");
        const Outcome outcome = compare(arguments);
        REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
        return json::parse(outcome.out);
    };

    const json figures = compare_json({fsr2.string(), bicubic.string()});
    const io::Sequence described = io::read_sequence(sequence);
    metrics::MaskMaker maker(2);
    std::vector<metrics::FrameQuality> expected, baseline;
    for (size_t i = 0; i < 4; ++i) {
        const auto read = [&](const fs::path& folder) {
            return metrics::display_values(io::read_image(folder / fmt::format("{:04}.png", i)), ColorSpace::srgb);
        };
        const metrics::Masks masks = maker.add(*io::read_ground_truth(described, i), i > 0);
        expected.push_back(metrics::measure(read(fsr2), read(sequence / "reference"), &masks));
        baseline.push_back(metrics::measure(read(bicubic), read(sequence / "reference"), &masks));
    }
    metrics::compare_blocks(expected, baseline);
    CHECK(figures[0] == json::parse([&] {
              nlohmann::ordered_json whole{{"result", fsr2.string()}};
              whole.update(cli::quality_json(metrics::summarise(expected)));
              whole["if_ssim"] = figures[0]["if_ssim"];
              for (const char* key : {"strred", "srred", "trred"}) whole[key] = figures[0][key];
              for (size_t i = 0; i < 4; ++i) {
                  nlohmann::ordered_json frame{{"name", fmt::format("{:04}", i)}};
                  frame.update(cli::quality_json(expected[i]));
                  frame["srred"] = figures[0]["frames"][i]["srred"];
                  for (const char* key : {"if_ssim", "trred"})
                      if (i > 0) frame[key] = figures[0]["frames"][i][key];
                  whole["frames"].push_back(frame);
              }
              return whole.dump();
          }()));
    CHECK(figures[0].contains("disoccluded_4_psnr"));
    CHECK(figures[0]["frames"][2]["moves"] == true);
    CHECK_FALSE(figures[1].contains("worse_blocks"));

    // By its name or its report, or told; in a table with its note.
    fs::rename(bicubic, place / "other");
    const std::string other = (place / "other").string();
    CHECK(compare_json({fsr2.string(), other})[0] == figures[0]);
    fs::remove(place / "other" / "report.json");
    CHECK_FALSE(compare_json({fsr2.string(), other})[0].contains("worse_blocks"));
    CHECK(compare_json({fsr2.string(), "--baseline", other}) == figures[0]);
    const Outcome text = compare({fsr2.string(), "--baseline", other});
    CHECK_MESSAGE(contains(text.out, "disoccl. 4"), text.out);
    CHECK(contains(text.out, "worse blocks (%)"));
    CHECK_FALSE(contains(text.out, "No "));
    CHECK(contains(compare({other, "--baseline", other}).out, "the only result is the baseline"));
    const Outcome missing = compare({fsr2.string(), "--baseline", (place / "none").string()});
    CHECK(missing.exit_code == 1);
    CHECK(contains(missing.err, (place / "none").string()));
}

TEST_CASE("compare measures linear radiance, exposed") {
    const Workplace place(ColorSpace::linear);
    json description = place.description();
    for (json& frame : description["frames"]) frame["exposure"] = 0.5;
    place.describe(description);
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const Outcome outcome = run_tool({"compare", place.output().string(), place.sequence().string(), "--json"});
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    const json figures = json::parse(outcome.out);
    metrics::RadianceQuality expected{0, 0, 0};
    for (int i = 0; i < frame_count; ++i) {
        const auto read = [&](const fs::path& folder) {
            return metrics::exposed_radiance(io::read_image(folder / fmt::format("{:04}.exr", i)), 0.5f);
        };
        const auto quality = metrics::measure_radiance(read(place.output()), read(place.sequence() / "reference"));
        CHECK(figures["frames"][i]["pq_psnr"].get<double>() == doctest::Approx(quality.pq_psnr));
        *expected.mean_ratio += *quality.mean_ratio / frame_count;
        expected.relative_error += quality.relative_error / frame_count;
        expected.pq_psnr += quality.pq_psnr / frame_count;
    }
    CHECK(figures["mean_ratio"].get<double>() == doctest::Approx(*expected.mean_ratio));
    CHECK(figures["relative_error"].get<double>() == doctest::Approx(expected.relative_error));
    CHECK(figures["pq_psnr"].get<double>() == doctest::Approx(expected.pq_psnr));
    CHECK(contains(run_tool({"compare", place.output().string(), place.sequence().string()}).out,
                   fmt::format("mean ratio {:.4f}, relative error", *expected.mean_ratio)));
}

TEST_CASE("compare takes FLIP from a python3 that has it") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const std::vector<std::string> command{"compare", place.output().string(), place.sequence().string(), "--flip",
                                           "--json"};
    // A stand-in of the package's interface, which gives the largest difference.
    place.write("flip_evaluator.py",
                "def evaluate(reference, test, dynamicRangeString, inputsRGB=True, applyMagma=True,\n"
                "             computeMeanError=True, parameters={}):\n"
                "    assert dynamicRangeString == 'LDR' and reference.flags.writeable\n"
                "    return None, abs(reference - test).max(), {}\n");
    fs::create_directories(place / "bin");
    place.write("bin/python3", "#!/bin/sh\necho \"No module named 'flip_evaluator'\"\n");
    fs::permissions(place / "bin/python3", fs::perms::owner_all);
    const Outcome missing = run_tool_after("PATH=" + (place / "bin").string(), command);
    CHECK(missing.exit_code == 1);
    CHECK_MESSAGE(contains(missing.err, "No module named 'flip_evaluator'"), missing.err);
    CHECK(contains(missing.err, "install flip-evaluator"));
    place.write("bin/python3", "#!/bin/sh\necho ready\n");
    CHECK(contains(run_tool_after("PATH=" + (place / "bin").string(), command).err, "ended without a figure"));

    const std::string debian = "PATH=/usr/bin:/bin ";
    if (std::system((debian + "python3 -c 'import numpy' 2>/dev/null").c_str()) != 0) {
        MESSAGE("no NumPy: not tried");
        return;
    }
    const Outcome outcome = run_tool_after(debian + "PYTHONPATH=" + (place / "").string(), command);
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    const json figures = json::parse(outcome.out);
    double sum = 0;
    for (int i = 0; i < frame_count; ++i) {
        const io::Pixels result = io::read_image(place.output() / fmt::format("{:04}.png", i));
        const io::Pixels reference = io::read_image(place.sequence() / "reference" / fmt::format("{:04}.png", i));
        float largest = 0;
        for (size_t k = 0; k < result.values.size(); ++k)
            largest = std::max(largest, std::abs(result.values[k] - reference.values[k]));
        CHECK(figures["frames"][i]["flip"].get<double>() == doctest::Approx(largest));
        sum += largest;
    }
    CHECK(figures["flip"].get<double>() == doctest::Approx(sum / frame_count));
}

TEST_CASE("compare takes LPIPS from a python3 that has it, and fetches no weights") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const std::vector<std::string> command{"compare", place.output().string(), place.sequence().string(), "--lpips",
                                           "--json"};
    const std::string debian = "PATH=/usr/bin:/bin ";
    if (std::system((debian + "python3 -c 'import numpy' 2>/dev/null").c_str()) != 0) {
        MESSAGE("no NumPy: not tried");
        return;
    }
    // Stand-ins of the packages' interfaces; the figure is the largest difference.
    fs::create_directories(place / "torch");
    place.write("torch/__init__.py",
                "import contextlib\n"
                "no_grad = contextlib.nullcontext\n"
                "class from_numpy:\n"
                "    def __init__(self, array): self.array = array\n"
                "    def permute(self, *order): return from_numpy(self.array.transpose(order))\n"
                "    def __getitem__(self, index): return from_numpy(self.array[index])\n");
    place.write("torch/hub.py",
                "import os\n"
                "def get_dir(): return os.environ['HUB']\n"
                "def download_url_to_file(url, *more): raise AssertionError('it is fetched')\n"
                "def load_state_dict_from_url(url):\n"
                "    file = os.path.join(get_dir(), 'checkpoints', os.path.basename(url))\n"
                "    if not os.path.exists(file): download_url_to_file(url, file)\n");
    const std::string environment =
        fmt::format("{}HUB={} PYTHONPATH={}", debian, (place / "hub").string(), (place / "").string());
    const Outcome missing = run_tool_after(environment, command);
    CHECK(missing.exit_code == 1);
    CHECK_MESSAGE(contains(missing.err, "No module named 'lpips'"), missing.err);
    place.write("lpips.py",
                "import torch.hub\n"
                "class LPIPS:\n"
                "    def __init__(self, net, verbose):\n"
                "        assert net == 'alex'\n"
                "        torch.hub.load_state_dict_from_url('https://example.org/alexnet.pth')\n"
                "        print('noise on stdout')\n"
                "    def __call__(self, image, reference, normalize):\n"
                "        assert normalize and image.array.shape == (1, 3, 32, 48)\n"
                "        return abs(image.array - reference.array).max()\n");
    const Outcome unfetched = run_tool_after(environment, command);
    CHECK(unfetched.exit_code == 1);
    CHECK(contains(unfetched.err, "https://example.org/alexnet.pth is not among the weights in "));
    CHECK_MESSAGE(contains(unfetched.err, "which are not fetched"), unfetched.err);
    fs::create_directories(place / "hub" / "checkpoints");
    place.write("hub/checkpoints/alexnet.pth", "");
    const Outcome outcome = run_tool_after(environment, command);
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    const io::Pixels result = io::read_image(place.output() / "0001.png");
    const io::Pixels reference = io::read_image(place.sequence() / "reference" / "0001.png");
    float largest = 0;
    for (size_t k = 0; k < result.values.size(); ++k)
        largest = std::max(largest, std::abs(result.values[k] - reference.values[k]));
    const json figures = json::parse(outcome.out);
    CHECK(figures["frames"][1]["lpips"].get<double>() == doctest::Approx(largest));
    CHECK(figures.contains("lpips"));
}

TEST_CASE("compare names what it cannot compare") {
    const Workplace place;
    const std::string sequence = place.sequence().string(), output = place.output().string();
    CHECK(contains(run_tool({"compare", output, sequence}).err, output));

    REQUIRE(place.upscale("bicubic", {"--frames", ":3"}).exit_code == 0);
    const Outcome missing = run_tool({"compare", output, sequence});
    CHECK(missing.exit_code == 1);
    CHECK(contains(missing.err, "frame 0003"));
    CHECK(run_tool({"compare", output, sequence, "--frames", ":3"}).exit_code == 0);

    io::write_image(place.output() / "0001.png", noise({20, 20}, 3, 0, 1, 0), io::SampleType::u8);
    const Outcome smaller = run_tool({"compare", output, sequence, "--frames", ":3"});
    CHECK(smaller.exit_code == 1);
    CHECK(contains(smaller.err, "0001.png"));
}

TEST_CASE("compare warns of results that it has no reference for") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const std::vector<std::string> command{"compare", place.output().string(),
                                           (place.sequence() / "reference").string()};
    CHECK(run_tool(command).err == "");
    for (const char* extra : {"0004.png", "0005.png"})
        fs::copy_file(place.output() / "0003.png", place.output() / extra);
    const Outcome outcome = run_tool(command);
    CHECK(outcome.exit_code == 0);
    CHECK(contains(outcome.out, "over 4 frames"));
    CHECK_MESSAGE(contains(outcome.err, "2 of the 6 images"), outcome.err);
    CHECK_MESSAGE(contains(outcome.err, "0004.png"), outcome.err);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    std::vector<std::string> part = command;
    part.insert(part.end(), {"--frames", ":2"});
    CHECK(run_tool(part).err == "");  // asked for
}

TEST_CASE("compare draws a sheet of labelled columns with enlarged crops") {
    const Workplace place;
    const std::string reference = (place.sequence() / "reference").string(), picture = (place / "sheet.png").string();
    const std::vector<std::string> command{"compare", reference + "/", place.sequence().string(), "--sheet", picture};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), command.begin(), command.end());
        return run_tool(more);
    };
    const Outcome outcome = with({"--sheet-frame", "0002", "--crop", "8,8,12,8"});
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    const io::Pixels sheet = io::read_image(picture);
    CHECK(sheet.size.width == 2 * output_size.width + 4);
    // The last row is the crop's: 12 pixels enlarged to 48.
    const io::Pixels image = io::read_image(fs::path(reference) / "0002.png");
    for (int channel = 0; channel < 3; ++channel) {
        CHECK(sheet.at(1, sheet.size.height - 1, channel) == doctest::Approx(image.at(8, 15, channel)).epsilon(0.01));
        CHECK(sheet.at(output_size.width + 4 + 47, sheet.size.height - 1, channel) ==
              doctest::Approx(image.at(19, 15, channel)).epsilon(0.01));
    }
    REQUIRE(with({"--sheet-columns", "1"}).exit_code == 0);
    CHECK(io::read_image(picture).size.width == output_size.width);
    const Outcome missing = with({"--sheet-frame", "0009"});
    CHECK(missing.exit_code == 1);
    CHECK_MESSAGE(contains(missing.err, "0009"), missing.err);
    CHECK(with({"--crop", "40,0,20,8"}).exit_code == 1);
    CHECK(with({"--crop", "2147483647,0,1,1"}).exit_code == 2);
    CHECK(with({"--crop", "0,0,1,24", "--column-width", "16384"}).exit_code == 1);
    CHECK(with({"--crop", "0,0,40,1", "--column-width", "16"}).exit_code == 0);
    CHECK(with({"--crop", "1,2,3"}).exit_code == 2);
    CHECK(run_tool({"compare", reference, place.sequence().string(), "--crop", "8,8,12,8"}).exit_code == 2);
}

TEST_CASE("models and model describe what there is") {
    const Outcome list = run_tool({"models"});
    CHECK(list.exit_code == 0);
    CHECK(contains(list.out, "bicubic"));
    const Outcome one = run_tool({"model", network});
    CHECK_FALSE(contains(one.out, "options"));
    CHECK(one.exit_code == 0);
    CHECK(contains(one.out, "pipeline enss, scale 2"));
    CHECK(contains(one.out, "last.bias"));
    const Outcome several = run_tool({"model", CLARUS_GOLDEN_DIR "/nsrr_x2_rgb.model.safetensors"});
    CHECK(contains(several.out, "a whole number from 0 to 2, 2 by default"));
    const Outcome none = run_tool({"model", "no-such-model"});
    CHECK(none.exit_code == 1);
    CHECK(contains(none.err, "no-such-model"));
}

TEST_CASE("what pipelines let choose is an option of upscale, and listed") {
    const std::string help = run_tool({"upscale", "--help"}).out, list = run_tool({"models"}).out;
    for (const char* flag : {"--sharpness", "--previous-frames"}) {
        CAPTURE(std::string(flag));
        CHECK(contains(help, flag));
        CHECK(contains(list, flag));
    }
    CHECK(contains(list, "For fsr1, fsr2: "));
    CHECK(contains(list, "from 0 to 1, 0.87 (fsr1), 0 (fsr2) by default"));
    CHECK(contains(list, "a whole number from 0 to 4, the model's by default"));
    const Workplace untouched;
    check_refused(untouched, untouched.upscale("fsr2", {"--previous-frames", "1"}),
                  "fsr2 has no option previous_frames; it has: sharpness");
}

TEST_CASE("models lists a damaged file with what is wrong, and goes on") {
    const TemporaryFolder folder;
    ModelFile::read(network).write(folder / "whole.safetensors");
    std::ofstream(folder / "damaged.safetensors") << "nothing of the kind";
    const Outcome list = run_tool_after("CLARUS_MODEL_PATH='" + folder.path().string() + "'", {"models"});
    CHECK_MESSAGE(list.exit_code == 0, list.err);
    const size_t damaged = list.out.find("\ndamaged "), whole = list.out.find("\nwhole ");
    REQUIRE(damaged != std::string::npos);
    CHECK(contains(list.out.substr(damaged, list.out.find('\n', damaged + 1) - damaged), "damaged.safetensors"));
    CHECK(whole != std::string::npos);
    CHECK(contains(list.out, "bicubic"));

    const Outcome told = run_tool_after("CLARUS_MODEL_PATH='" + folder.path().string() + "'", {"models", "--json"});
    CHECK(told.exit_code == 0);
    std::map<std::string, json> models;
    for (const json& model : json::parse(told.out)) models[model["name"]] = model;
    CHECK(contains(models["damaged"]["error"], "damaged.safetensors"));
    CHECK(models["whole"]["pipeline"] == "enss");
    CHECK(models["whole"]["largest_scale"] == 2);
    CHECK(models["whole"]["file"] == (folder / "whole.safetensors").string());
    CHECK(models["bicubic"]["largest_scale"].is_null());
    CHECK(models["bicubic"]["wants"] == "colour");
    CHECK(models["fsr2"]["wants"] == "colour, depth, motion, jitter");
    CHECK(models["fsr2"]["options"].size() > 0);
}

TEST_CASE("a tool without its modules does what needs none, and names what it lacks") {
    const Workplace place;
    fs::create_directories(place / "bin");
    fs::copy(CLARUS_TOOL, place / "bin" / "clarus");
    const std::string sequence = place.sequence().string();
    const auto run = [&](const std::vector<std::string>& arguments) {  // the copy in the tool's place
        return run_tool_after("run() { shift; '" + (place / "bin" / "clarus").string() + "' \"$@\"; }; run", arguments);
    };
    CHECK(contains(run({"models"}).out, "bicubic"));
    const Outcome render = run({"render", "--help"});
    CHECK(render.exit_code == 1);
    CHECK_MESSAGE(contains(render.err, "CLARUS_RENDERER"), render.err);
    const Outcome upscale = run(
        {"upscale", sequence, "--model", "bicubic", "--output", place.output().string(), "--device", test_selector()});
    check_refused(place, upscale, "clarus_images.so");
}

TEST_CASE("images alone are upscaled by models that need no more") {
    const Workplace place;
    REQUIRE(place.upscale("bicubic").exit_code == 0);
    const auto upscale_images = [&](const fs::path& images, const std::string& model) {
        return run_tool({"upscale", images.string(), "--model", model, "--output", (place / "alone").string(),
                         "--device", test_selector()});
    };
    const auto is_same = [&](const char* name) {
        return io::read_file(place / "alone" / name) == io::read_file(place.output() / name);
    };
    // The sequence has no jitter.
    const fs::path color = place.sequence() / "color";
    const Outcome folder = upscale_images(color, "bicubic");
    CHECK_MESSAGE(folder.exit_code == 0, folder.err);
    for (const std::string& name : all_png) CHECK(is_same(name.c_str()));
    fs::remove_all(place / "alone");
    const Outcome one = upscale_images(color / "0002.png", "bicubic");
    CHECK_MESSAGE(one.exit_code == 0, one.err);
    CHECK(is_same("0002.png"));
    CHECK_FALSE(fs::exists(place / "alone/0003.png"));
    fs::remove_all(place / "alone");
    const Outcome refused = upscale_images(color, network);
    CHECK(refused.exit_code == 1);
    CHECK_MESSAGE(contains(refused.err, "color: images alone lack depth, motion and jitter"), refused.err);
    CHECK_FALSE(fs::exists(place / "alone"));
}

TEST_CASE("wrong usage is told apart from failure") {
    CHECK(run_tool({}).exit_code == 2);
    CHECK(run_tool({"upscale"}).exit_code == 2);
    const Workplace place;
    CHECK(place.upscale("bicubic", {"--precision", "fp8"}).exit_code == 2);
    CHECK(place.upscale("bicubic", {"--frames", "3"}).exit_code == 2);
    CHECK(contains(run_tool({}).err, "upscale"));
    CHECK(run_tool({"upscale", "--help"}).exit_code == 0);
    CHECK(run_tool({"help", "upscale"}).out == run_tool({"upscale", "--help"}).out);
    for (const auto& [words, complaint] : {
             std::pair{std::vector<std::string>{"upscale", "s", "--modle", "fsr2"},
                       "clarus: error: clarus upscale does not take --modle fsr2; is it --model?"},
             {{"upscal", "s"}, "clarus: error: clarus does not take upscal s; is it upscale?"},
             {{"bench", "compar"}, "clarus: error: clarus bench does not take compar; is it compare?"},
             {{"upscale", "s", "-o", "o"}, "clarus: error: --model is required"},
         }) {
        const Outcome outcome = run_tool(words);
        CHECK(outcome.exit_code == 2);
        CHECK_MESSAGE(contains(outcome.err, complaint), outcome.err);
    }
    CHECK(contains(place.upscale("ENSS-SX2", {}).err, "no model is named \"ENSS-SX2\"; is it enss-s-x2? There are: "));
    CHECK(run_tool({"--version"}).out.starts_with("clarus 0."));
    CHECK(contains(run_tool({"--version"}).out, ", fmt "));
}

TEST_CASE("a sequence's faults are found before anything is written") {
    const Workplace place;
    const fs::path folder = place.sequence();
    const json good = place.description();
    json bad = good;

    SUBCASE("no such sequence") {
        fs::remove_all(folder);
        check_refused(place, place.upscale("bicubic"), "sequence");
    }
    SUBCASE("no JSON") {
        place.write("sequence/sequence.json", "{\"version\": 1,");
        check_refused(place, place.upscale("bicubic"), "sequence.json");
    }
    SUBCASE("a missing field") {
        bad.erase("render_size");
        place.describe(bad);
        check_refused(place, place.upscale("bicubic"), "render_size");
    }
    SUBCASE("a field that there is not") {
        bad["frames"][2]["jiter"] = {0, 0};
        place.describe(bad);
        check_refused(place, place.upscale("bicubic"), "\"jiter\"; is it jitter?");
    }
    SUBCASE("a field of another type") {
        bad["frames"][2]["jitter"] = "none";
        place.describe(bad);
        check_refused(place, place.upscale("bicubic"), "frames[2].jitter");
    }
    SUBCASE("a file outside the folder") {
        bad["frames"][1]["color"] = "../elsewhere.png";
        place.describe(bad);
        check_refused(place, place.upscale("bicubic"), "../elsewhere.png");
    }
    SUBCASE("a missing image") {
        fs::remove(folder / "color/0003.png");
        check_refused(place, place.upscale("bicubic"), "color/0003.png");
    }
    SUBCASE("an image that is none") {
        place.write("sequence/depth/0002.exr", "not an image");
        check_refused(place, place.upscale(network), "depth/0002.exr");
    }
    SUBCASE("a network without motion") {
        bad["frames"][3].erase("motion");
        place.describe(bad);
        check_refused(place, place.upscale(network), "0003");
    }
    for (const char* kind : {"color", "depth", "motion", "reference"}) {
        SUBCASE(kind) {  // of another size
            const fs::path file = folder / good["frames"][2][kind].get<std::string>();
            const int channels = io::read_image_header(file).channels;
            io::write_image(file, noise({23, 16}, channels, 0, 1, 1),
                            file.extension() == ".exr" ? io::SampleType::f32 : io::SampleType::u8);
            check_refused(place, place.upscale(network), fs::path(kind) / file.filename());
        }
    }
}

TEST_CASE("a model's faults are found before anything is written") {
    const Workplace place;
    const std::string path = (place / "model.safetensors").string();
    ModelFile model = ModelFile::read(network);

    SUBCASE("no such file") { check_refused(place, place.upscale(path), path); }
    SUBCASE("no such name") { check_refused(place, place.upscale("enss-xxl"), "enss-xxl"); }
    SUBCASE("a missing tensor") {
        model.header["renamed"] = model.header["first.bias"];
        model.header.erase("first.bias");
        place.write("model.safetensors", model.bytes());
        check_refused(place, place.upscale(path), "first.bias");
    }
    SUBCASE("a wrong shape") {
        std::vector<int64_t> shape = model.header["last.weight"]["shape"];
        std::swap(shape[1], shape[2]);
        model.header["last.weight"]["shape"] = shape;
        place.write("model.safetensors", model.bytes());
        check_refused(place, place.upscale(path), "last.weight");
    }
    SUBCASE("a missing key") {
        model.header["__metadata__"].erase("scale");
        place.write("model.safetensors", model.bytes());
        check_refused(place, place.upscale(path), "scale");
    }
    SUBCASE("a weight that is not finite") {
        const size_t first = model.header["last.weight"]["data_offsets"][0];
        const bool is_half = model.header["last.weight"]["dtype"] == "F16";
        REQUIRE(is_half);
        model.body[first] = '\0';
        model.body[first + 1] = '\x7e';  // NaN
        place.write("model.safetensors", model.bytes());
        check_refused(place, place.upscale(path), "last.weight");
    }
    SUBCASE("a truncated body") {
        const std::string bytes = model.bytes();
        place.write("model.safetensors", bytes.substr(0, bytes.size() - 100));
        check_refused(place, place.upscale(path), "model.safetensors");
    }
    SUBCASE("offsets out of range") {
        model.header["first.bias"]["data_offsets"] = {uint64_t{1} << 40, (uint64_t{1} << 40) + 64};
        place.write("model.safetensors", model.bytes());
        check_refused(place, place.upscale(path), "first.bias");
    }
    SUBCASE("a header of 2^63 bytes") {
        place.write("model.safetensors", std::string(7, '\0') + '\x80' + model.bytes().substr(8));
        check_refused(place, place.upscale(path), "model.safetensors");
    }
    SUBCASE("a scale that the sequence is not made for") { check_refused(place, place.upscale(network_x3), "by 3"); }
    SUBCASE("a scale that the model does not have") {
        check_refused(place, place.upscale(network, {"--scale", "3"}), "--scale 3");
    }
}

TEST_CASE("a report or a trace replaces nothing that the run reads or writes") {
    const Workplace place;
    const auto refused = [&](const fs::path& kept, const std::vector<std::string>& arguments,
                             const std::string& culprit, const std::string& model = "bicubic") {
        const std::string before = fs::exists(kept) ? io::read_file(kept) : "";
        check_refused(place, place.upscale(model, arguments), culprit);
        CHECK((fs::exists(kept) ? io::read_file(kept) : "") == before);
        CHECK_FALSE(fs::exists(place.output()));
    };
    for (const std::string option : {"--report", "--trace"}) {
        CAPTURE(option);
        for (const char* file : {"color/0000.png", "reference/0003.png", "color/new.json", "sequence.json", "new.json"})
            refused(place.sequence() / file, {option, (place.sequence() / file).string()}, file);
        const fs::path left_out = place.sequence() / "color/0000.png";
        refused(left_out, {option, left_out.string(), "--frames", "2:"}, "color/0000.png");
        const fs::path link = place / ("link" + option);
        fs::create_symlink(left_out, link);
        refused(left_out, {option, link.string()}, link.string() + " would replace an image");

        const fs::path model = place / "model.safetensors";
        ModelFile::read(network).write(model);
        refused(model, {option, (place / "sequence/../model.safetensors").string()}, "would replace the model", model);

        const fs::path picture = place.output() / "0001.png", view = place.output() / "views/alpha/0001.png";
        refused(picture, {option, picture.string()}, "would replace an image of --output");
        refused(view, {option, view.string(), "--view", "alpha"}, "would replace a picture of --view", network);

        fs::create_directories(place / "folder");
        refused(place / "none", {option, (place / "folder").string()}, "folder is a folder");
        refused(place / "none", {option, (place / "absent/").string()}, "absent/ is a folder");
        refused(place / "none", {option, place.output().string()}, "output is a folder");
        CHECK_FALSE(fs::exists(place / "absent"));
    }
    const std::string both = (place / "both.json").string();
    refused(both, {"--report", both, "--trace", (place / "folder/../both.json").string()}, "would replace --report");
    REQUIRE(
        place.upscale("bicubic", {"--report", both, "--trace", (place.output() / "trace.json").string()}).exit_code ==
        0);
    CHECK(json::parse(io::read_file(both)).contains("devices"));
    CHECK(json::parse(io::read_file(place.output() / "trace.json")).contains("traceEvents"));
}

TEST_CASE("an output folder that cannot be written is found before anything is computed") {
    const Workplace place;
    const std::string sequence = place.sequence().string();
    SUBCASE("a file stands in its way") {
        place.write("output", "in the way");
        const Outcome outcome = place.upscale("bicubic");
        CHECK(outcome.exit_code == 1);
        CHECK(contains(outcome.err, place.output().string()));
        CHECK(io::read_file(place.output()) == "in the way");
    }
    SUBCASE("it holds the sequence's own images") {
        const fs::path references = place.sequence() / "reference";
        const std::string before = io::read_file(references / "0000.png");
        const Outcome outcome = run_tool(
            {"upscale", sequence, "--model", "bicubic", "--output", references.string(), "--device", test_selector()});
        CHECK(outcome.exit_code == 1);
        CHECK_MESSAGE(contains(outcome.err, references.string()), outcome.err);
        CHECK(io::read_file(references / "0000.png") == before);
    }
    SUBCASE("it holds optional images of the sequence") {
        json description = place.description();
        description["frames"][1]["ui"] = "ui/0000.png";
        place.describe(description);
        fs::create_directories(place.sequence() / "ui");
        const fs::path picture = place.sequence() / "ui/0000.png";
        io::write_image(picture, noise(output_size, 4, 0, 1, 7), io::SampleType::u8);
        const std::string before = io::read_file(picture);
        const std::string folder = picture.parent_path().string();
        const Outcome outcome =
            run_tool({"upscale", sequence, "--model", "bicubic", "--output", folder, "--device", test_selector()});
        CHECK(outcome.exit_code == 1);
        CHECK_MESSAGE(contains(outcome.err, folder + " holds images of the sequence"), outcome.err);
        CHECK(io::read_file(picture) == before);
    }
    SUBCASE("it is the sequence's own") {
        const std::string folder = place.sequence().string();
        for (const std::string& output : {folder, folder + "/"}) {
            const Outcome outcome =
                run_tool({"upscale", sequence, "--model", "bicubic", "--output", output, "--device", test_selector()});
            CHECK(outcome.exit_code == 1);
            CHECK_MESSAGE(contains(outcome.err, output + " is the sequence's own folder"), outcome.err);
        }
    }
    SUBCASE("nothing can be made there") {  // for the superuser, too
        const Outcome outcome = run_tool(
            {"upscale", sequence, "--model", "bicubic", "--output", "/proc/clarus", "--device", test_selector()});
        CHECK(outcome.exit_code == 1);
        CHECK(contains(outcome.err, "/proc/clarus"));
    }
    SUBCASE("the report's folder cannot be made") {
        check_refused(place, place.upscale("bicubic", {"--report", "/proc/clarus/report.json"}), "/proc/clarus");
        CHECK_FALSE(fs::exists(place.output()));  // made before, and gone again
    }
    SUBCASE("a folder has a frame's name") {  // found only when the frame is written
        fs::create_directories(place.output() / "0002.png" / "in the way");
        const Outcome outcome = place.upscale("bicubic");
        CHECK(outcome.exit_code == 1);
        CHECK_MESSAGE(contains(outcome.err, "0002.png: Is a directory"), outcome.err);
        std::set<std::string> outputs = without_state(place.outputs());
        outputs.erase("0003.png");  // may have been under way
        CHECK(outputs == std::set<std::string>{"0000.png", "0001.png"});
    }
    SUBCASE("files may not grow") {  // stands for a disk that fills while a frame is written
        place.enlarge({900, 900});
        REQUIRE(place.upscale("bicubic").exit_code == 0);  // so that the kernels are there
        fs::remove_all(place.output());
        const Outcome outcome = run_tool_after(kSmallFiles, {"upscale", sequence, "--model", "bicubic", "--output",
                                                             place.output().string(), "--device", test_selector()});
        CHECK(outcome.exit_code == 1);
        CHECK_MESSAGE(contains(outcome.err, "0000.png"), outcome.err);
        CHECK(place.outputs().empty());
    }
}

TEST_CASE("a report, a trace or a description that the disk has no room for is not left half-written") {
    const Workplace place;
    SUBCASE("a report or a trace") {
        REQUIRE(place.upscale("bicubic").exit_code == 0);  // so that the kernels are there
        const json few = place.description();
        for (const auto& [option, frames] : {std::pair{"--report", 12000}, {"--trace", 5000}}) {
            json many = few;
            for (int i = frame_count; i < frames; ++i) many["frames"].push_back(few["frames"][i % frame_count]);
            place.describe(many);
            const Outcome outcome =
                run_tool_after(kSmallFiles, {"upscale", place.sequence().string(), "--model", "bicubic", "--output",
                                             place.output().string(), "--device", test_selector(), option,
                                             (place / "figures" / "file.json").string()});
            CHECK(outcome.exit_code == 1);
            CHECK_MESSAGE(contains(outcome.err, "file.json: File too large"), outcome.err);
            CHECK_FALSE(fs::exists(place / "figures"));
            CHECK(place.outputs().size() == static_cast<size_t>(frames));
            fs::remove_all(place.output());
        }
    }
    SUBCASE("a rendered sequence's description") {
        const std::string full = "ulimit -f 4; trap '' XFSZ;";  // files of 2 KiB at most: single images, as a rule
        const Outcome outcome = run_tool_after(full, {"render", "--size", "8x8", "--frames", "24", "--no-reference",
                                                      "--output", (place / "rendered").string()});
        CHECK(outcome.exit_code == 1);
        CHECK_MESSAGE(contains(outcome.err, "sequence.json: File too large"), outcome.err);
        CHECK_FALSE(fs::exists(place / "rendered" / "sequence.json"));
        for (const auto& entry : fs::recursive_directory_iterator(place / "rendered"))
            CHECK_MESSAGE(entry.path().extension() != ".partial", entry.path());
    }
}

TEST_CASE("prepare compiles what a later run at any size asks for") {
    const Workplace place;
    const CacheFolder cache(place / "cache");
    const Outcome prepared = run_tool({"prepare", "bicubic", "--device", test_selector()});
    CHECK_MESSAGE(prepared.exit_code == 0, prepared.err);
    CHECK_MESSAGE(contains(prepared.out, "bicubic fp32 on "), prepared.out);
    CHECK_MESSAGE(contains(prepared.out, ": compiled in "), prepared.out);
    const Outcome again = run_tool({"prepare", "bicubic", "--device", test_selector()});
    CHECK_MESSAGE(contains(again.out, ": was there"), again.out);
    const fs::path report = place / "report.json";
    CHECK(place.upscale("bicubic", {"--report", report.string()}).exit_code == 0);
    CHECK(json::parse(io::read_file(report))["programs_compiled"] <= 1);  // for the formats of the sequence

    std::ofstream(place / "file") << "a folder cannot be made under a file";
    {
        const CacheFolder none(place / "file" / "cache");
        const Outcome lost = run_tool({"prepare", "bicubic", "--device", test_selector()});
        CHECK(lost.exit_code == 1);
        CHECK_MESSAGE(contains(lost.err, "is not kept"), lost.err);
    }

    CHECK(run_tool({"prepare"}).exit_code == 2);
    CHECK(run_tool({"prepare", "bicubic", "--all"}).exit_code == 2);
    CHECK(run_tool({"prepare", "bicubic", "--precision", "fp64"}).exit_code == 2);
    const Outcome unknown = run_tool({"prepare", "bicubic", "no-such-model", "--device", test_selector()});
    CHECK(unknown.exit_code == 1);
    CHECK_MESSAGE(unknown.out.empty(), unknown.out);
    CHECK_MESSAGE(contains(unknown.err, "no-such-model"), unknown.err);
}

TEST_CASE("a folder without enough free space is refused, and folders made for nothing go") {
    const TemporaryFolder place;
    {
        cli::OutputFolders folders;
        CHECK_THROWS_WITH_AS(folders.require(place / "a" / "b", UINTMAX_MAX), doctest::Contains("no space left in"),
                             Error);
        folders.require(place / "c" / "d", 1);
        folders.require(place / "c" / "e/");
        std::ofstream(place / "c" / "e" / "file") << "kept";
        CHECK(fs::is_directory(place / "c" / "d"));
    }
    CHECK_FALSE(fs::exists(place / "a"));
    CHECK_FALSE(fs::exists(place / "c" / "d"));
    CHECK(fs::exists(place / "c" / "e" / "file"));
    cli::OutputFolders().require(place / "c" / "e");
    CHECK(fs::exists(place / "c" / "e"));
}

TEST_CASE("no device of that name") {
    const Workplace place;
    check_refused(place,
                  run_tool({"upscale", place.sequence().string(), "--model", "bicubic", "--output",
                            place.output().string(), "--device", "no-such-device"}),
                  "no-such-device");
    for (const char* selector : {"", "/1"})
        check_refused(place,
                      run_tool({"upscale", place.sequence().string(), "--model", "bicubic", "--output",
                                place.output().string(), "--device", selector}),
                      fmt::format("no device fits '{}'", selector));
}

TEST_CASE("quantize makes a model that computes in int8 and stays near") {
    const Workplace work;
    const std::string quantized = (work / "quantized.safetensors").string();
    const auto quantize = [&](const std::string& model, std::vector<std::string> more = {}) {
        std::vector<std::string> arguments{"quantize", model,      work.sequence().string(), "-o",
                                           quantized,  "--device", test_selector()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_tool(arguments);
    };
    const Outcome done = quantize(network, {"--percentile", "100"});
    INFO(done.err);
    REQUIRE(done.exit_code == 0);
    CHECK(contains(done.out, "enss_x2_table.model: 3 layers in int8"));
    CHECK(contains(done.out, "body.0"));
    const ModelFile file = ModelFile::read(quantized);
    for (const char* layer : {"first", "body.0", "last"}) {
        CHECK(file.header[layer + std::string(".weight")]["dtype"] == "I8");
        CHECK(file.header[layer + std::string(".bias")]["dtype"] == "I32");
    }
    CHECK(file.header["jitter"]["dtype"] == "F32");
    CHECK(file.header["__metadata__"]["quantization"] == "int8");

    REQUIRE(work.upscale(network, {"--format", "exr"}).exit_code == 0);
    const io::Pixels wanted = io::read_image(work.output() / "0003.exr");
    REQUIRE(work.upscale(quantized, {"--format", "exr"}).exit_code == 0);
    const io::Pixels made = io::read_image(work.output() / "0003.exr");
    CHECK(metrics::measure(made, wanted).psnr > 35);
    CHECK(metrics::measure(made, wanted).psnr < 90);

    // Layers that stay are as they were.
    REQUIRE(quantize(network, {"--percentile", "99.9", "--keep", "first,last"}).exit_code == 0);
    const ModelFile kept = ModelFile::read(quantized);
    CHECK(kept.header["first.weight"]["dtype"] == "F16");
    CHECK(kept.header["body.0.weight"]["dtype"] == "I8");
}

TEST_CASE("quantize refuses what cannot be, before any work, and leaves no file") {
    const Workplace work;
    const std::string output = (work / "new/quantized.safetensors").string();
    const auto refuse = [&](const std::string& message, const std::string& model, std::vector<std::string> more = {},
                            const std::string& to = {}) {
        std::vector<std::string> arguments{
            "quantize", model, work.sequence().string(), "-o", to.empty() ? output : to, "--device", test_selector()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_tool(arguments);
        CAPTURE(outcome.err);
        CHECK(outcome.exit_code != 0);
        CHECK(contains(outcome.err, message));
        CHECK_FALSE(fs::exists(output));
    };
    const std::string perceptron = CLARUS_GOLDEN_DIR "/enss_x2_mlp.model.safetensors";
    refuse("bicubic is a filter", "bicubic");
    refuse("is quantized already: its tensor", CLARUS_GOLDEN_DIR "/stack_int8_x2.model.safetensors");
    refuse("has no such layer, or it is named twice; there are: body.0, first, last", network, {"--keep", "middle"});
    refuse("nothing is left to quantize", network, {"--keep", "first,body.0,last"});
    refuse("is made by a perceptron for each jitter, and can only stay in floating point", perceptron);
    refuse("upscales by 3, but the sequence", network_x3);
    refuse("would replace the model", network, {}, network);
    refuse("would lie among the sequence's own files", network, {}, (work.sequence() / "model.safetensors").string());
    refuse("is a folder where a file", network, {}, work.sequence().string());
    refuse("--percentile", network, {"--percentile", "30"});
    work.write("sequence/color/0002.png", "no image");
    refuse("0002.png", network);
    CHECK_FALSE(fs::exists(work / "new"));
}
