#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "io/image.h"
#include "io/video.h"
#include "io/video_reader.h"
#include "noise_sequence.h"
#include "raw_video.h"
#include "run_clarus.h"
#include "test_device.h"
#include "video_file.h"

// `clarus upscale CLIP.mp4` as a process; what a video's pictures become is in io/read_video_test.cpp.

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;

namespace {

Outcome upscale(const fs::path& video, const fs::path& output, const std::vector<std::string>& more = {},
                const std::string& model = "bicubic") {
    std::vector<std::string> all{"upscale", video, "--model", model, "--device", test_selector(), "--output", output};
    all.insert(all.end(), more.begin(), more.end());
    return run_clarus(all);
}

/// 24×16, at uneven times.
const std::vector<double> seconds{0, 0.04, 0.08, 0.2, 0.24, 0.36};

void write_clip(const fs::path& path) {
    const auto writer = io::write_video(path, {.size = {24, 16}, .frame_rate = 25, .crf = 0});
    for (size_t i = 0; i < seconds.size(); ++i) writer->write(noise({24, 16}, 3, 0.2f, 0.8f, 3 + i), seconds[i], {});
    writer->finish();
}

std::set<std::string> names_in(const fs::path& folder) {
    std::set<std::string> names;
    if (fs::exists(folder))
        for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
}

void check_refused(const Outcome& outcome, const std::vector<std::string>& words) {
    CHECK(outcome.code == 1);
    for (const std::string& part : words) CHECK_MESSAGE(outcome.errors.find(part) != std::string::npos, outcome.errors);
}

}  // namespace

TEST_CASE("upscale makes of a video what it makes of its pictures") {
    const TemporaryFolder folder;
    write_clip(folder / "clip.mp4");
    const auto video = io::open_video(folder / "clip.mp4");
    fs::create_directory(folder / "pictures");
    for (int i = 0; auto picture = video->next(); ++i)
        io::write_image(folder / fmt::format("pictures/{:04}.png", i), picture->pixels, io::SampleType::u16);

    const Outcome outcome = upscale(folder / "clip.mp4", folder / "upscaled");
    REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
    CHECK(outcome.out.find("sound") == std::string::npos);
    CHECK(names_in(folder / "upscaled") ==
          std::set<std::string>{"0000.png", "0001.png", "0002.png", "0003.png", "0004.png", "0005.png"});
    REQUIRE(upscale(folder / "pictures", folder / "expected", {"--bits", "8"}).code == 0);
    for (int i = 0; i < 6; ++i) {
        const io::Pixels made = io::read_image(folder / fmt::format("upscaled/{:04}.png", i));
        const io::Pixels expected = io::read_image(folder / fmt::format("expected/{:04}.png", i));
        CHECK(made.size == Size{48, 32});
        REQUIRE(made.values.size() == expected.values.size());
        float largest = 0;
        for (size_t k = 0; k < made.values.size(); ++k)
            largest = std::max(largest, std::abs(made.values[k] - expected.values[k]));
        CHECK(largest < 1.01f / 255);
    }

    // Part of it, by its own numbers.
    REQUIRE(upscale(folder / "clip.mp4", folder / "part", {"--frames", "2:4"}).code == 0);
    CHECK(names_in(folder / "part") == std::set<std::string>{"0002.png", "0003.png"});
    for (const char* name : {"0002.png", "0003.png"})
        CHECK(io::read_file(folder / "part" / name) == io::read_file(folder / "upscaled" / name));
    REQUIRE(upscale(folder / "clip.mp4", folder / "rest", {"--frames", "4:"}).code == 0);
    CHECK(names_in(folder / "rest") == std::set<std::string>{"0004.png", "0005.png"});
    check_refused(upscale(folder / "clip.mp4", folder / "none", {"--frames", "7:9"}), {"--frames 7:9", "6 frames"});
    check_refused(upscale(folder / "clip.mp4", folder / "most", {"--frames", "4:9"}), {"--frames 4:9", "6 frames"});
    CHECK(names_in(folder / "most") == std::set<std::string>{"0004.png", "0005.png"});
}

TEST_CASE("a video that becomes a video keeps its times") {
    const TemporaryFolder folder;
    write_clip(folder / "clip.mkv");
    for (const char* name : {"larger.mp4", "larger.mkv", "larger.webm"}) {
        CAPTURE(name);
        const Outcome outcome = upscale(folder / "clip.mkv", folder / name);
        REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
        const VideoFile made = read_video(folder / name);
        CHECK(made.size == Size{48, 32});
        REQUIRE(made.seconds.size() == seconds.size());
        for (size_t i = 0; i < seconds.size(); ++i)
            CHECK(made.seconds[i] == doctest::Approx(seconds[i]).epsilon(0.005));
    }
}

TEST_CASE("more than eight bits stay, and sound is said to be left out") {
    const TemporaryFolder folder;
    RawVideo raw{.format = AV_PIX_FMT_YUV444P10, .has_audio = true};
    raw.pictures.assign(2, {.values = {500, 512, 512}});
    raw.write(folder / "deep.mkv");
    const Outcome outcome = upscale(folder / "deep.mkv", folder / "deep");
    REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
    CHECK(outcome.out.find("its sound is not carried over") != std::string::npos);
    CHECK(io::read_image_header(folder / "deep/0001.png").type == io::SampleType::u16);
    const float expected = (500.0f - 64) / 876;
    CHECK(io::read_image(folder / "deep/0001.png").at(20, 20, 1) == doctest::Approx(expected).epsilon(0.001));
}

TEST_CASE("what a video cannot do is refused, and nothing is written") {
    const TemporaryFolder folder;
    const fs::path clip = folder / "clip.mp4", out = folder / "out";
    write_clip(clip);
    check_refused(upscale(clip, out, {}, "fsr2"), {clip, "images alone lack depth, motion and jitter"});
    check_refused(upscale(clip, out, {"--frame-rate", "x2"}), {clip, "images alone lack depth, motion and jitter"});
    check_refused(upscale(clip, out, {"--resume"}), {clip, "--resume", "--frames"});
    check_refused(upscale(clip, out, {"--save-every", "5"}), {clip, "--save-every"});
    check_refused(upscale(folder / "none.mp4", out), {folder / "none.mp4", "No such file"});
    const std::string bytes = io::read_file(clip);
    check_refused(upscale(clip, clip), {"--output", "would replace the sequence"});
    CHECK(io::read_file(clip) == bytes);
    check_refused(run_clarus({"compare", folder.path(), clip}),
                  {clip, "is a video, which `clarus upscale` alone reads"});
    CHECK(names_in(folder.path()) == std::set<std::string>{"clip.mp4"});
}

TEST_CASE("of a video that is cut short the frames before stay") {
    const TemporaryFolder folder;
    const auto writer = io::write_video(folder / "whole.mkv", {.size = {24, 16}, .frame_rate = 25, .crf = 0});
    for (int i = 0; i < 30; ++i) writer->write(noise({24, 16}, 3, 0, 1, 3 + i), i / 25.0, {});
    writer->finish();
    cut_short(folder / "whole.mkv", folder / "short.mkv", 0.5);
    const Outcome pictures = upscale(folder / "short.mkv", folder / "out");
    check_refused(pictures, {folder / "short.mkv"});
    const size_t count = names_in(folder / "out").size();
    CHECK(count > 5);
    CHECK(count < 30);
    CHECK(pictures.errors.find("frame " + std::to_string(count)) != std::string::npos);
    check_refused(upscale(folder / "short.mkv", folder / "out.mp4"), {folder / "short.mkv"});
    CHECK(read_video(folder / "out.mp4").pictures.size() == count);
}
