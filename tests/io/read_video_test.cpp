#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "clarus/error.h"
#include "io/video.h"
#include "io/video_reader.h"
#include "raw_video.h"
#include "temporary_folder.h"

// Videos as input: what their pictures, times and colours become, and which are refused.

using namespace clarus;
using namespace clarus::test;
namespace fs = std::filesystem;

namespace {

/// Smooth in colours, of which 4:2:0 keeps half.
io::Pixels slope(Size size, int shift) {
    io::Pixels pixels{size, 3, {}};
    pixels.values.resize(size_t{3} * size.width * size.height);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
            const float across = static_cast<float>(x + shift) / static_cast<float>(size.width + 8);
            const float down = static_cast<float>(y) / static_cast<float>(size.height);
            pixels.at(x, y, 0) = across;
            pixels.at(x, y, 1) = 0.25f + 0.5f * down;
            pixels.at(x, y, 2) = 1 - across;
        }
    return pixels;
}

/// `border` pixels at each side do not count.
double largest_difference(const io::Pixels& one, const io::Pixels& other, int border) {
    REQUIRE(one.size == other.size);
    REQUIRE(one.values.size() == other.values.size());
    double largest = 0;
    for (int y = border; y < one.size.height - border; ++y)
        for (int x = border; x < one.size.width - border; ++x)
            for (int c = 0; c < 3; ++c)
                largest = std::max<double>(largest, std::abs(one.at(x, y, c) - other.at(x, y, c)));
    return largest;
}

std::vector<io::VideoPicture> all_of(io::VideoReader& video) {
    std::vector<io::VideoPicture> pictures;
    while (std::optional<io::VideoPicture> picture = video.next()) pictures.push_back(std::move(*picture));
    return pictures;
}

/// Pictures that came before the error, and its words.
std::pair<size_t, std::string> ends_by(const fs::path& path) {
    size_t pictures = 0;
    try {
        const std::unique_ptr<io::VideoReader> video = io::open_video(path);
        while (video->next()) ++pictures;
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::file);
        return {pictures, error.what()};
    }
    return {pictures, ""};
}

void check_refused(const fs::path& path, const std::string& words) {
    const auto [pictures, error] = ends_by(path);
    CHECK(pictures == 0);
    CHECK_MESSAGE(error.find(path.string()) != std::string::npos, error);
    CHECK_MESSAGE(error.find(words) != std::string::npos, error);
}

/// By the plain formula: Kr and Kb of the matrix.
std::array<double, 3> rgb_of_one(std::array<int, 3> values, int bits, bool is_full, double red, double blue) {
    const double one = std::exp2(bits - 8), most = std::exp2(bits) - 1, half = std::exp2(bits - 1);
    const double y = is_full ? values[0] / most : (values[0] - 16 * one) / (219 * one);
    const double span = is_full ? most : 224 * one;
    const double cb = (values[1] - half) / span, cr = (values[2] - half) / span;
    const double r = y + 2 * (1 - red) * cr, b = y + 2 * (1 - blue) * cb;
    return {r, (y - red * r - blue * b) / (1 - red - blue), b};
}

}  // namespace

TEST_CASE("a video has the pictures and times that were written") {
    const TemporaryFolder folder;
    const std::vector<double> seconds{0, 0.04, 0.2, 0.24, 0.3};
    for (const char* name : {"clip.mp4", "clip.mkv", "clip.webm"}) {
        CAPTURE(name);
        const auto writer = io::write_video(folder / name, {.size = {64, 48}, .frame_rate = 25, .crf = 0});
        for (size_t i = 0; i < seconds.size(); ++i) writer->write(slope({64, 48}, static_cast<int>(i)), seconds[i], {});
        writer->finish();
        const auto video = io::open_video(folder / name);
        CHECK(video->facts().size == Size{64, 48});
        CHECK(video->facts().bits == 8);
        CHECK_FALSE(video->facts().has_audio);
        CHECK(video->facts().frames.value_or(0) >= 5);
        const std::vector<io::VideoPicture> pictures = all_of(*video);
        REQUIRE(pictures.size() == seconds.size());
        for (size_t i = 0; i < seconds.size(); ++i) {
            CHECK(pictures[i].seconds == doctest::Approx(seconds[i]).epsilon(0.005));
            // 8 bits of YCbCr, and half of the colours, which at the border lie between no two.
            const io::Pixels written = slope({64, 48}, static_cast<int>(i));
            CHECK(largest_difference(pictures[i].pixels, written, 2) < 4.0 / 255);
            CHECK(largest_difference(pictures[i].pixels, written, 0) < 6.0 / 255);
        }
    }
}

TEST_CASE("matrix, range and bits are those that the video says") {
    struct Case {
        AVPixelFormat format;
        AVColorSpace matrix;
        AVColorRange range;
        int bits;
        double red, blue;
    };
    const TemporaryFolder folder;
    for (const Case& one : {Case{AV_PIX_FMT_YUV420P, AVCOL_SPC_BT709, AVCOL_RANGE_MPEG, 8, 0.2126, 0.0722},
                            {AV_PIX_FMT_YUV420P, AVCOL_SPC_BT709, AVCOL_RANGE_JPEG, 8, 0.2126, 0.0722},
                            {AV_PIX_FMT_YUV420P, AVCOL_SPC_SMPTE170M, AVCOL_RANGE_MPEG, 8, 0.299, 0.114},
                            {AV_PIX_FMT_YUV420P, AVCOL_SPC_UNSPECIFIED, AVCOL_RANGE_UNSPECIFIED, 8, 0.299, 0.114},
                            {AV_PIX_FMT_YUV422P, AVCOL_SPC_BT470BG, AVCOL_RANGE_JPEG, 8, 0.299, 0.114},
                            {AV_PIX_FMT_YUV420P10, AVCOL_SPC_BT709, AVCOL_RANGE_MPEG, 10, 0.2126, 0.0722},
                            {AV_PIX_FMT_YUV444P10, AVCOL_SPC_SMPTE240M, AVCOL_RANGE_JPEG, 10, 0.212, 0.087}}) {
        CAPTURE(av_get_pix_fmt_name(one.format));
        CAPTURE(av_color_space_name(one.matrix));
        CAPTURE(one.range);
        RawVideo raw{.format = one.format, .range = one.range, .matrix = one.matrix};
        const int scale = 1 << (one.bits - 8);
        for (const std::array<int, 3> values :
             {std::array{16, 128, 128}, {235, 128, 128}, {126, 100, 150}, {90, 160, 110}, {180, 120, 132}})
            raw.pictures.push_back({.values = {values[0] * scale, values[1] * scale, values[2] * scale}});
        raw.write(folder / "raw.mkv");
        const auto video = io::open_video(folder / "raw.mkv");
        CHECK(video->facts().bits == one.bits);
        CHECK(video->facts().frame_rate == doctest::Approx(25));
        const std::vector<io::VideoPicture> pictures = all_of(*video);
        REQUIRE(pictures.size() == raw.pictures.size());
        for (size_t i = 0; i < pictures.size(); ++i) {
            const auto expected =
                rgb_of_one(raw.pictures[i].values, one.bits, one.range == AVCOL_RANGE_JPEG, one.red, one.blue);
            for (int channel = 0; channel < 3; ++channel)
                CHECK(pictures[i].pixels.at(9, 7, channel) == doctest::Approx(expected[channel]).epsilon(0.004));
        }
    }
}

TEST_CASE("RGB in a video is RGB") {
    const TemporaryFolder folder;
    RawVideo raw{.format = AV_PIX_FMT_GBRP10, .range = AVCOL_RANGE_JPEG, .matrix = AVCOL_SPC_RGB};
    raw.pictures = {{.values = {1023, 205, 0}}};  // comp[0] is red
    raw.write(folder / "raw.mkv");
    const std::vector<io::VideoPicture> pictures = all_of(*io::open_video(folder / "raw.mkv"));
    REQUIRE(pictures.size() == 1);
    CHECK(pictures[0].pixels.at(5, 5, 0) == doctest::Approx(1).epsilon(0.002));
    CHECK(pictures[0].pixels.at(5, 5, 1) == doctest::Approx(0.2).epsilon(0.01));
    CHECK(pictures[0].pixels.at(5, 5, 2) == doctest::Approx(0).epsilon(0.002));
}

TEST_CASE("videos of other colours, turned ones and those without pictures are refused by name") {
    const TemporaryFolder folder;
    const RawVideo::Picture grey{.values = {500, 512, 512}};
    RawVideo{.format = AV_PIX_FMT_YUV420P10, .transfer = AVCOL_TRC_SMPTE2084, .pictures = {grey}}.write(folder /
                                                                                                        "pq.mkv");
    check_refused(folder / "pq.mkv", "smpte2084");
    RawVideo{.format = AV_PIX_FMT_YUV420P10, .primaries = AVCOL_PRI_BT2020, .pictures = {grey}}.write(folder /
                                                                                                      "wide.mkv");
    check_refused(folder / "wide.mkv", "bt2020");
    RawVideo{.format = AV_PIX_FMT_YUV420P10, .matrix = AVCOL_SPC_BT2020_NCL, .pictures = {grey}}.write(folder /
                                                                                                       "matrix.mkv");
    check_refused(folder / "matrix.mkv", "bt2020nc");
    RawVideo{.encoder = "libx264", .turned = 90, .pictures = {{.values = {90, 128, 128}}}}.write(folder / "phone.mp4");
    check_refused(folder / "phone.mp4", "turned by");
    std::ofstream(folder / "garbage.mp4") << std::string(5000, 'x');
    check_refused(folder / "garbage.mp4", "cannot read the video");
    std::ofstream(folder / "empty.mkv") << "";
    check_refused(folder / "empty.mkv", "cannot read the video");
    check_refused(folder / "none.mkv", "No such file");
}

TEST_CASE("a video reads no other file") {
    const TemporaryFolder folder;
    RawVideo raw{.encoder = "libx264"};
    raw.pictures.assign(3, {.values = {90, 128, 128}});
    raw.write(folder / "other.mp4");
    REQUIRE(ends_by(folder / "other.mp4") == std::pair<size_t, std::string>(3, ""));
    std::ofstream(folder / "list.mp4") << "ffconcat version 1.0\nfile other.mp4\n";
    check_refused(folder / "list.mp4", "cannot read the video");
    std::ofstream(folder / "playlist.mp4")
        << "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:1\n#EXTINF:1.0,\nother.mp4\n#EXT-X-ENDLIST\n";
    check_refused(folder / "playlist.mp4", "cannot read the video");
    std::ofstream(folder / "session.mkv") << "v=0\no=- 0 0 IN IP4 127.0.0.1\nm=video 5004 RTP/AVP 96\n";
    check_refused(folder / "session.mkv", "cannot read the video");
}

TEST_CASE("a video that is cut short gives its whole pictures, then an error") {
    const TemporaryFolder folder;
    const auto writer = io::write_video(folder / "whole.mkv", {.size = {64, 48}, .frame_rate = 25, .crf = 0});
    for (int i = 0; i < 40; ++i) writer->write(slope({64, 48}, i), i / 25.0, {});
    writer->finish();
    REQUIRE(ends_by(folder / "whole.mkv") == std::pair<size_t, std::string>(40, ""));
    for (const double share : {0.3, 0.6, 0.8}) {
        CAPTURE(share);
        cut_short(folder / "whole.mkv", folder / "short.mkv", share);
        const auto [pictures, error] = ends_by(folder / "short.mkv");
        CHECK(pictures > 0);
        CHECK(pictures < 40);
        CHECK_MESSAGE(error.find("frame " + std::to_string(pictures)) != std::string::npos, error);
    }
    cut_short(folder / "whole.mkv", folder / "head.mkv", 0.001);
    check_refused(folder / "head.mkv", "cannot read the video");
}

TEST_CASE("a picture of another size is an error that names it") {
    const TemporaryFolder folder;
    RawVideo raw{.encoder = "mjpeg", .format = AV_PIX_FMT_YUVJ420P, .range = AVCOL_RANGE_JPEG};
    raw.pictures.assign(3, {.size = {32, 16}, .values = {90, 128, 128}});
    raw.pictures.push_back({.size = {48, 32}, .values = {90, 128, 128}});
    raw.write(folder / "sizes.mkv");
    const auto [pictures, error] = ends_by(folder / "sizes.mkv");
    CHECK(pictures == 3);
    for (const char* words : {"frame 3", "48x32", "32x16"})
        CHECK_MESSAGE(error.find(words) != std::string::npos, error);
}
