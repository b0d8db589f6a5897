#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/channel_layout.h>
#include <libavutil/display.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
}

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "clarus/types.h"
#include "io/file.h"

namespace clarus::test {

/// A video as a test wants it, by an encoder without loss unless another is named: each picture of one colour.
struct RawVideo {
    std::string encoder = "ffv1";
    AVPixelFormat format = AV_PIX_FMT_YUV420P;
    AVColorRange range = AVCOL_RANGE_MPEG;
    AVColorSpace matrix = AVCOL_SPC_BT709;
    AVColorPrimaries primaries = AVCOL_PRI_BT709;
    AVColorTransferCharacteristic transfer = AVCOL_TRC_BT709;
    bool has_audio = false;
    double turned = 0;  // degrees
    struct Picture {
        Size size{32, 16};
        std::array<int, 3> values{};  // as the format's planes have them
    };
    std::vector<Picture> pictures{};

    void write(const std::filesystem::path& path) const {
        AVFormatContext* file = nullptr;
        REQUIRE(avformat_alloc_output_context2(&file, nullptr, nullptr, path.c_str()) >= 0);
        AVStream* stream = avformat_new_stream(file, nullptr);
        AVCodecContext* codec = open(pictures.front().size);
        REQUIRE(avcodec_parameters_from_context(stream->codecpar, codec) >= 0);
        stream->time_base = codec->time_base;
        if (turned != 0)
            av_display_rotation_set(reinterpret_cast<int32_t*>(av_stream_new_side_data(
                                        stream, AV_PKT_DATA_DISPLAYMATRIX, 9 * sizeof(int32_t))),
                                    turned);
        if (has_audio) add_audio(*avformat_new_stream(file, nullptr));
        REQUIRE(avio_open(&file->pb, path.c_str(), AVIO_FLAG_WRITE) >= 0);
        REQUIRE(avformat_write_header(file, nullptr) >= 0);
        for (size_t i = 0; i < pictures.size(); ++i) {
            const Size size = pictures[i].size;
            if (size != Size{codec->width, codec->height}) {
                avcodec_free_context(&codec);
                codec = open(size);
            }
            encode(*file, *stream, *codec, static_cast<int64_t>(i));
        }
        REQUIRE(av_write_trailer(file) >= 0);
        avio_closep(&file->pb);
        avcodec_free_context(&codec);
        avformat_free_context(file);
    }

  private:
    AVCodecContext* open(Size size) const {
        const AVCodec* encoder_of_name = avcodec_find_encoder_by_name(encoder.c_str());
        REQUIRE(encoder_of_name);
        AVCodecContext* codec = avcodec_alloc_context3(encoder_of_name);
        codec->width = size.width;
        codec->height = size.height;
        codec->pix_fmt = format;
        codec->time_base = {1, 25};
        codec->framerate = {25, 1};
        codec->color_range = range;
        codec->colorspace = matrix;
        codec->color_primaries = primaries;
        codec->color_trc = transfer;
        codec->thread_count = 1;
        codec->max_b_frames = 0;
        codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
        codec->strict_std_compliance = FF_COMPLIANCE_UNOFFICIAL;
        av_opt_set(codec->priv_data, "tune", "zerolatency", 0);  // x264's, so that each picture comes at once
        REQUIRE(avcodec_open2(codec, encoder_of_name, nullptr) >= 0);
        return codec;
    }

    static void add_audio(AVStream& stream) {
        stream.codecpar->codec_type = AVMEDIA_TYPE_AUDIO;
        stream.codecpar->codec_id = AV_CODEC_ID_PCM_S16LE;
        stream.codecpar->sample_rate = 8000;
        stream.codecpar->format = AV_SAMPLE_FMT_S16;
        stream.codecpar->bits_per_coded_sample = 16;
        av_channel_layout_default(&stream.codecpar->ch_layout, 1);
        stream.time_base = {1, 8000};
    }

    void fill(AVFrame& frame, const Picture& picture) const {
        const AVPixFmtDescriptor& pixels = *av_pix_fmt_desc_get(format);
        for (int c = 0; c < 3; ++c) {
            const AVComponentDescriptor& component = pixels.comp[c];
            const bool is_chroma = c > 0 && !(pixels.flags & AV_PIX_FMT_FLAG_RGB);
            const int rows = is_chroma ? frame.height >> pixels.log2_chroma_h : frame.height;
            const int columns = is_chroma ? frame.width >> pixels.log2_chroma_w : frame.width;
            for (int y = 0; y < rows; ++y)
                for (int x = 0; x < columns; ++x) {
                    uint8_t* at = frame.data[component.plane] + y * frame.linesize[component.plane] +
                                  x * component.step + component.offset;
                    const auto value = static_cast<uint16_t>(picture.values[c]);
                    std::memcpy(at, &value, component.depth > 8 ? 2 : 1);
                }
        }
    }

    void encode(AVFormatContext& file, const AVStream& stream, AVCodecContext& codec, int64_t index) const {
        AVFrame* frame = av_frame_alloc();
        frame->width = codec.width;
        frame->height = codec.height;
        frame->format = format;
        frame->color_range = range;
        frame->colorspace = matrix;
        frame->color_primaries = primaries;
        frame->color_trc = transfer;
        frame->pts = index;
        REQUIRE(av_frame_get_buffer(frame, 0) >= 0);
        fill(*frame, pictures[index]);
        REQUIRE(avcodec_send_frame(&codec, frame) >= 0);
        AVPacket* packet = av_packet_alloc();
        REQUIRE(avcodec_receive_packet(&codec, packet) >= 0);
        packet->stream_index = stream.index;
        packet->duration = 1;
        av_packet_rescale_ts(packet, codec.time_base, stream.time_base);
        REQUIRE(av_interleaved_write_frame(&file, packet) >= 0);
        av_packet_free(&packet);
        av_frame_free(&frame);
    }
};

/// The first part of a file as another file.
inline void cut_short(const std::filesystem::path& from, const std::filesystem::path& to, double share) {
    const std::string bytes = io::read_file(from);
    std::ofstream(to, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(static_cast<double>(bytes.size()) * share));
}

}  // namespace clarus::test
