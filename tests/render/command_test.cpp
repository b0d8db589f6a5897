#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "clarus/jitter.h"
#include "io/file.h"
#include "io/image.h"
#include "io/sequence.h"
#include "render_harness.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::render_test;
using doctest::Contains;

namespace {

/// A folder with a small model to render, and places beside it to render to.
class Studio {
  public:
    Studio() {
        std::ofstream(folder / "cards.obj") << "v 0 0 0\nv 3 0 0\nv 3 2 1\nv 0 2 1\nv -3 0 2\nv 0 0 -1\nv 0 3 -1\n"
                                               "f 1 2 3 4\nf 5 6 7\n";
    }
    void render(const std::string& place, std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments = {
            "--scene", (folder / "cards.obj").string(), "--size", "24x16",    "--frames",
            "2",       "--reference-samples",           "1",      "--output", (folder / place).string()};
        // The last one given counts.
        for (const std::string& option : more) {
            if (!option.starts_with("--")) continue;
            const auto first = std::ranges::find(arguments, option);
            if (first != arguments.end()) arguments.erase(first, first + 2);
        }
        arguments.insert(arguments.end(), more.begin(), more.end());
        run_render(arguments);
    }
    /// "whole", and of the same as "sequence" the first frame alone, which this returns.
    std::filesystem::path render_in_part() const {
        render("whole");
        const auto place = folder / "sequence", obstacle = place / "depth" / "0001.exr";
        std::filesystem::create_directories(obstacle / "in the way");
        CHECK_THROWS_AS(render("sequence"), Error);
        std::filesystem::remove_all(obstacle);
        return place;
    }
    io::Sequence read(const std::string& place) const { return io::read_sequence(folder / place); }

    TemporaryFolder folder;
};

}  // namespace

TEST_CASE("clarus render writes a sequence that the readers take, the same each time") {
    const Studio studio;
    studio.render("a");
    studio.render("b");
    const io::Sequence sequence = studio.read("a");
    CHECK(sequence.render_size == Size{24, 16});
    CHECK(sequence.scale == 2);
    CHECK(sequence.motion.sampled_at_jitter);
    CHECK(!sequence.motion.jittered);
    CHECK(!sequence.depth.projective);
    REQUIRE(sequence.frames.size() == 2);
    CHECK(sequence.frames[0].reset);
    CHECK(!sequence.frames[1].reset);
    CHECK(sequence.frames[1].jitter == halton_jitter(1, 16));
    CHECK(sequence.frames[1].camera);
    CHECK(io::read_image_header(sequence.frames[1].reference).size == Size{48, 32});
    io::check_sequence(sequence, true, true);
    for (const char* name :
         {"sequence.json", "color/0001.png", "depth/0001.exr", "motion/0001.exr", "reference/0001.png"}) {
        CAPTURE(name);
        CHECK(io::read_file(studio.folder / "a" / name) == io::read_file(studio.folder / "b" / name));
    }

    // A later start shows the same frames; an existing sequence is kept unless --force says otherwise.
    CHECK_THROWS_WITH_AS(studio.render("b", {"--first-frame", "1"}), Contains("--force"), Error);
    CHECK(studio.read("b").frames.size() == 2);
    studio.render("b", {"--first-frame", "1", "--force"});
    CHECK(io::read_file(studio.folder / "b/color/0000.png") == io::read_file(studio.folder / "a/color/0001.png"));
}

TEST_CASE("clarus render takes every Nth frame, with the motion between those taken") {
    const Studio studio;
    studio.render("all", {"--frames", "5"});
    studio.render("some", {"--frames", "3", "--frame-step", "2"});
    const io::Sequence sequence = studio.read("some");
    CHECK(sequence.frame_rate == 30);
    REQUIRE(sequence.frames.size() == 3);
    CHECK(sequence.frames[1].jitter == halton_jitter(1, 16));
    CHECK(io::read_file(studio.folder / "some/reference/0001.png") ==
          io::read_file(studio.folder / "all/reference/0002.png"));

    // A vector over two frames is about as long as both over one frame are together.
    const auto mean_length = [&](const char* file) {
        const io::Pixels motion = io::read_image(studio.folder / file);
        double sum = 0;
        for (int y = 0; y < motion.size.height; ++y)
            for (int x = 0; x < motion.size.width; ++x) sum += std::hypot(motion.at(x, y, 0), motion.at(x, y, 1));
        return sum / (motion.size.width * motion.size.height);
    };
    const double both = mean_length("all/motion/0003.exr") + mean_length("all/motion/0004.exr");
    CHECK(mean_length("some/motion/0002.exr") == doctest::Approx(both).epsilon(0.1));
    CHECK_THROWS_WITH_AS(studio.render("none", {"--frame-step", "0"}), Contains("--frame-step"), Error);
}

TEST_CASE("clarus render makes a sequence whose resolution goes down and up again") {
    const Studio studio;
    studio.render("sequence", {"--frames", "4", "--dynamic-resolution", "0.5"});
    const io::Sequence sequence = studio.read("sequence");
    const std::vector<Size> sizes{{24, 16}, {18, 12}, {12, 8}, {18, 12}};
    REQUIRE(sequence.frames.size() == sizes.size());
    for (size_t i = 0; i < sizes.size(); ++i) {
        const io::FrameFiles& frame = sequence.frames[i];
        CHECK(sequence.render_size_of(frame) == sizes[i]);
        for (const auto& file : {frame.color, frame.depth, frame.motion})
            CHECK(io::read_image_header(file).size == sizes[i]);
        CHECK(io::read_image_header(frame.reference).size == Size{48, 32});
    }
}

TEST_CASE("clarus render has the demo built in") {
    const Studio studio;
    studio.render("demo", {"--scene", "demo", "--frames", "1", "--no-reference"});
    CHECK(studio.read("demo").frames[0].reference.empty());
}

// Packets of rays that are mostly empty, among instances.
TEST_CASE("clarus render makes sequences of any size") {
    const TemporaryFolder folder;
    for (const char* size : {"1x1", "1x2", "2x1", "3x1", "1x8", "5x3"}) {
        CAPTURE(std::string(size));
        run_render({"--scene", "demo", "--size", size, "--frames", "2", "--output", (folder / size).string()});
        CHECK(io::read_image(folder / size / "color/0001.png").values.size() > 0);
    }
}

TEST_CASE("a render goes on over images that are damaged by making them anew, and names a record that is") {
    const Studio studio;
    const auto place = studio.render_in_part();

    const auto record = place / "sequence.unfinished.json";
    const std::string good = io::read_file(record);
    for (const std::string& bad : {std::string(), good.substr(0, good.size() / 2), std::string("{}")}) {
        std::ofstream(record) << bad;
        CHECK_THROWS_WITH_AS(studio.render("sequence"), Contains("--force"), Error);
    }
    std::ofstream(record) << good;
    for (const char* name : {"color/0000.png", "motion/0000.exr"})
        std::filesystem::resize_file(place / name, std::filesystem::file_size(place / name) / 2);
    studio.render("sequence");
    for (const char* name : {"color/0000.png", "motion/0000.exr", "color/0001.png", "sequence.json"}) {
        CAPTURE(name);
        CHECK(io::read_file(place / name) == io::read_file(studio.folder / "whole" / name));
    }
}

TEST_CASE("a render goes on over an image that was replaced by making it anew") {
    const Studio studio;
    const auto place = studio.render_in_part();
    const auto other = studio.folder / "whole/depth/0001.exr", own = studio.folder / "whole/depth/0000.exr";
    REQUIRE(io::read_file(other) != io::read_file(own));
    std::filesystem::copy_file(other, place / "depth/0000.exr", std::filesystem::copy_options::overwrite_existing);
    studio.render("sequence");
    CHECK(io::read_file(place / "depth/0000.exr") == io::read_file(own));
}

TEST_CASE("a render that fails keeps what it has, and continues with the same options only") {
    const Studio studio;
    studio.render("whole");
    const auto place = studio.folder / "sequence", obstacle = place / "depth" / "0001.exr";
    std::filesystem::create_directories(obstacle / "in the way");
    CHECK_THROWS_WITH_AS(studio.render("sequence"), Contains("0001.exr"), Error);
    CHECK(!std::filesystem::exists(place / "sequence.json"));
    std::filesystem::remove_all(obstacle);
    CHECK_THROWS_WITH_AS(studio.render("sequence", {"--samples", "4"}), Contains("samples is 1"), Error);
    const auto written = std::filesystem::last_write_time(place / "color/0000.png");
    studio.render("sequence");
    CHECK(std::filesystem::last_write_time(place / "color/0000.png") == written);
    for (const char* name : {"sequence.json", "color/0001.png", "depth/0001.exr"}) {
        CAPTURE(name);
        CHECK(io::read_file(place / name) == io::read_file(studio.folder / "whole" / name));
    }
}

TEST_CASE("clarus render: radiance, scales, jitters, encodings") {
    const Studio studio;
    studio.render("a", {"--hdr", "--scale", "1.5", "--motion-at", "centre", "--jitter", "none"});
    io::Sequence sequence = studio.read("a");
    CHECK(sequence.color_space == ColorSpace::linear);
    CHECK(!sequence.motion.sampled_at_jitter);
    CHECK(sequence.frames[1].jitter == Vec2{});
    CHECK(io::read_image_header(sequence.frames[1].reference).size == Size{36, 24});

    studio.render("b", {"--scale", "3", "--jitter", "mnss", "--samples", "4", "--depth", "projective", "--reversed",
                        "--far", "90", "--motion-jittered", "--output-buffers", "--threads", "1"});
    sequence = studio.read("b");
    io::check_sequence(sequence, true, true);
    CHECK(sequence.frames[1].jitter == mnss_jitter(1, 3));
    CHECK(sequence.depth.projective);
    CHECK(sequence.depth.reversed);
    CHECK(sequence.frames[1].far_plane == 90);
    CHECK(sequence.motion.jittered);
    CHECK(io::read_image_header(sequence.frames[1].optional.at("reference_aliased")).size == Size{72, 48});

    studio.render("c", {"--scale", "1.7", "--jitter", "halton:5", "--first-frame", "3"});
    sequence = studio.read("c");
    CHECK(sequence.frames[1].jitter == halton_jitter(4, 5));
    CHECK(io::read_image_header(sequence.frames[1].reference).size == Size{41, 27});

    studio.render("d", {"--jitter", "halton:1024+500", "--first-frame", "3"});
    sequence = studio.read("d");
    CHECK(sequence.frames[0].jitter == halton_jitter(503, 1024));
    CHECK(sequence.frames[1].jitter == halton_jitter(504, 1024));

    studio.render("e", {"--scale", "3", "--jitter", "random", "--first-frame", "7"});
    CHECK(studio.read("e").frames[1].jitter == random_jitter(8, 3));
}

TEST_CASE("clarus render: other layouts") {
    const Studio studio;
    studio.render("S/360p/MipBiasMinus1.58Jittered/0000", {"--layout", "qrisp", "--scale", "3"});
    io::check_sequence(studio.read("S/360p/MipBiasMinus1.58Jittered/0000"), true, true);
    studio.render("0001.json", {"--layout", "nss", "--reversed"});
    const io::Sequence capture = studio.read("0001.json");
    io::check_sequence(capture, true, true);
    CHECK(capture.depth.reversed);
    const auto refused = [&](const char* place, const char* layout, std::vector<std::string> option,
                             const char* named) {
        option.insert(option.end(), {"--layout", layout});
        CHECK_THROWS_WITH_AS(studio.render(place, option), Contains(named), Error);
    };
    refused("0002.json", "nss", {"--depth", "linear"}, "--depth");
    refused("0002.json", "nss", {"--motion-jittered"}, "--motion-jittered");
    refused("0002.json", "nss", {"--motion-at", "centre"}, "--motion-at");
    refused("0002.json", "nss", {"--output-buffers"}, "--output-buffers");
    refused("0002", "nss", {}, "<dataset>/<sequence>.json");
    const char* segment = "S/540p/MipBiasMinus1Jittered/0000";
    refused(segment, "qrisp", {"--hdr"}, "--hdr");
    refused(segment, "qrisp", {"--reversed"}, "--reversed");
    refused(segment, "qrisp", {"--scale", "4"}, "the scale 2, not 4");
    refused("elsewhere", "qrisp", {}, "MipBias");
    CHECK(!std::filesystem::exists(studio.folder / "0002.json"));
    CHECK(!std::filesystem::exists(studio.folder / "S/540p"));
}

TEST_CASE("clarus render refuses bad input before it makes anything") {
    const Studio studio;
    const auto refused = [&](const char* option, const char* value, const char* named) {
        CAPTURE(option);
        CAPTURE(value);
        CHECK_THROWS_WITH_AS(studio.render("sequence", {option, value}), Contains(named), Error);
        CHECK(!std::filesystem::exists(studio.folder / "sequence"));
    };
    for (const char* size : {"24", "24x", "x16", "0x16", "24x-1", "24x16x3", "99999x2"})
        refused("--size", size, "--size");
    for (const char* scale : {"1", "2.5", "7", "-2"}) refused("--scale", scale, "--scale");
    for (const char* samples : {"0", "5", "-4"}) refused("--reference-samples", samples, "--reference-samples");
    for (const char* samples : {"0", "257"}) refused("--samples", samples, "--samples");
    for (const char* jitter : {"halton", "halton:0", "halton:4+", "halton:4+4", "halton:4+-1", "halton:+1", "halton:x"})
        refused("--jitter", jitter, "--jitter");
    refused("--depth", "logarithmic", "--depth");
    for (const char* far : {"0.5", "1e7", "nan"}) refused("--far", far, "--far");
    refused("--frames", "0", "--frames");
    for (const char* share : {"0", "0.05", "1.5", "nan"})
        refused("--dynamic-resolution", share, "--dynamic-resolution");
    CHECK_THROWS_WITH_AS(studio.render("sequence", {"--dynamic-resolution", "0.5", "--motion-jittered"}),
                         Contains("--motion-jittered"), Error);
    CHECK_THROWS_WITH_AS(studio.render("0002.json", {"--dynamic-resolution", "0.5", "--layout", "nss"}),
                         Contains("--dynamic-resolution"), Error);
    refused("--first-frame", "-1", "--first-frame");
    refused("--path", "-1", "--path");
    refused("--threads", "-1", "--threads");
    refused("--motion-at", "corner", "--motion-at");
    refused("--scene", "office", "office");
    CHECK_THROWS_WITH_AS(studio.render("sequence", {"--scale", "4", "--jitter", "mnss"}), Contains("--jitter"), Error);
    CHECK_THROWS_WITH_AS(studio.render("sequence", {"--scale", "1.5", "--jitter", "random"}), Contains("--jitter"),
                         Error);
    // A file stands where the folder should be.
    const auto place = studio.folder / "sequence";
    std::ofstream(place) << "a file";
    CHECK_THROWS_WITH_AS(studio.render("sequence"), Contains(place.c_str()), Error);
    CHECK(std::filesystem::is_regular_file(place));
}
