#include <chrono>
#include <set>
#include <string>
#include <vector>

#include "io/frames.h"
#include "io/video_reader.h"
#include "metrics/psnr.h"
#include "noise_sequence.h"
#include "program.h"
#include "run_clarus.h"
#include "test_device.h"
#include "video_file.h"

// `clarus upscale -o FILE.mp4` as a process; what a video is in itself is in io/video_test.cpp.

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;

namespace {

class Workplace {
  public:
    explicit Workplace(Size size = {24, 16}, int frames = 5, ColorSpace color_space = ColorSpace::srgb) {
        write_noise_sequence(sequence(), size, frames, color_space);
    }
    fs::path sequence() const { return folder_ / "sequence"; }
    fs::path operator/(const fs::path& name) const { return folder_ / name; }

    std::vector<std::string> arguments(const std::string& output, const std::vector<std::string>& more) const {
        std::vector<std::string> all{"upscale",  sequence(),      "--model",  "bicubic",
                                     "--device", test_selector(), "--output", folder_ / output};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    Outcome upscale(const std::string& output, const std::vector<std::string>& more = {}) const {
        return run_clarus(arguments(output, more));
    }
    bool has_only(const std::set<std::string>& names) const {
        std::set<std::string> there;
        for (const auto& entry : fs::directory_iterator(folder_.path())) there.insert(entry.path().filename());
        there.erase("sequence");
        return there == names;
    }

  private:
    TemporaryFolder folder_;
};

void check_refused(const Workplace& place, const Outcome& outcome, const std::string& words) {
    CHECK(outcome.code == 1);
    CHECK_MESSAGE(outcome.errors.find(words) != std::string::npos, outcome.errors);
    CHECK(place.has_only({}));
}

}  // namespace

TEST_CASE("upscale writes a video of the pictures that it would write") {
    const Workplace place;
    REQUIRE(place.upscale("pictures").code == 0);
    const Outcome outcome = place.upscale("video.mp4", {"--crf", "1"});
    REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
    const VideoFile video = read_video(place / "video.mp4");
    REQUIRE(video.pictures.size() == 5);
    CHECK(video.size == Size{48, 32});
    for (int i = 0; i < 5; ++i) {
        CAPTURE(i);
        CHECK(video.seconds[i] == doctest::Approx(i / 60.0).epsilon(0.001));
        // Of noise in colours half is lost in 4:2:0, so that brightness alone is compared.
        const io::Pixels expected = io::read_image(place / fmt::format("pictures/{:04}.png", i));
        double error = 0;
        for (size_t k = 0; k < expected.values.size(); k += 3) {
            const float* rgb = &expected.values[k];
            const double luma = 16 + 219 * (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]);
            error += (luma - video.pictures[i].values[k]) * (luma - video.pictures[i].values[k]);
        }
        CHECK(metrics::psnr(error / (48 * 32) / (255 * 255)) > 42);
    }
}

TEST_CASE("a video has the pictures in between, in the order of time") {
    const Workplace place;
    REQUIRE(place.upscale("video.mkv", {"--frame-rate", "x2"}).code == 0);
    const VideoFile video = read_video(place / "video.mkv");
    REQUIRE(video.pictures.size() == 9);
    for (int i = 0; i < 9; ++i) CHECK(video.seconds[i] == doctest::Approx(i / 120.0).epsilon(0.05));
}

TEST_CASE("a video of 10 bits says so") {
    const Workplace place({24, 16}, 2);
    for (const char* name : {"video.mp4", "video.mkv", "video.webm"}) {
        const Outcome outcome = place.upscale(name, {"--bits", "10"});
        REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
        CHECK(io::open_video(place / name)->facts().bits == 10);
    }
    REQUIRE(place.upscale("usual.mp4").code == 0);
    CHECK(io::open_video(place / "usual.mp4")->facts().bits == 8);
}

TEST_CASE("a video of linear HDR is tone-mapped") {
    const Workplace place({24, 16}, 2, ColorSpace::linear);
    const Outcome outcome = place.upscale("video.mp4");
    REQUIRE_MESSAGE(outcome.code == 0, outcome.errors);
    CHECK(read_video(place / "video.mp4").pictures.size() == 2);
}

TEST_CASE("what does not go with a video is refused before anything is written") {
    const Workplace place;
    check_refused(place, place.upscale("video.mp4", {"--view", "x"}), "--view is of pictures");
    check_refused(place, place.upscale("video.mp4", {"--format", "exr"}), "--format is of pictures");
    check_refused(place, place.upscale("video.mp4", {"--bits", "16"}), "a video holds 8 or 10 bits, not --bits 16");
    check_refused(place, place.upscale("pictures", {"--bits", "10"}), "--bits 10 is of videos");
    check_refused(place, place.upscale("video.mp4", {"--alpha", "keep"}), "a video has no alpha");
    check_refused(place, place.upscale("video.mp4", {"--crf", "52"}), "--crf 52 is not from 0 to 51");
    check_refused(place, place.upscale("pictures", {"--crf", "20"}), "--crf is of videos");
    check_refused(place, place.upscale("sequence/color/video.mp4"), "would lie among the sequence's own files");
    check_refused(place, place.upscale("video.mp4", {"--trace", place / "video.mp4"}), "would replace --output");
}

TEST_CASE("a disk that fills leaves no video") {
    const Workplace place({480, 270}, 6);  // of 5 MB, where a file has 2 MiB at most
    std::string command = "ulimit -f 4096; trap '' XFSZ; exec '" CLARUS_TOOL "'";
    for (const std::string& word : place.arguments("video.mp4", {"--crf", "0", "--tuning", "fixed"}))
        command += " '" + word + "'";
    Program program("/bin/sh", {"-c", command});
    CHECK(program.result() == 1);
    CHECK_MESSAGE(program.errors().find("cannot write " + (place / "video.mp4").string()) != std::string::npos,
                  program.errors());
    CHECK(place.has_only({}));
}

TEST_CASE("Ctrl-C leaves a whole video of the frames that are done, and so does a frame that cannot be read") {
    constexpr size_t frames = 400;
    const Workplace place({24, 16}, frames);
    Program program(CLARUS_TOOL, place.arguments("video.mp4", {}));
    const auto is_begun = [&] {
        return std::ranges::any_of(fs::directory_iterator(place / ""),
                                   [](const auto& entry) { return entry.path().extension() == ".partial"; });
    };
    for (int i = 0; i < 6000 && !is_begun(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    program.interrupt();
    CHECK(program.result() == 1);
    const size_t count = read_video(place / "video.mp4").pictures.size();
    CHECK(count > 0);
    CHECK(count < frames);
    CHECK_MESSAGE(
        program.errors().find(fmt::format("has the first {} of {} frames", count, frames)) != std::string::npos,
        program.errors());

    const fs::path damaged = place / "sequence/color/0035.png";
    fs::resize_file(damaged, fs::file_size(damaged) / 2);
    const Outcome outcome = place.upscale("damaged.mp4", {"--frames", ":40"});
    CHECK(outcome.code == 1);
    CHECK_MESSAGE(outcome.errors.find("0035.png") != std::string::npos, outcome.errors);
    CHECK(read_video(place / "damaged.mp4").pictures.size() == 35);
}
