#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <vector>

#include "io/image.h"

namespace clarus::test {

/// What a video holds, as FFmpeg decodes it.
struct VideoFile {
    Size size;
    AVColorRange range;
    AVColorSpace matrix;
    AVColorPrimaries primaries;
    AVColorTransferCharacteristic transfer;
    std::vector<double> seconds;
    std::vector<io::Pixels> pictures;  // Y, Cb, Cr from 0 to 255, chroma repeated
};

inline io::Pixels planes_of(const AVFrame& frame) {
    io::Pixels pixels{{frame.width, frame.height}, 3, {}};
    pixels.values.resize(size_t{3} * frame.width * frame.height);
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x) {
            pixels.at(x, y, 0) = frame.data[0][y * frame.linesize[0] + x];
            for (int plane = 1; plane < 3; ++plane)
                pixels.at(x, y, plane) = frame.data[plane][y / 2 * frame.linesize[plane] + x / 2];
        }
    return pixels;
}

inline VideoFile read_video(const std::filesystem::path& path) {
    AVFormatContext* format = nullptr;
    REQUIRE(avformat_open_input(&format, path.c_str(), nullptr, nullptr) == 0);
    REQUIRE(avformat_find_stream_info(format, nullptr) >= 0);
    REQUIRE(format->nb_streams == 1);
    const AVStream& stream = *format->streams[0];
    AVCodecContext* codec = avcodec_alloc_context3(avcodec_find_decoder(stream.codecpar->codec_id));
    REQUIRE(avcodec_parameters_to_context(codec, stream.codecpar) >= 0);
    REQUIRE(avcodec_open2(codec, nullptr, nullptr) == 0);
    VideoFile video{};
    AVPacket* packet = av_packet_alloc();
    AVFrame* frame = av_frame_alloc();
    const auto decode = [&](AVPacket* coded) {
        REQUIRE(avcodec_send_packet(codec, coded) == 0);
        while (avcodec_receive_frame(codec, frame) == 0) {
            REQUIRE(frame->format == AV_PIX_FMT_YUV420P);
            video.size = {frame->width, frame->height};
            video.range = frame->color_range;
            video.matrix = frame->colorspace;
            video.primaries = frame->color_primaries;
            video.transfer = frame->color_trc;
            video.seconds.push_back(static_cast<double>(frame->best_effort_timestamp) * av_q2d(stream.time_base));
            video.pictures.push_back(planes_of(*frame));
        }
    };
    while (av_read_frame(format, packet) == 0) {
        decode(packet);
        av_packet_unref(packet);
    }
    decode(nullptr);
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&codec);
    avformat_close_input(&format);
    return video;
}

/// BT.709's limited range as display values in [0, 1]: the plain formula.
inline io::Pixels rgb_of(const io::Pixels& planes) {
    io::Pixels rgb = planes;
    for (size_t i = 0; i < rgb.values.size(); i += 3) {
        const float y = (planes.values[i] - 16) / 219, cb = (planes.values[i + 1] - 128) / 224,
                    cr = (planes.values[i + 2] - 128) / 224;
        const float red = y + 2 * (1 - 0.2126f) * cr, blue = y + 2 * (1 - 0.0722f) * cb;
        const float green = (y - 0.2126f * red - 0.0722f * blue) / 0.7152f;
        rgb.values[i] = std::clamp(red, 0.0f, 1.0f);
        rgb.values[i + 1] = std::clamp(green, 0.0f, 1.0f);
        rgb.values[i + 2] = std::clamp(blue, 0.0f, 1.0f);
    }
    return rgb;
}

}  // namespace clarus::test
