#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "clarus/error.h"
#include "clarus/jitter.h"
#include "io/file.h"
#include "io/output_layout.h"
#include "io/qrisp.h"
#include "render/sequence_writer.h"
#include "render_harness.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::render;
using namespace clarus::render_test;
using doctest::Contains;

namespace {

constexpr int frame_count = 3;

/// A sequence of the smooth scene; frame 2 is a cut.
class Recording {
  public:
    explicit Recording(io::Sequence given) : sequence(std::move(given)) {
        sequence.render_size = settings.render_size;
        settings.output_size = sequence.output_size();
        settings.reference_grid = 2;
    }

    FrameState state(int index) const {
        FrameState state{in_front(5 + 0.1 * index), in_front(5.1 + 0.1 * index), 0.1 * index, 0.1 * index - 0.1};
        state.cut = index == 2;
        return state;
    }
    /// Errors leave after what was written before them.
    void write(const std::filesystem::path& path, io::Layout layout, bool replace = false,
               const nlohmann::ordered_json& recipe = {{"scene", "smooth"}}) {
        auto output = io::output_layout(path, layout);
        output->prescribe(sequence);
        settings.hdr = sequence.color_space == ColorSpace::linear;
        settings.motion_at_centre = !sequence.motion.sampled_at_jitter;
        SequenceWriter writer(std::move(output), sequence, settings, recipe, replace);
        for (int i = 0; i < frame_count; ++i) {
            io::FrameFiles frame;
            frame.jitter = mnss_jitter(i + 1, 2);
            frame.reset = state(i).cut;
            frame.near_plane = settings.near_plane;
            frame.far_plane = settings.far_plane;
            frame.camera = Camera(state(i).camera, settings.render_size).matrices(0.1, 250, false);
            writer.add(frame, [&, i] {
                if (i == fail_at) throw Error(ErrorKind::device, "interrupted");
                rendered.push_back(i);
                return render_frame(*scene, state(i), frame.jitter, settings);
            });
        }
        writer.finish();
    }

    RenderSettings settings = small_settings();
    io::Sequence sequence;
    std::unique_ptr<Scene> scene = smooth_scene();
    std::vector<int> rendered;
    int fail_at = -1;
};

double largest_difference(const io::Pixels& a, const io::Pixels& b) {
    REQUIRE(a.values.size() == b.values.size());
    double largest = 0;
    for (size_t i = 0; i < a.values.size(); ++i) {
        largest = std::max(largest, std::abs(double{a.values[i]} - b.values[i]));
    }
    return largest;
}

/// What is read has the canonical values that were rendered.
void check_round_trip(io::Sequence conventions, const std::string& path, io::Layout layout, bool says_cuts) {
    const TemporaryFolder folder;
    Recording recording(std::move(conventions));
    recording.write(folder / path, layout);
    const io::Sequence read = io::read_sequence(folder / path, io::Layout::guess, recording.sequence.scale);
    CHECK(read.render_size == recording.settings.render_size);
    CHECK(read.scale == recording.sequence.scale);
    CHECK(read.output_size() == recording.settings.output_size);
    CHECK(read.frame_rate == 60);
    REQUIRE(read.frames.size() == frame_count);
    io::check_sequence(read, true, true);
    for (int i = 0; i < frame_count; ++i) {
        const io::FrameFiles& files = read.frames[static_cast<size_t>(i)];
        CAPTURE(i);
        CHECK(files.jitter.x == doctest::Approx(mnss_jitter(i + 1, 2).x).epsilon(1e-6));
        CHECK(files.jitter.y == doctest::Approx(mnss_jitter(i + 1, 2).y).epsilon(1e-6));
        CHECK(files.reset == (i == 0 || (says_cuts && i == 2)));
        const RenderedFrame expected =
            render_frame(*recording.scene, recording.state(i), files.jitter, recording.settings);
        const io::FramePixels frame = read_canonical(read, static_cast<size_t>(i));
        CHECK(largest_difference(frame.depth, expected.depth) < 2e-6);
        CHECK(largest_difference(frame.motion, expected.motion) < 1e-4);
        const double step = recording.settings.hdr ? 1e-3 : 0.51 / 255;
        CHECK(largest_difference(frame.color, expected.color) < step);
        CHECK(largest_difference(frame.reference, expected.reference) < step);
    }
}

}  // namespace

TEST_CASE("the native layout in all its conventions") {
    io::Sequence sequence;
    SUBCASE("as it is rendered") {}
    SUBCASE("reversed linear depth, jitter inside the vectors, sampled with the colour") {
        sequence.depth.reversed = true;
        sequence.motion = {.jittered = true, .sampled_at_jitter = true};
    }
    SUBCASE("projective depth, uv upwards to where a surface goes") {
        sequence.depth.projective = true;
        sequence.motion = {.unit = io::MotionUnit::uv, .from_previous = true, .y_up = true, .jittered = true};
    }
    SUBCASE("reversed projective depth, linear radiance") {
        sequence.depth = {.projective = true, .reversed = true};
        sequence.color_space = ColorSpace::linear;
    }
    check_round_trip(sequence, "sequence", io::Layout::native, true);
}

TEST_CASE("QRISP: what is written is what its reader reads, at all its scales and no other") {
    for (const auto& [scale, resolution] : {std::pair(2.0, "540p"), {3.0, "360p"}, {4.0, "270p"}}) {
        CAPTURE(scale);
        const std::string path = std::string("Scene/") + resolution + "/MipBiasMinus1Jittered/0007";
        io::Sequence sequence;
        sequence.scale = scale;
        check_round_trip(sequence, path, io::Layout::qrisp, false);
        sequence.scale = 1.5;
        const auto layout = io::output_layout(path, io::Layout::qrisp);
        CHECK_THROWS_WITH_AS(layout->prescribe(sequence), Contains(fmt::format("the scale {}, not 1.5", scale).c_str()),
                             Error);
    }
    CHECK_THROWS_WITH_AS(io::output_layout("sequence", io::Layout::qrisp), Contains("MipBias"), Error);
}

TEST_CASE("NSS captures: what is written is what its reader reads, at any scale") {
    for (const double scale : {1.5, 2.0, 3.0, 4.0}) {
        CAPTURE(scale);
        io::Sequence sequence;
        sequence.scale = scale;
        for (const bool reversed : {false, true}) {
            sequence.depth.reversed = reversed;
            check_round_trip(sequence, "0003.json", io::Layout::nss, true);
        }
    }
    CHECK_THROWS_WITH_AS(io::output_layout("sequence", io::Layout::nss), Contains(".json"), Error);
}

TEST_CASE("packed depth loses next to nothing of a float") {
    const io::Pixels depth{{5, 1}, 1, {0, 1, 0.1f, 1 / 3.0f, 0.99999994f}};
    const io::Pixels packed = io::pack_depth(depth);
    REQUIRE(packed.channels == 4);
    for (size_t i = 0; i < depth.values.size(); ++i) {
        double d = 0, weight = 1;
        for (size_t byte = 0; byte < 4; ++byte, weight /= 255) {
            const float value = packed.values[4 * i + byte];
            CHECK(value * 255 == doctest::Approx(std::round(value * 255)));
            CHECK(value <= 1);
            d += value * weight;
        }
        CHECK(std::abs(d - depth.values[i]) < 1e-7);
    }
    CHECK(largest_difference(io::unpack_depth(packed), depth) < 1e-7);
}

TEST_CASE("images at output resolution, and the camera, are in the native layout") {
    const TemporaryFolder folder;
    Recording recording({});
    recording.settings.output_buffers = true;
    recording.sequence.motion = {.jittered = true, .sampled_at_jitter = true};
    recording.sequence.depth.reversed = true;
    recording.write(folder / "sequence", io::Layout::native);
    const io::Sequence read = io::read_sequence(folder / "sequence");
    io::check_sequence(read, true, true);
    const io::FrameFiles& files = read.frames[1];
    const RenderedFrame expected = render_frame(*recording.scene, recording.state(1), files.jitter, recording.settings);
    io::Pixels depth = io::read_image(files.optional.at("reference_depth"));
    for (float& value : depth.values) value = 1 - value;
    CHECK(largest_difference(depth, expected.output_depth) < 1e-6);
    // Without jitter, whatever the motion of the input has.
    CHECK(largest_difference(io::read_image(files.optional.at("reference_motion")), expected.output_motion) == 0);
    CHECK(largest_difference(io::read_image(files.optional.at("reference_aliased")), expected.aliased) < 0.51 / 255);
    REQUIRE(files.camera);
    CHECK(files.camera->view[11] == doctest::Approx(-5.1));
    CHECK(files.camera->fov_y == doctest::Approx(1));
}

TEST_CASE("an interrupted sequence continues after its last whole frame, to the same bytes") {
    const TemporaryFolder folder;
    Recording whole({});
    whole.write(folder / "whole", io::Layout::native);
    Recording recording({});
    const auto place = folder / "sequence";
    recording.fail_at = 2;
    CHECK_THROWS_WITH_AS(recording.write(place, io::Layout::native), "interrupted", Error);
    CHECK(recording.rendered == std::vector{0, 1});
    CHECK(!std::filesystem::exists(place / "sequence.json"));
    CHECK(std::filesystem::exists(place / "sequence.unfinished.json"));

    // Another recipe would not fit what is there.
    const nlohmann::ordered_json other = {{"scene", "demo"}};
    CHECK_THROWS_WITH_AS(recording.write(place, io::Layout::native, false, other), Contains("its scene is \"smooth\""),
                         Error);
    CHECK(recording.rendered == std::vector{0, 1});

    // A frame whose image has gone is rendered again.
    std::filesystem::remove(place / "motion" / "0000.exr");
    recording.fail_at = -1;
    recording.write(place, io::Layout::native);
    CHECK(recording.rendered == std::vector{0, 1, 0, 2});
    CHECK(!std::filesystem::exists(place / "sequence.unfinished.json"));
    size_t compared = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "whole")) {
        if (!entry.is_regular_file()) continue;
        const auto relative = std::filesystem::relative(entry.path(), folder / "whole");
        CAPTURE(relative.string());
        CHECK(io::read_file(entry.path()) == io::read_file(place / relative));
        ++compared;
    }
    CHECK(compared == 1 + 4 * frame_count);
}

TEST_CASE("a whole sequence is only replaced when that is asked for, and then altogether") {
    const TemporaryFolder folder;
    const auto place = folder / "sequence";
    Recording recording({});
    recording.write(place, io::Layout::native);
    CHECK_THROWS_WITH_AS(recording.write(place, io::Layout::native), Contains("--force"), Error);
    CHECK(recording.rendered.size() == frame_count);
    std::filesystem::copy_file(place / "color/0002.png", place / "color/0003.png");  // of a longer one
    recording.write(place, io::Layout::native, true);
    CHECK(recording.rendered.size() == 2 * frame_count);
    CHECK(!std::filesystem::exists(place / "color/0003.png"));
    CHECK(io::read_sequence(place).frames.size() == frame_count);
}
