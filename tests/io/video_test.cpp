#include "io/video.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <string>

#include "clarus/error.h"
#include "io/video_reader.h"
#include "metrics/psnr.h"
#include "temporary_folder.h"
#include "video_file.h"

using namespace clarus;
using namespace clarus::test;
using io::Pixels;
namespace fs = std::filesystem;

namespace {

const io::VideoWriter::WallTime made{std::chrono::milliseconds(1'700'000'000'250)};

/// Smooth, for chroma has half the resolution, and moving.
Pixels picture(Size size, int frame) {
    Pixels pixels{size, 3, {}};
    pixels.values.resize(size_t{3} * size.width * size.height);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            for (int channel = 0; channel < 3; ++channel)
                pixels.at(x, y, channel) = 0.5f + 0.4f * std::sin(0.05f * x + 0.03f * y * channel + 0.3f * frame);
    return pixels;
}

Pixels flat(Size size, float red, float green, float blue) {
    Pixels pixels{size, 3, {}};
    for (int i = 0; i < size.width * size.height; ++i) pixels.values.insert(pixels.values.end(), {red, green, blue});
    return pixels;
}

/// The picture's part of a decoded one, which has even sides.
Pixels cut(const Pixels& pixels, Size size) {
    Pixels result{size, 3, {}};
    result.values.resize(size_t{3} * size.width * size.height);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            for (int channel = 0; channel < 3; ++channel) result.at(x, y, channel) = pixels.at(x, y, channel);
    return result;
}

void check_tags(const VideoFile& video) {
    CHECK(video.range == AVCOL_RANGE_MPEG);
    CHECK(video.matrix == AVCOL_SPC_BT709);
    CHECK(video.primaries == AVCOL_PRI_BT709);
    CHECK(video.transfer == AVCOL_TRC_IEC61966_2_1);
}

void check_pictures(const VideoFile& video, Size size, int count) {
    REQUIRE(static_cast<int>(video.pictures.size()) == count);
    CHECK(video.size == Size{(size.width + 1) / 2 * 2, (size.height + 1) / 2 * 2});
    for (int i = 0; i < count; ++i) {
        CAPTURE(i);
        CHECK(video.seconds[i] == doctest::Approx(i / 24.0).epsilon(0.001));
        const double error = metrics::mean_squared_error(cut(rgb_of(video.pictures[i]), size), picture(size, i));
        CHECK(metrics::psnr(error) > 38);
    }
}

std::string message_of(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("a video holds its pictures, their times, and how colours are meant") {
    const TemporaryFolder folder;
    for (const char* name : {"video.mp4", "video.mkv", "video.webm", "with:colon.mp4"})
        for (const Size size : {Size{96, 64}, Size{51, 37}, Size{1, 1}}) {
            CAPTURE(name);
            CAPTURE(size.width);
            const fs::path path = folder / name;
            const auto writer = io::write_video(path, {.size = size, .frame_rate = 24, .crf = 6});
            for (int i = 0; i < 8; ++i) {
                writer->write(picture(size, i), i / 24.0, made);
                CHECK_FALSE(fs::exists(path));
            }
            writer->finish();
            const VideoFile video = read_video(path);
            check_pictures(video, size, 8);
            check_tags(video);
            CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
            fs::remove(path);
        }
}

TEST_CASE("colours are those of BT.709 in its limited range") {
    const TemporaryFolder folder;
    const auto check = [&](Pixels pixels, std::array<float, 3> expected) {
        const auto writer = io::write_video(folder / "flat.mp4", {.size = {32, 32}, .frame_rate = 30, .crf = 1});
        writer->write(pixels, 0, made);
        writer->finish();
        const VideoFile video = read_video(folder / "flat.mp4");
        for (int plane = 0; plane < 3; ++plane)
            CHECK(video.pictures[0].at(16, 16, plane) == doctest::Approx(expected[plane]).epsilon(0.01));
    };
    check(flat({32, 32}, 0, 0, 0), {16, 128, 128});
    check(flat({32, 32}, 2, 1, 5), {235, 128, 128});  // is clamped
    check(flat({32, 32}, 1, 0, 0), {63, 102, 240});
    check(flat({32, 32}, 0, 0, 1), {32, 240, 118});
    check(flat({32, 32}, NAN, -1, 0), {16, 128, 128});
}

TEST_CASE("ten bits hold what eight round away") {
    const TemporaryFolder folder;
    const Size size{65, 33};
    for (const std::string name : {"video.mp4", "video.mkv", "video.webm"}) {
        const auto error = [&](int bits) {
            Pixels grey = picture(size, 0);  // chroma has half the resolution, whatever its bits
            for (size_t i = 0; i < grey.values.size(); ++i) grey.values[i] = grey.values[i / 3 * 3];
            const auto writer = io::write_video(folder / name, {.size = size, .crf = 0, .bits = bits});
            writer->write(grey, 0, made);
            writer->finish();
            const auto reader = io::open_video(folder / name);
            CHECK(reader->facts().bits == bits);
            return metrics::mean_squared_error(cut(reader->next().value().pixels, size), grey);
        };
        const double eight = error(8), ten = error(10);
        CAPTURE(name);
        CAPTURE(eight);
        CHECK(ten < eight / 2);  // crf 0 of ten bits is not without loss
    }
}

TEST_CASE("crf is a video's quality") {
    const TemporaryFolder folder;
    const auto bytes = [&](int crf) {
        const auto writer = io::write_video(folder / "video.mp4", {.size = {96, 64}, .frame_rate = 24, .crf = crf});
        for (int i = 0; i < 8; ++i) writer->write(picture({96, 64}, i), i / 24.0, made);
        writer->finish();
        return fs::file_size(folder / "video.mp4");
    };
    CHECK(bytes(2) > 2 * bytes(45));
}

TEST_CASE("a frame rate that nobody has does no harm, nor do times that go back") {
    const TemporaryFolder folder;
    for (const double frame_rate : {1e30, 1e-30}) {
        const auto writer =
            io::write_video(folder / "video.mp4", {.size = {32, 32}, .frame_rate = frame_rate, .crf = {}});
        for (const double seconds : {0.0, 1.0, 0.5, 60.0}) writer->write(flat({32, 32}, 1, 0, 0), seconds, made);
        writer->finish();
        CHECK(read_video(folder / "video.mp4").pictures.size() == 4);
    }
}

TEST_CASE("a stream has a fragment a picture, at once") {
    constexpr Size size{96, 64};
    const TemporaryFolder folder;
    std::vector<std::string> parts;
    std::vector<bool> keys;
    const auto writer = io::stream_video(
        {.size = size, .frame_rate = 24, .crf = 6}, [&](std::span<const std::byte> bytes, bool is_key) {
            parts.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
            keys.push_back(is_key);
        });
    REQUIRE(parts.size() == 1);
    CHECK(parts[0].substr(4, 4) == "ftyp");
    CHECK(parts[0].find("moov") != std::string::npos);
    for (int i = 0; i < 60; ++i) {
        CAPTURE(i);
        writer->write(picture(size, i), i / 24.0, made);
        REQUIRE(static_cast<int>(parts.size()) == i + 2);
        CHECK(keys.back() == (i % 24 == 0));
        const std::string& part = parts.back();
        CHECK(part.substr(4, 4) == "prft");
        CHECK(part.find("moof") == part.rfind("moof"));
        CHECK(part.find("moof") < part.find("mdat"));
        const auto word = [&](size_t at) {
            uint32_t value = 0;
            for (size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(part[at + k]);
            return value;
        };
        CHECK(word(16) == 1'700'000'000 + 2'208'988'800);  // NTP's seconds are from 1900
        CHECK(word(20) / 4294967296.0 == doctest::Approx(0.25).epsilon(0.001));
    }
    writer->finish();
    CHECK(parts.size() == 61);
    std::ofstream(folder / "stream.mp4", std::ios::binary) << [&] {
        std::string all;
        for (const std::string& part : parts) all += part;
        return all;
    }();
    const VideoFile video = read_video(folder / "stream.mp4");
    check_pictures(video, size, 60);
    check_tags(video);
}

TEST_CASE("what cannot be written is named, and nothing is left") {
    const TemporaryFolder folder;
    const auto left = [&] { return std::distance(fs::directory_iterator(folder.path()), {}); };
    const fs::path missing = folder / "missing/video.mp4", path = folder / "video.mp4";
    const io::VideoSettings settings{.size = {96, 64}, .frame_rate = 24, .crf = {}};
    CHECK(message_of([&] { io::write_video(missing, settings); }) ==
          "cannot write " + missing.string() + ": No such file or directory");
    {
        const auto writer = io::write_video(path, settings);
        writer->write(picture({96, 64}, 0), 0, made);
        CHECK(message_of([&] {
                  writer->write(picture({64, 64}, 0), 1, made);
              }) == path.string() + " is a video of 96x64, which a picture of 64x64 does not go into");
    }
    CHECK(left() == 0);
    CHECK(message_of([&] {
              io::write_video(path, {.size = {40000, 40000}, .frame_rate = 24, .crf = {}});
          }).starts_with("cannot write " + path.string() + ": libx264 takes no pictures of 40000x40000"));
    CHECK(left() == 0);
    fs::create_directory(path);
    CHECK(message_of([&] { io::write_video(path, settings); }) == "cannot write " + path.string() + ": Is a directory");
    CHECK(left() == 1);
    CHECK(message_of([&] {
              io::stream_video(
                  settings, [](std::span<const std::byte>, bool) { throw Error(ErrorKind::file, "nobody is there"); });
          }) == "nobody is there");
}
