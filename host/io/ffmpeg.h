#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <array>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>

namespace clarus::io {

// FFmpeg's objects with owners: for the module alone.

struct FreeFfmpeg {
    void operator()(AVFrame* frame) const { av_frame_free(&frame); }
    void operator()(AVPacket* packet) const { av_packet_free(&packet); }
    void operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
    void operator()(AVFormatContext* format) const { avformat_free_context(format); }
    void operator()(SwsContext* context) const { sws_freeContext(context); }
};
template <typename Type>
using Owned = std::unique_ptr<Type, FreeFfmpeg>;

inline std::string words_of(int error) {
    std::array<char, AV_ERROR_MAX_STRING_SIZE> words{};
    return av_make_error_string(words.data(), words.size(), error);
}

/// Options by name, as FFmpeg's tools know them.
class FfmpegOptions {
  public:
    FfmpegOptions(std::initializer_list<std::pair<const char*, std::string>> options) {
        for (const auto& [name, value] : options) av_dict_set(&options_, name, value.c_str(), 0);
    }
    ~FfmpegOptions() { av_dict_free(&options_); }
    FfmpegOptions(const FfmpegOptions&) = delete;
    FfmpegOptions& operator=(const FfmpegOptions&) = delete;
    AVDictionary** get() { return &options_; }

  private:
    AVDictionary* options_ = nullptr;
};

}  // namespace clarus::io
