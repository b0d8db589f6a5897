#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "clarus/error.h"
#include "io/frames.h"
#include "io/sequence.h"
#include "temporary_folder.h"

using namespace clarus;
using namespace clarus::io;
using doctest::Contains;
using nlohmann::json;

namespace {

void write(const std::filesystem::path& path, Size size, int channels, SampleType type) {
    std::filesystem::create_directories(path.parent_path());
    const auto count = static_cast<size_t>(size.width) * size.height * channels;
    write_image(path, {size, channels, std::vector<float>(count, 0.5f)}, type);
}

void write(const std::filesystem::path& path, const json& text) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
}

template <typename F>
doctest::String message_of(F&& read) {
    try {
        read();
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        return error.what();
    }
    return "no error";
}

/// Frames 0000 to 0002 of one QRISP segment.
class Qrisp {
  public:
    Qrisp(const std::string& resolution, const std::string& rendering, int scale) {
        const auto low = folder / "Scene" / resolution;
        const Size size{4 * scale, 12 / scale};
        segment = low / rendering / "0007";
        for (const std::string name : {"0000", "0001", "0002"}) {
            write(segment / (name + ".png"), size, 4, SampleType::u8);
            write(low / ("Depth" + rendering) / "0007" / (name + ".png"), size, 4, SampleType::u8);
            write(low / ("MotionVectors" + rendering) / "0007" / (name + ".exr"), size, 3, SampleType::f16);
            write(low / "CameraData/0007" / (name + ".json"), json{{"jitter_offset", {{"x", 0.25}, {"y", -0.375}}}});
            write(folder / "Scene/1080p/Enhanced/0007" / (name + ".png"), {size.width * scale, size.height * scale}, 3,
                  SampleType::u8);
        }
    }
    TemporaryFolder folder;
    std::filesystem::path segment;
};

/// Frames 0000 and 0001 of the sequence 0003 of an NSS capture, 16x8 in, ×2 and ×1.5.
class Nss {
  public:
    Nss() : path(folder / "0003.json") {
        for (const std::string name : {"0000.exr", "0001.exr"}) {
            write(folder / "ground_truth/0003" / name, {32, 16}, 4, SampleType::f16);
            write(folder / "x2/color/0003" / name, {16, 8}, 4, SampleType::f16);
            write(folder / "x2/depth/0003" / name, {16, 8}, 1, SampleType::f32);
            write(folder / "x2/motion/0003" / name, {16, 8}, 2, SampleType::f16);
            write(folder / "x1_5/color/0003" / name, {20, 10}, 4, SampleType::f16);
        }
        const json frame = {
            {"CameraNearPlane", 0.1},
            {"CameraFarPlane", -1.0},
            {"Jitter", {{"X", 0.5}, {"Y", 0.5}}},
            {"NormalizedPerRatioJitter", {{{"X", 0.0}, {"Y", 0.02}}, {{"X", 0.25 / 16}, {"Y", -0.5 / 8}}}},
            {"Exposure", 2.0}};
        text = {{"EmulatedFramerate", 30},
                {"ReverseZ", true},
                {"UpscalingRatiosIndices", {{"x1_5_index", 0}, {"x2_index", 1}}},
                {"Frames", {frame, frame}}};
    }
    Sequence read(double scale = 2) const {
        write(path, text);
        return read_sequence(path, Layout::guess, scale);
    }
    TemporaryFolder folder;
    std::filesystem::path path;
    json text;
};

}  // namespace

TEST_CASE("a QRISP segment") {
    const Qrisp qrisp("540p", "MipBiasMinus1Jittered", 2);
    const Sequence sequence = read_sequence(qrisp.segment);
    CHECK(sequence.render_size == Size{8, 6});
    CHECK(sequence.scale == 2);
    CHECK(sequence.mip_bias == -1);
    CHECK(sequence.color_space == ColorSpace::srgb);
    CHECK(sequence.depth_storage == DepthStorage::packed_rgba8);
    CHECK_FALSE(sequence.depth.projective);
    CHECK_FALSE(sequence.depth.reversed);
    REQUIRE(sequence.frames.size() == 3);
    CHECK(sequence.frames[0].reset);
    CHECK_FALSE(sequence.frames[1].reset);
    CHECK(sequence.frames[2].name == "0002");
    CHECK(sequence.frames[2].jitter == Vec2{-0.25f, -0.375f});
    const MotionEncoding motion = sequence.motion_encoding();
    CHECK(motion.scale == Vec2{-8, 6});
    CHECK(motion.jittered);
    CHECK(motion.sampled_at_jitter);
    check_sequence(sequence, true, true);
    const FramePixels frame = read_frame(sequence, 1, true, true);
    CHECK(frame.color.channels == 3);  // of 4 in the file
    CHECK(frame.motion.channels == 2);
    CHECK(frame.reference.size == Size{16, 12});
    // 128 in every byte.
    CHECK(frame.depth.at(0, 0, 0) == doctest::Approx(128 * (1 / 255.0 + 1 / 65025.0 + 1 / 16581375.0)));

    CHECK(read_sequence(qrisp.segment / "").frames.size() == 3);  // a slash at the end
    const Sequence third = read_sequence(Qrisp("360p", "MipBiasMinus1.58Jittered", 3).segment);
    CHECK(third.scale == 3);
    CHECK(third.mip_bias == -1.58);
    CHECK_FALSE(read_sequence(Qrisp("540p", "MipBiasNoneJittered", 2).segment).mip_bias);
    CHECK(read_sequence(Qrisp("270p", "MipBiasMinus2Jittered", 4).segment).output_size() == Size{64, 12});
}

TEST_CASE("a QRISP segment without depth, motion or reference") {
    const Qrisp qrisp("540p", "MipBiasMinus1Jittered", 2);
    std::filesystem::remove_all(qrisp.folder / "Scene/1080p");
    std::filesystem::remove_all(qrisp.folder / "Scene/540p/MotionVectorsMipBiasMinus1Jittered");
    const Sequence sequence = read_sequence(qrisp.segment);
    CHECK(sequence.frames[0].reference.empty());
    CHECK_NOTHROW(check_sequence(sequence, false, false));
    CHECK(message_of([&] { check_sequence(sequence, true, true); }) == Contains("frame 0000 has no motion"));
}

TEST_CASE("links that lead out of a capture are not followed") {
    const auto lead_out = [](const std::filesystem::path& file) {
        std::filesystem::remove(file);
        std::filesystem::create_symlink("/etc/hostname", file);
    };
    for (const char* file : {"540p/CameraData/0007/0001.json", "540p/MipBiasMinus1Jittered/0007/0001.png",
                             "540p/DepthMipBiasMinus1Jittered/0007/0001.png", "1080p/Enhanced/0007/0001.png"}) {
        const Qrisp qrisp("540p", "MipBiasMinus1Jittered", 2);
        lead_out(qrisp.folder / "Scene" / file);
        CHECK(message_of([&] { read_sequence(qrisp.segment); }) ==
              Contains("a link leads it out of the sequence's folder"));
    }
    Nss nss;
    lead_out(nss.folder / "x2/depth/0003/0001.exr");
    CHECK(message_of([&] { nss.read(2); }) == Contains("a link leads it out of the sequence's folder"));
}

TEST_CASE("a QRISP segment that is wrong") {
    const Qrisp qrisp("540p", "MipBiasMinus1Jittered", 2);
    const auto message = [&] { return message_of([&] { read_sequence(qrisp.segment); }); };
    const auto camera = qrisp.folder / "Scene/540p/CameraData/0007/0001.json";
    write(camera, json{{"jitter_offset", {{"x", 0.25}}}});
    CHECK(message() == Contains("CameraData/0007/0001.json: jitter_offset lacks the field \"y\""));
    write(camera, json{{"jitter_offset", {{"x", 0.25}, {"y", 2}}}});
    CHECK(message() == Contains("jitter_offset.y must be a number from -1 to 1, not 2"));
    std::filesystem::remove(camera);
    CHECK(message() == Contains("0001.json: No such file"));
    std::filesystem::remove(qrisp.segment / "0001.png");
    CHECK(message() == Contains("frames between 0000 and 0002 are missing"));
    for (const char* name : {"0000.png", "0002.png"}) std::filesystem::remove(qrisp.segment / name);
    CHECK(message() == Contains("has no frames"));
    std::filesystem::remove(qrisp.segment);
    CHECK(message() == Contains("No such file or directory"));
    CHECK(message_of([&] { read_sequence(qrisp.folder.path(), Layout::qrisp); }) ==
          Contains("is not the folder of a QRISP segment"));
}

TEST_CASE("an NSS capture") {
    const Nss nss;
    const Sequence sequence = nss.read();
    CHECK(sequence.render_size == Size{16, 8});
    CHECK(sequence.scale == 2);
    CHECK(sequence.frame_rate == 30);
    CHECK(sequence.color_space == ColorSpace::linear);
    CHECK(sequence.depth_storage == DepthStorage::first_channel);
    CHECK(sequence.depth.projective);
    CHECK(sequence.depth.reversed);
    REQUIRE(sequence.frames.size() == 2);
    const FrameFiles& frame = sequence.frames[1];
    CHECK(frame.name == "0001");
    CHECK(frame.jitter.x == doctest::Approx(0.25));
    CHECK(frame.jitter.y == doctest::Approx(-0.5));
    CHECK(frame.near_plane == 0.1f);
    CHECK(frame.far_plane == std::numeric_limits<float>::infinity());
    CHECK(frame.exposure == 2);
    CHECK(sequence.frames[0].reset);
    CHECK_FALSE(frame.reset);
    const MotionEncoding motion = sequence.motion_encoding();
    CHECK(motion.scale == Vec2{-16, -8});
    CHECK_FALSE(motion.jittered);
    CHECK(motion.sampled_at_jitter);
    CHECK_NOTHROW(check_sequence(sequence, true, true));
    CHECK(read_frame(sequence, 1, true, true).reference.size == Size{32, 16});

    const Sequence other = nss.read(1.5);
    CHECK(other.render_size == Size{20, 10});
    CHECK(other.frames[1].color == nss.folder / "x1_5/color/0003/0001.exr");
    CHECK(other.frames[1].jitter.y == doctest::Approx(0.2));
}

TEST_CASE("an NSS capture with a cut, a far plane and one ratio") {
    Nss nss;
    nss.text["Frames"][1]["CameraCut"] = true;
    nss.text["Frames"][1]["CameraFarPlane"] = 100;
    nss.text["Frames"][1].erase("Exposure");
    CHECK(nss.read().frames[1].reset);
    CHECK(nss.read().frames[1].far_plane == 100);
    CHECK(nss.read().frames[1].exposure == 1);
    nss.text.erase("UpscalingRatiosIndices");
    for (json& frame : nss.text["Frames"]) frame["NormalizedPerRatioJitter"] = {{{"X", -0.5 / 16}, {"Y", 0.0}}};
    CHECK(nss.read().frames[0].jitter.x == doctest::Approx(-0.5));
}

TEST_CASE("an NSS capture that is wrong") {
    const auto message = [](const char* place, const json& value, double scale = 2) {
        Nss nss;
        nss.text[json::json_pointer(place)] = value;
        return message_of([&] { nss.read(scale); });
    };
    CHECK(message("/ReverseZ", 1) == Contains("0003.json: ReverseZ must be true or false, not 1"));
    CHECK(message("/Frames", 1) == Contains("Frames must be a list"));
    CHECK(message("/Frames", json::array()) == Contains("at least one frame"));
    CHECK(message("/Frames/2", 1) == Contains("Frames has 3 entries, but"));
    CHECK(message("/Frames/1", 1) == Contains("Frames[1] must be an object"));
    CHECK(message("/Frames/1/CameraNearPlane", 0) == Contains("Frames[1].CameraNearPlane must be a positive number"));
    CHECK(message("/Frames/1/CameraFarPlane", 0.05) == Contains("Frames[1].CameraFarPlane must be farther"));
    CHECK(message("/Frames/1/CameraFarPlane", 0) == Contains("Frames[1].CameraFarPlane must be farther"));
    CHECK(message("/Frames/1/Exposure", -1) == Contains("Frames[1].Exposure must be a positive number, not -1"));
    CHECK(message("/Frames/1/NormalizedPerRatioJitter/1/X", 1.1 / 16) ==
          Contains("Frames[1].NormalizedPerRatioJitter[1].X must be a number"));
    CHECK(message("/UpscalingRatiosIndices/x2_index", 2) ==
          Contains("Frames[0].NormalizedPerRatioJitter must be a list of more than 2"));
    CHECK(message("/UpscalingRatiosIndices/x2_index", -1) == Contains("UpscalingRatiosIndices.x2_index must be"));
    CHECK(message("/Frames/1/CameraCutt", true) ==
          Contains("Frames[1] has the unknown field \"CameraCutt\"; is it CameraCut?"));
    CHECK(message("/Frames/1/exposure", 2) == Contains("is it Exposure?"));
    CHECK(message("/EmulatedFrameRate", 2) == Contains("is it EmulatedFramerate?"));
    CHECK(message("/Frames/1/ViewProjection", 2) == "no error");  // which others may have
    CHECK(message("/ReverseZ", true, 3) == Contains("x3/color/0003: No such file"));
    CHECK(message("/ReverseZ", true) == "no error");
}

TEST_CASE("a layout that cannot be told is asked for") {
    const Nss nss;
    nss.read();
    CHECK(message_of([&] { read_sequence(nss.folder.path()); }) == Contains("cannot tell the layout"));
    CHECK(message_of([&] { read_sequence(nss.folder / "ground_truth"); }) ==
          Contains("nss: <dataset>/<sequence>.json"));
    std::filesystem::remove_all(nss.folder / "ground_truth");
    CHECK(message_of([&] { read_sequence(nss.path); }) == Contains("cannot tell the layout"));
    CHECK(read_sequence(nss.path, Layout::nss).frames[0].reference.empty());
}
