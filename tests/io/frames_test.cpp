#include "io/frames.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "clarus/error.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::io;
using doctest::Contains;

namespace {

constexpr Size render_size{8, 4}, output_size{16, 8};

Pixels constant(Size size, int channels, float value) {
    return {size, channels, std::vector<float>(static_cast<size_t>(size.width) * size.height * channels, value)};
}

/// Six frames on disk; frame i's colour is i/255.
class Recording {
  public:
    Recording() {
        sequence.folder = folder.path();
        sequence.render_size = render_size;
        for (const char* role : {"color", "depth", "motion", "reference"})
            std::filesystem::create_directory(folder / role);
        for (int i = 0; i < 6; ++i) {
            const std::string name = "000" + std::to_string(i);
            FrameFiles files;
            files.name = name;
            write_image(files.color = folder / "color" / (name + ".png"),
                        constant(render_size, 3, static_cast<float>(i) / 255), SampleType::u8);
            write_image(files.depth = folder / "depth" / (name + ".exr"), constant(render_size, 1, 0.5f),
                        SampleType::f32);
            write_image(files.motion = folder / "motion" / (name + ".exr"), constant(render_size, 2, -3),
                        SampleType::f32);
            write_image(files.reference = folder / "reference" / (name + ".png"), constant(output_size, 3, 1),
                        SampleType::u8);
            sequence.frames.push_back(files);
        }
    }
    TemporaryFolder folder;
    Sequence sequence;
};

doctest::String check_message(const Sequence& sequence, bool needs_motion = true) {
    try {
        check_sequence(sequence, needs_motion, needs_motion);
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        return error.what();
    }
    return "no error";
}

}  // namespace

TEST_CASE("a frame holds what was asked for") {
    const Recording recording;
    const FramePixels all = read_frame(recording.sequence, 3, true, true);
    CHECK(all.color.size == render_size);
    CHECK(all.color.at(7, 3, 2) == doctest::Approx(3.0 / 255));
    CHECK(all.depth.channels == 1);
    CHECK(all.depth.at(0, 0, 0) == 0.5f);
    CHECK(all.motion.channels == 2);
    CHECK(all.motion.at(1, 1, 1) == -3);
    CHECK(all.reference.size == output_size);
    CHECK(all.reference.channels == 3);
    const FramePixels color = read_frame(recording.sequence, 3, false, false);
    CHECK(color.color.values == all.color.values);
    CHECK(color.depth.values.empty());
    CHECK(color.motion.values.empty());
    CHECK(color.reference.values.empty());
}

TEST_CASE("a frame's alpha is apart from its colour") {
    Recording recording;
    CHECK_FALSE(check_sequence(recording.sequence, true, true).has_alpha);
    CHECK(read_frame(recording.sequence, 2, false, false).alpha.values.empty());
    Pixels color = constant(render_size, 4, 0.2f);
    color.at(3, 1, 3) = 0.6f;
    write_image(recording.sequence.frames[2].color, color, SampleType::u16);
    const ColorFiles colors = check_sequence(recording.sequence, true, true);
    CHECK(colors.has_alpha);
    CHECK(colors.type == SampleType::u8);  // of the first
    const FramePixels pixels = read_frame(recording.sequence, 2, false, false);
    CHECK(pixels.color.channels == 3);
    CHECK(pixels.color.values.size() == size_t{3} * render_size.width * render_size.height);
    CHECK(pixels.color.at(7, 3, 2) == doctest::Approx(0.2f));
    CHECK(pixels.alpha.channels == 1);
    CHECK(pixels.alpha.at(3, 1, 0) == doctest::Approx(0.6f));
    CHECK(pixels.alpha.at(4, 1, 0) == doctest::Approx(0.2f));
}

TEST_CASE("channels are those that the sequence names") {
    Recording recording;
    Pixels both = constant(render_size, 3, 0);
    both.at(5, 2, 0) = 0.25f, both.at(5, 2, 1) = 1.5f, both.at(5, 2, 2) = -2.5f;
    for (FrameFiles& frame : recording.sequence.frames) {
        write_image(recording.folder / "both.exr", both, SampleType::f32);
        frame.depth = frame.motion = recording.folder / "both.exr";
    }
    recording.sequence.depth_channels.names = {"R"};
    recording.sequence.motion_channels.names = {"B", "G"};
    recording.sequence.color_channels.names = {"B", "G", "R"};
    CHECK(check_message(recording.sequence) == "no error");
    const FramePixels pixels = read_frame(recording.sequence, 1, true, false);
    CHECK(pixels.depth.at(5, 2, 0) == 0.25f);
    CHECK(pixels.motion.at(5, 2, 0) == -2.5f);
    CHECK(pixels.motion.at(5, 2, 1) == 1.5f);
    recording.sequence.depth_channels.names = {"Z"};
    CHECK(check_message(recording.sequence) == Contains("both.exr: it has no channel Z; there are R, G, B"));
}

TEST_CASE("the check before a run finds every image that does not fit") {
    Recording recording;
    Sequence& sequence = recording.sequence;
    CHECK(check_message(sequence) == "no error");
    FrameFiles& frame = sequence.frames[4];
    const FrameFiles good = frame;
    const auto image = [&](const char* name, Size size, int channels) {
        write_image(recording.folder / name, constant(size, channels, 0), SampleType::f32);
        return recording.folder / name;
    };
    const auto small = image("small.exr", {7, 4}, 4), grey = image("grey.exr", render_size, 2);

    frame.color = small;
    CHECK(check_message(sequence) == Contains("small.exr has 7x4 pixels where the sequence has 8x4 for colour"));
    CHECK_THROWS_WITH_AS(read_frame(sequence, 4, true, true), Contains("small.exr has 7x4"), Error);
    frame.color = grey;
    CHECK(check_message(sequence) == Contains("grey.exr has 2 of the 3 channels that colour needs"));
    frame = good;
    frame.depth = small;
    CHECK(check_message(sequence) == Contains("small.exr has 7x4 pixels where the sequence has 8x4 for depth"));
    frame = good;
    frame.motion = small;
    CHECK(check_message(sequence) == Contains("for motion"));
    frame.motion = image("one.exr", render_size, 1);
    CHECK(check_message(sequence) == Contains("one.exr has 1 of the 2 channels that motion needs"));
    frame = good;
    frame.reference = good.color;
    CHECK(check_message(sequence) == Contains("0004.png has 8x4 pixels where the sequence has 16x8 for the reference"));
    frame = good;
    frame.optional["reactive"] = small;
    CHECK(check_message(sequence) == Contains("for a mask"));
    frame = good;
    frame.optional["reference_motion"] = grey;
    CHECK(check_message(sequence) == Contains("for the reference's motion"));
    frame = good;
    frame.color = recording.folder / "none.png";
    CHECK(check_message(sequence) == Contains("none.png: No such file"));
    frame = good;
    std::ofstream(recording.folder / "text.exr") << "no picture";
    frame.depth = recording.folder / "text.exr";
    CHECK(check_message(sequence) == Contains("text.exr"));
}

TEST_CASE("depth and motion may be absent where nothing needs them") {
    Recording recording;
    recording.sequence.frames[2].motion.clear();
    CHECK(check_message(recording.sequence, false) == "no error");
    CHECK(check_message(recording.sequence, true) == Contains("frame 0002 has no motion"));
    recording.sequence.frames[2].depth.clear();
    CHECK(check_message(recording.sequence, true) == Contains("frame 0002 has no depth"));
    CHECK(read_frame(recording.sequence, 2, true, true).depth.values.empty());
}

TEST_CASE("packed depth needs its four channels and is unpacked") {
    Recording recording;
    Sequence& sequence = recording.sequence;
    sequence.depth_storage = DepthStorage::packed_rgba8;
    CHECK(check_message(sequence) == Contains("has 1 of the 4 channels that packed depth needs"));
    CHECK_THROWS_AS(read_frame(sequence, 0, true, false), Error);

    Pixels packed = constant(render_size, 4, 0);
    const float rgba[] = {10.0f / 255, 20.0f / 255, 30.0f / 255, 40.0f / 255};
    std::copy(rgba, rgba + 4, &packed.at(5, 2, 0));
    write_image(sequence.frames[0].depth = recording.folder / "packed.png", packed, SampleType::u8);
    const Pixels depth = read_frame(sequence, 0, true, false).depth;
    CHECK(depth.channels == 1);
    CHECK(depth.at(4, 2, 0) == 0);
    const double expected = 10 / 255.0 + 20 / (255.0 * 255) + 30 / (255.0 * 255 * 255) + 40 / (255.0 * 255 * 255 * 255);
    CHECK(depth.at(5, 2, 0) == doctest::Approx(expected).epsilon(1e-7));
}

TEST_CASE("frames come in order, whether few or many are read ahead") {
    const Recording recording;
    for (const size_t ahead : {0, 1, 2, 50}) {
        FrameReader reader(recording.sequence, 1, 5, true, false, ahead);
        for (size_t i = 1; i < 5; ++i) {
            const auto frame = reader.next();
            REQUIRE(frame);
            CHECK(frame->index == i);
            CHECK(frame->pixels.color.at(0, 0, 0) == doctest::Approx(static_cast<double>(i) / 255));
            CHECK(frame->pixels.depth.channels == 1);
            CHECK(frame->pixels.reference.values.empty());
        }
        CHECK_FALSE(reader.next());
        CHECK_FALSE(reader.next());
    }
    FrameReader beyond(recording.sequence, 4, 100, false, false);
    CHECK(beyond.next()->index == 4);
    CHECK(beyond.next()->index == 5);
    CHECK_FALSE(beyond.next());
    const FrameReader dropped(recording.sequence, 0, 6, true, true);  // nothing asked for: it ends all the same
}

TEST_CASE("an image that fails is an error at its frame, and the end") {
    Recording recording;
    std::filesystem::remove(recording.sequence.frames[2].motion);
    FrameReader reader(recording.sequence, 0, 6, true, false);
    CHECK(reader.next()->index == 0);
    CHECK(reader.next()->index == 1);
    CHECK_THROWS_WITH_AS(reader.next(), Contains("motion/0002.exr: No such file"), Error);
    CHECK_FALSE(reader.next());
}

TEST_CASE("ground truth is canonical depth, and motion in output pixels") {
    Recording recording;
    recording.sequence.motion = {.unit = MotionUnit::uv, .from_previous = true, .y_up = true};
    recording.sequence.depth = {.projective = true, .reversed = true};
    FrameFiles& frame = recording.sequence.frames[1];
    frame.near_plane = 0.5f;
    frame.far_plane = 2;
    CHECK_FALSE(read_ground_truth(recording.sequence, 1));
    Pixels depth = constant(output_size, 1, 0.2f), motion = constant(output_size, 2, 0.25f);
    depth.values[1] = std::numeric_limits<float>::quiet_NaN();
    depth.values[2] = -1;
    depth.values[3] = 2;
    motion.values[3] = std::numeric_limits<float>::infinity();
    motion.values[4] = 1.2f;  // of 8 pixels: longer than the diagonal of 8x4
    write_image(frame.optional["reference_depth"] = recording.folder / "depth.exr", depth, SampleType::f32);
    CHECK_FALSE(read_ground_truth(recording.sequence, 1));
    write_image(frame.optional["reference_motion"] = recording.folder / "motion.exr", motion, SampleType::f32);

    const GroundTruth truth = read_ground_truth(recording.sequence, 1).value();
    // z = 0.5 · 2 / (0.5 + 0.2 · 1.5) = 1.25
    CHECK(truth.depth.values[0] == doctest::Approx(0.625));
    CHECK(truth.depth.values[1] == 1);
    CHECK(truth.depth.values[2] == 1);
    CHECK(truth.depth.values[3] == 0.25f);  // the near plane
    CHECK(truth.motion.values[0] == -0.25f * 8 * 2);
    CHECK(truth.motion.values[1] == 0.25f * 4 * 2);
    for (const int i : {2, 3, 4, 5}) CHECK(std::isnan(truth.motion.values[i]));

    frame.far_plane = std::numeric_limits<float>::infinity();
    // z = 0.5 / 0.2; d = z / (10⁴ · 0.5)
    CHECK(read_ground_truth(recording.sequence, 1)->depth.values[0] == doctest::Approx(1e-4 / 0.2));
    CHECK(read_ground_truth(recording.sequence, 1)->depth.values[2] == 1);
    recording.sequence.depth = {.projective = false, .reversed = true};
    CHECK(read_ground_truth(recording.sequence, 1)->depth.values[0] == 0.8f);

    write_image(frame.optional["reference_motion"], constant(render_size, 2, 0), SampleType::f32);
    CHECK_THROWS_AS(read_ground_truth(recording.sequence, 1), Error);
}
