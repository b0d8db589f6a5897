#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "io/frame_colors.h"

namespace clarus::io {
namespace {

/// Shares of red and blue in luma.
struct Matrix {
    float red, blue;
};

/// Of YCbCr; shares of 0 where it is no constant matrix of display values.
Matrix matrix_of(AVColorSpace space, int height) {
    constexpr Matrix bt709{0.2126f, 0.0722f}, bt601{0.299f, 0.114f};
    switch (space) {
        case AVCOL_SPC_BT709:
            return bt709;
        case AVCOL_SPC_BT470BG:
        case AVCOL_SPC_SMPTE170M:
            return bt601;
        case AVCOL_SPC_SMPTE240M:
            return {0.212f, 0.087f};
        case AVCOL_SPC_FCC:
            return {0.30f, 0.11f};
        case AVCOL_SPC_UNSPECIFIED:  // as players take it
            return height > 576 ? bt709 : bt601;
        default:
            return {0, 0};
    }
}

bool is_usual(AVColorPrimaries primaries) {
    constexpr std::array usual{AVCOL_PRI_BT709,  AVCOL_PRI_UNSPECIFIED, AVCOL_PRI_BT470BG,
                               AVCOL_PRI_BT470M, AVCOL_PRI_SMPTE170M,   AVCOL_PRI_SMPTE240M};
    return std::ranges::find(usual, primaries) != usual.end();
}

bool is_usual(AVColorTransferCharacteristic transfer) {
    constexpr std::array usual{AVCOL_TRC_BT709,      AVCOL_TRC_UNSPECIFIED,  AVCOL_TRC_GAMMA22,
                               AVCOL_TRC_GAMMA28,    AVCOL_TRC_SMPTE170M,    AVCOL_TRC_SMPTE240M,
                               AVCOL_TRC_BT1361_ECG, AVCOL_TRC_IEC61966_2_1, AVCOL_TRC_IEC61966_2_4};
    return std::ranges::find(usual, transfer) != usual.end();
}

const char* name_or(const char* name) { return name ? name : "unknown"; }

const AVPixFmtDescriptor* description_of(const AVFrame& frame) {
    return av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
}

bool is_rgb(const AVPixFmtDescriptor& pixels) { return pixels.flags & (AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL); }

bool has_chroma(const AVPixFmtDescriptor& pixels) { return !is_rgb(pixels) && pixels.nb_components >= 3; }

/// Full also by the names that FFmpeg once gave JPEG's formats.
bool is_full_range(const AVFrame& frame, const AVPixFmtDescriptor& pixels) {
    return frame.color_range == AVCOL_RANGE_JPEG || is_rgb(pixels) || std::string_view(pixels.name).starts_with("yuvj");
}

/// Where a chroma value lies among the pixels that have it, from the first one's centre (0) to the last one's (1).
std::pair<float, float> place_of_chroma(AVChromaLocation location) {
    switch (location) {
        case AVCHROMA_LOC_CENTER:
            return {0.5f, 0.5f};
        case AVCHROMA_LOC_TOPLEFT:
            return {0, 0};
        case AVCHROMA_LOC_TOP:
            return {0.5f, 0};
        default:
            return {0, 0.5f};
    }
}

/// Two values of a row or column between which a pixel lies, and the share of the second.
struct Between {
    int first, second;
    float share;
};

Between between(int pixel, int log2_pixels, float place, int count) {
    const int pixels = 1 << log2_pixels;
    const float at = (static_cast<float>(pixel) - place * static_cast<float>(pixels - 1)) / static_cast<float>(pixels);
    const float below = std::floor(at);
    const int first = static_cast<int>(below);
    return {std::clamp(first, 0, count - 1), std::clamp(first + 1, 0, count - 1), at - below};
}

}  // namespace

std::string why_unread(const AVFrame& frame) {
    const AVPixFmtDescriptor* pixels = description_of(frame);
    constexpr uint64_t unread =
        AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_FLOAT | AV_PIX_FMT_FLAG_BAYER;
    if (!pixels || (pixels->flags & unread) || std::string_view(pixels->name).starts_with("xyz"))
        return fmt::format("its pixels are {}, which are not read", pixels ? pixels->name : "of an unknown kind");
    if (!is_usual(frame.color_trc))
        return fmt::format(
            "its transfer function is {}; only display values of SDR are read (`ffmpeg -vf zscale,tonemap` makes them)",
            name_or(av_color_transfer_name(frame.color_trc)));
    if (!is_usual(frame.color_primaries))
        return fmt::format("its primaries are {}; only those of BT.709 and BT.601 are read",
                           name_or(av_color_primaries_name(frame.color_primaries)));
    if (has_chroma(*pixels) && matrix_of(frame.colorspace, frame.height).red == 0)
        return fmt::format("its colours are {}; YCbCr of BT.601, BT.709, SMPTE 240M and FCC, and RGB are read",
                           name_or(av_color_space_name(frame.colorspace)));
    return "";
}

void FrameColors::read(const AVFrame& frame, int component) {
    const AVPixFmtDescriptor& pixels = *description_of(frame);
    const bool is_chroma = component > 0 && has_chroma(pixels);
    Plane& plane = planes_[component];
    plane.width = is_chroma ? AV_CEIL_RSHIFT(frame.width, pixels.log2_chroma_w) : frame.width;
    plane.height = is_chroma ? AV_CEIL_RSHIFT(frame.height, pixels.log2_chroma_h) : frame.height;
    plane.values.resize(static_cast<size_t>(plane.width) * plane.height);
    line_.resize(plane.width);

    const bool has_palette = pixels.flags & AV_PIX_FMT_FLAG_PAL;
    const int depth = has_palette ? 8 : pixels.comp[component].depth;
    const auto most = static_cast<float>((int64_t{1} << depth) - 1);
    const float one = static_cast<float>(int64_t{1} << depth) / 256;  // of 8 bits
    const bool is_full = is_full_range(frame, pixels);
    const float zero = is_chroma ? 128 * one : is_full ? 0 : 16 * one;
    const float span = is_full ? most : (is_chroma ? 224 : 219) * one;
    const std::array<const uint8_t*, 4> data{frame.data[0], frame.data[1], frame.data[2], frame.data[3]};
    for (int y = 0; y < plane.height; ++y) {
        av_read_image_line2(line_.data(), const_cast<const uint8_t**>(data.data()), frame.linesize, &pixels, 0, y,
                            component, plane.width, has_palette, sizeof(unsigned));
        float* row = &plane.values[static_cast<size_t>(y) * plane.width];
        for (int x = 0; x < plane.width; ++x) row[x] = (static_cast<float>(line_[x]) - zero) / span;
    }
}

void FrameColors::spread(const AVFrame& frame, int component, int y, std::vector<float>& row) const {
    const AVPixFmtDescriptor& pixels = *description_of(frame);
    const Plane& plane = planes_[component];
    const bool is_chroma = component > 0 && has_chroma(pixels);
    const auto [across, down] = place_of_chroma(frame.chroma_location);
    const Between rows = between(y, is_chroma ? pixels.log2_chroma_h : 0, down, plane.height);
    const float* above = &plane.values[static_cast<size_t>(rows.first) * plane.width];
    const float* below = &plane.values[static_cast<size_t>(rows.second) * plane.width];
    for (int x = 0; x < frame.width; ++x) {
        const Between columns = between(x, is_chroma ? pixels.log2_chroma_w : 0, across, plane.width);
        const auto at = [&](int column) { return above[column] + rows.share * (below[column] - above[column]); };
        row[x] = at(columns.first) + columns.share * (at(columns.second) - at(columns.first));
    }
}

Pixels FrameColors::convert(const AVFrame& frame) {
    const AVPixFmtDescriptor& pixels = *description_of(frame);
    const bool is_grey = !is_rgb(pixels) && !has_chroma(pixels);
    const Matrix matrix = matrix_of(frame.colorspace, frame.height);
    for (int component = 0; component < (is_grey ? 1 : 3); ++component) read(frame, component);
    Pixels result{{frame.width, frame.height}, 3, {}};
    result.values.resize(size_t{3} * frame.width * frame.height);
    std::array<std::vector<float>, 3> rows;
    for (std::vector<float>& row : rows) row.resize(frame.width);
    for (int y = 0; y < frame.height; ++y) {
        for (int component = 0; component < (is_grey ? 1 : 3); ++component)
            spread(frame, component, y, rows[component]);
        for (int x = 0; x < frame.width; ++x) {
            std::array<float, 3> color{rows[0][x], rows[is_grey ? 0 : 1][x], rows[is_grey ? 0 : 2][x]};
            if (has_chroma(pixels)) {
                const float luma = color[0];
                const float red = luma + 2 * (1 - matrix.red) * color[2],
                            blue = luma + 2 * (1 - matrix.blue) * color[1];
                const float green = (luma - matrix.red * red - matrix.blue * blue) / (1 - matrix.red - matrix.blue);
                color = {red, green, blue};
            }
            for (int channel = 0; channel < 3; ++channel)
                result.at(x, y, channel) = std::clamp(color[channel], 0.0f, 1.0f);
        }
    }
    return result;
}

}  // namespace clarus::io
