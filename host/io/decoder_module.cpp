extern "C" {
#include <libavutil/display.h>
#include <libavutil/pixdesc.h>
}

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "io/decoder.h"
#include "io/ffmpeg.h"
#include "io/frame_colors.h"

namespace clarus::io {
namespace {

constexpr int64_t kMostPixels = int64_t{1} << 26;  // 8192×8192: a small file may claim to be a large picture
constexpr int kMostThreads = 4;                    // each keeps pictures
constexpr double kUsualRate = 60;

/// Containers that hold their pictures themselves; no playlists and no lists of images, which name other files.
constexpr const char* kFormats = "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi";

struct CloseInput {
    void operator()(AVFormatContext* format) const { avformat_close_input(&format); }
};

class Decoder : public VideoReader {
  public:
    explicit Decoder(const std::filesystem::path& path)
        : name_(path.string()), packet_(av_packet_alloc()), frame_(av_frame_alloc()) {
        open_file(path);
        open_codec();
        check_rotation();
        find_facts();
    }

    const VideoFacts& facts() const override { return facts_; }

    std::optional<VideoPicture> next() override {
        if (!decode()) {
            check_complete();
            return std::nullopt;
        }
        const AVFrame& frame = *frame_;
        if (frame.decode_error_flags != 0 || (frame.flags & AV_FRAME_FLAG_CORRUPT)) fail_here("it is damaged");
        if (Size{frame.width, frame.height} != facts_.size)
            fail_here(fmt::format("it has {}x{} pixels where the video begins with {}x{}", frame.width, frame.height,
                                  facts_.size.width, facts_.size.height));
        VideoPicture picture{convert(), time_of(frame)};
        ++pictures_;
        av_frame_unref(frame_.get());
        return picture;
    }

  private:
    [[noreturn]] void refuse(const std::string& why) const {
        fail(ErrorKind::file, "cannot read the video {}: {}", name_, why);
    }
    [[noreturn]] void fail_here(const std::string& why) const {
        fail(ErrorKind::file, "cannot read frame {} of the video {}: {}", pictures_, name_, why);
    }
    void check(int error) const {
        if (error < 0) refuse(words_of(error));
    }

    void open_file(const std::filesystem::path& path) {
        AVFormatContext* format = nullptr;
        FfmpegOptions options{{"protocol_whitelist", "file"}, {"format_whitelist", kFormats}};
        // "file:" lest a colon in the name be taken for a protocol's.
        check(avformat_open_input(&format, ("file:" + path.string()).c_str(), nullptr, options.get()));
        format_.reset(format);
        check(avformat_find_stream_info(format, nullptr));
        const int index = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
        if (index < 0) refuse("it has no pictures");
        stream_ = format->streams[index];
        for (unsigned i = 0; i < format->nb_streams; ++i) {
            AVStream& stream = *format->streams[i];
            facts_.has_audio = facts_.has_audio || stream.codecpar->codec_type == AVMEDIA_TYPE_AUDIO;
            if (&stream != stream_) stream.discard = AVDISCARD_ALL;
        }
    }

    void open_codec() {
        const AVCodecParameters& parameters = *stream_->codecpar;
        const AVCodec* codec = avcodec_find_decoder(parameters.codec_id);
        if (!codec)
            refuse(fmt::format("FFmpeg has no decoder of its {} pictures", avcodec_get_name(parameters.codec_id)));
        codec_.reset(avcodec_alloc_context3(codec));
        check(codec_ ? avcodec_parameters_to_context(codec_.get(), &parameters) : AVERROR(ENOMEM));
        codec_->pkt_timebase = stream_->time_base;
        codec_->max_pixels = kMostPixels;
        codec_->thread_count = kMostThreads;
        // With a thread a picture, FFmpeg 5.1 ends the process at a damaged one of MPEG-4, by an assertion.
        if (parameters.codec_id == AV_CODEC_ID_MPEG4) codec_->thread_type = FF_THREAD_SLICE;
        codec_->err_recognition = AV_EF_EXPLODE;  // no picture that is made up where bits are wrong
        check(avcodec_open2(codec_.get(), codec, nullptr));
        const int64_t pixels = int64_t{codec_->width} * codec_->height;
        if (codec_->width < 1 || codec_->height < 1) refuse("its pictures have no size");
        if (pixels > kMostPixels)
            refuse(fmt::format("its pictures of {}x{} have more than {} pixels", codec_->width, codec_->height,
                               kMostPixels));
    }

    void check_rotation() const {
        size_t bytes = 0;
        const uint8_t* data = av_stream_get_side_data(stream_, AV_PKT_DATA_DISPLAYMATRIX, &bytes);
        if (!data || bytes < 9 * sizeof(int32_t)) return;
        const auto* matrix = reinterpret_cast<const int32_t*>(data);
        constexpr int32_t one = 1 << 16;
        if (matrix[0] == one && matrix[1] == 0 && matrix[3] == 0 && matrix[4] == one) return;
        refuse(
            fmt::format("it is to be turned by {:.0f}° or mirrored when it is shown, which is not done here; "
                        "`ffmpeg -i {} -crf 8 turned.mp4` makes a video that is turned already",
                        -av_display_rotation_get(matrix), name_));
    }

    void find_facts() {
        facts_.size = {codec_->width, codec_->height};
        const AVRational rate = av_guess_frame_rate(format_.get(), stream_, nullptr);
        facts_.frame_rate = rate.num > 0 && rate.den > 0 ? std::clamp(av_q2d(rate), 1.0, 1000.0) : kUsualRate;
        if (const AVPixFmtDescriptor* pixels = av_pix_fmt_desc_get(codec_->pix_fmt))
            facts_.bits = pixels->comp[0].depth;
        const std::optional<double> length = seconds();
        if (stream_->nb_frames > 0)
            facts_.frames = static_cast<size_t>(stream_->nb_frames);
        else if (length)
            facts_.frames = static_cast<size_t>(std::llround(*length * facts_.frame_rate));
    }

    /// How long the pictures are shown, where the file says so: of a file of several tracks, that of the track.
    std::optional<double> seconds() const {
        if (stream_->duration != AV_NOPTS_VALUE)
            return static_cast<double>(stream_->duration) * av_q2d(stream_->time_base);
        const bool is_told = format_->duration_estimation_method != AVFMT_DURATION_FROM_BITRATE;
        if (format_->nb_streams == 1 && format_->duration > 0 && is_told)
            return static_cast<double>(format_->duration) / AV_TIME_BASE;
        return std::nullopt;
    }

    /// Whether there is another picture, then in frame_.
    bool decode() {
        for (;;) {
            const int received = avcodec_receive_frame(codec_.get(), frame_.get());
            if (received == 0) return true;
            if (received == AVERROR_EOF) return false;
            if (received != AVERROR(EAGAIN)) fail_here(words_of(received));
            const int read = av_read_frame(format_.get(), packet_.get());
            if (read < 0 && read != AVERROR_EOF) fail_here(words_of(read));
            const bool is_ours = read == 0 && packet_->stream_index == stream_->index;
            if (is_ours && (packet_->flags & AV_PKT_FLAG_CORRUPT)) fail_here("the file is cut short or damaged");
            int sent = 0;
            if (read < 0)
                sent = avcodec_send_packet(codec_.get(), nullptr);
            else if (is_ours)
                sent = avcodec_send_packet(codec_.get(), packet_.get());
            av_packet_unref(packet_.get());
            if (sent < 0 && sent != AVERROR_EOF) fail_here(words_of(sent));
        }
    }

    /// A file that is cut short may end as if it were whole.
    void check_complete() const {
        if (format_->pb && format_->pb->error < 0) fail_here(words_of(format_->pb->error));
        if (pictures_ == 0) refuse("it has no pictures");
        // The last picture's time may be longer than that of others, and is not always told.
        const double shown = std::max({2.5 / facts_.frame_rate, 1.5 * longest_, last_shown_});
        const std::optional<double> length = seconds();
        if (pictures_ > 1 && length && last_ + shown < *length)
            fail_here(fmt::format("the file ends after {:.2f} of {:.2f} seconds; it is cut short or damaged", last_,
                                  *length));
    }

    /// After the first picture's.
    double time_of(const AVFrame& frame) {
        const double period = 1 / facts_.frame_rate;
        const int64_t ticks = frame.best_effort_timestamp;
        const double time = static_cast<double>(ticks) * av_q2d(stream_->time_base);
        if (ticks != AV_NOPTS_VALUE && !start_) start_ = time - last_;
        const double after = start_ && ticks != AV_NOPTS_VALUE ? time - *start_ : last_ + period;
        last_shown_ = static_cast<double>(frame.pkt_duration) * av_q2d(stream_->time_base);
        if (pictures_ == 0) return last_;
        longest_ = std::max(longest_, after - last_);
        return last_ = after > last_ ? after : last_ + period;
    }

    Pixels convert() {
        if (const std::string why = why_unread(*frame_); !why.empty()) fail_here(why);
        return colors_.convert(*frame_);
    }

    std::string name_;
    VideoFacts facts_;
    std::unique_ptr<AVFormatContext, CloseInput> format_;
    AVStream* stream_ = nullptr;  // the format's
    Owned<AVCodecContext> codec_;
    Owned<AVPacket> packet_;
    Owned<AVFrame> frame_;
    FrameColors colors_;
    std::optional<double> start_;  // the file's time of the first picture
    double last_ = 0;              // of the last picture, after the first one
    double last_shown_ = 0;        // how long, where the file says so
    double longest_ = 0;           // from a picture to the next
    size_t pictures_ = 0;          // that were read
};

}  // namespace

std::unique_ptr<VideoReader> decode_video(const std::filesystem::path& path) { return std::make_unique<Decoder>(path); }

}  // namespace clarus::io
