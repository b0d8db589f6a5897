#include "io/video_module.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "io/decoder.h"
#include "io/ffmpeg.h"

namespace clarus::io {
namespace {

constexpr int kTicks = 90000;  // a second; every usual frame rate's period is a whole number of them
constexpr int kFileCrf = 18, kWebmCrf = 24, kStreamCrf = 23;

// AV_PIX_FMT_YUV420P counts chroma in pairs of pixels.
int even(int side) { return (side + 1) / 2 * 2; }

// Encodes pictures and hands the packets to a muxer, whose output is its user's.
class Encoder {
  public:
    /// `name` of the output, for messages.
    Encoder(std::string name, const char* container, const char* encoder, const VideoSettings& settings,
            FfmpegOptions& options, bool is_live)
        : name_(std::move(name)),
          size_(settings.size),
          frame_(av_frame_alloc()),
          packet_(av_packet_alloc()),
          bits_(settings.bits),
          bytes_((bits_ == 8 ? sizeof(uint8_t) : sizeof(uint16_t)) * 3 * even(size_.width) * even(size_.height)) {
        AVFormatContext* format = nullptr;
        check(avformat_alloc_output_context2(&format, nullptr, container, nullptr));
        format_.reset(format);
        const AVCodec* codec = avcodec_find_encoder_by_name(encoder);
        if (!codec) fail(ErrorKind::invalid_argument, "cannot write {}: FFmpeg has no {}", name_, encoder);
        codec_.reset(avcodec_alloc_context3(codec));
        set_up_codec(settings, is_live);
        if (const int error = avcodec_open2(codec_.get(), codec, options.get()); error < 0)
            fail(ErrorKind::invalid_argument, "cannot write {}: {} takes no pictures of {}x{} ({})", name_, encoder,
                 size_.width, size_.height, words_of(error));
        stream_ = avformat_new_stream(format_.get(), nullptr);
        check(stream_ ? avcodec_parameters_from_context(stream_->codecpar, codec_.get()) : AVERROR(ENOMEM));
        stream_->time_base = codec_->time_base;
        stream_->avg_frame_rate = codec_->framerate;
        set_up_pictures();
    }

    AVFormatContext& format() { return *format_; }
    const std::string& name() const { return name_; }

    void write_header(FfmpegOptions& options) { check(avformat_write_header(format_.get(), options.get())); }

    void convert(const Pixels& pixels) {
        if (pixels.size != size_)
            fail(ErrorKind::invalid_argument, "{} is a video of {}x{}, which a picture of {}x{} does not go into",
                 name_, size_.width, size_.height, pixels.size.width, pixels.size.height);
        if (bits_ == 8)
            store(pixels, bytes_.data());
        else
            store(pixels, reinterpret_cast<uint16_t*>(bytes_.data()));
        check(av_frame_make_writable(frame_.get()));
        const int height = even(size_.height);
        const std::array<const uint8_t*, 1> planes{bytes_.data()};
        const std::array<int, 1> pitches{static_cast<int>(bytes_.size()) / height};
        sws_scale(converter_.get(), planes.data(), pitches.data(), 0, height, frame_->data, frame_->linesize);
    }

    /// Calls visit(packet), whose times are the stream's, for all that the encoder has done.
    template <typename Visit>
    void encode(double seconds, Visit visit) {
        const int64_t ticks = std::llround(seconds * kTicks);
        frame_->pts = std::max(ticks, last_ + 1);
        last_ = frame_->pts;
        check(avcodec_send_frame(codec_.get(), frame_.get()));
        take_packets(visit);
    }
    template <typename Visit>
    void end(Visit visit) {
        check(avcodec_send_frame(codec_.get(), nullptr));
        take_packets(visit);
        check(av_write_trailer(format_.get()));
    }

    void check(int error) const {
        if (error < 0) fail(ErrorKind::file, "cannot write {}: {}", name_, words_of(error));
    }

  private:
    /// As RGB, with what is missing of even sides.
    template <typename T>
    void store(const Pixels& pixels, T* out) const {
        // White of 16 bits is what libswscale takes 8 bits for, 256 times as much: 65535 would come out beyond white.
        constexpr float largest = sizeof(T) == 1 ? 255 : 255 * 256;
        for (int y = 0; y < even(size_.height); ++y) {
            const float* row =
                &pixels.values[size_t{1} * std::min(y, size_.height - 1) * size_.width * pixels.channels];
            for (int x = 0; x < even(size_.width); ++x) {
                const float* pixel = row + static_cast<size_t>(std::min(x, size_.width - 1)) * pixels.channels;
                for (int channel = 0; channel < 3; ++channel) {
                    const float positive = pixel[channel] > 0 ? pixel[channel] : 0;  // NaN too becomes 0
                    *out++ = static_cast<T>(std::min(positive, 1.0f) * largest + 0.5f);
                }
            }
        }
    }

    void set_up_codec(const VideoSettings& settings, bool is_live) {
        AVCodecContext& codec = *codec_;
        codec.width = even(size_.width);
        codec.height = even(size_.height);
        codec.pix_fmt = bits_ == 8 ? AV_PIX_FMT_YUV420P : AV_PIX_FMT_YUV420P10;
        codec.time_base = {1, kTicks};
        const double rate = std::clamp(settings.frame_rate, 1.0, 1000.0);  // a renderer may have said anything
        codec.framerate = av_d2q(rate, 1001000);
        codec.color_range = AVCOL_RANGE_MPEG;
        codec.colorspace = AVCOL_SPC_BT709;
        codec.color_primaries = AVCOL_PRI_BT709;
        codec.color_trc = AVCOL_TRC_IEC61966_2_1;
        codec.chroma_sample_location = AVCHROMA_LOC_LEFT;
        codec.gop_size = std::max(1, static_cast<int>(std::lround(rate * (is_live ? 1 : 5))));
        if (format_->oformat->flags & AVFMT_GLOBALHEADER) codec.flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    }

    void set_up_pictures() {
        AVFrame& frame = *frame_;
        frame.width = codec_->width;
        frame.height = codec_->height;
        frame.format = codec_->pix_fmt;
        frame.color_range = codec_->color_range;
        frame.colorspace = codec_->colorspace;
        frame.color_primaries = codec_->color_primaries;
        frame.color_trc = codec_->color_trc;
        frame.chroma_location = codec_->chroma_sample_location;
        check(av_frame_get_buffer(&frame, 0));
        converter_.reset(sws_getContext(
            frame.width, frame.height, bits_ == 8 ? AV_PIX_FMT_RGB24 : AV_PIX_FMT_RGB48, frame.width, frame.height,
            codec_->pix_fmt, SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INP, nullptr, nullptr, nullptr));
        const int* coefficients = sws_getCoefficients(SWS_CS_ITU709);
        constexpr int one = 1 << 16;
        if (!converter_ ||
            sws_setColorspaceDetails(converter_.get(), coefficients, 1, coefficients, 0, 0, one, one) < 0)
            fail(ErrorKind::invalid_argument, "cannot write {}: FFmpeg cannot convert pictures of {}x{}", name_,
                 size_.width, size_.height);
    }

    template <typename Visit>
    void take_packets(Visit visit) {
        for (;;) {
            const int result = avcodec_receive_packet(codec_.get(), packet_.get());
            if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
            check(result);
            packet_->stream_index = stream_->index;
            // Encoders that are told no duration say none, and the last picture would have none.
            if (packet_->duration == 0) packet_->duration = std::llround(kTicks * av_q2d(av_inv_q(codec_->framerate)));
            av_packet_rescale_ts(packet_.get(), codec_->time_base, stream_->time_base);
            visit(*packet_);
            av_packet_unref(packet_.get());
        }
    }

    std::string name_;
    Size size_;
    Owned<AVFormatContext> format_;
    Owned<AVCodecContext> codec_;
    Owned<AVFrame> frame_;
    Owned<AVPacket> packet_;
    Owned<SwsContext> converter_;
    AVStream* stream_ = nullptr;  // the format's
    int bits_;
    std::vector<uint8_t> bytes_;  // RGB, of 8 bits or 16 each
    int64_t last_ = -1;
};

class VideoFile : public VideoWriter {
  public:
    VideoFile(const std::filesystem::path& path, const std::filesystem::path& unfinished,
              const VideoSettings& settings) {
        const bool is_webm = path.extension() == ".webm", is_mp4 = path.extension() == ".mp4";
        const std::string crf = std::to_string(settings.crf.value_or(is_webm ? kWebmCrf : kFileCrf));
        FfmpegOptions webm{{"crf", crf}, {"b", "0"}, {"deadline", "good"}, {"cpu-used", "4"}, {"row-mt", "1"}};
        FfmpegOptions h264{{"crf", crf}, {"preset", "medium"}};
        encoder_ =
            std::make_unique<Encoder>(path.string(),
                                      is_webm  ? "webm"
                                      : is_mp4 ? "mp4"
                                               : "matroska",
                                      is_webm ? "libvpx-vp9" : "libx264", settings, is_webm ? webm : h264, false);
        // "file:" lest a colon in the name be taken for a protocol's.
        encoder_->check(avio_open(&encoder_->format().pb, ("file:" + unfinished.string()).c_str(), AVIO_FLAG_WRITE));
        is_open_ = true;
        try {
            FfmpegOptions none{};
            encoder_->write_header(none);
        } catch (...) {
            give_up();
            throw;
        }
    }
    ~VideoFile() override { give_up(); }

    void write(const Pixels& pixels, double seconds, WallTime) override {
        encoder_->convert(pixels);
        encoder_->encode(seconds, [&](AVPacket& packet) { add(packet); });
    }

    void finish() override {
        encoder_->end([&](AVPacket& packet) { add(packet); });
        is_open_ = false;
        const int written = encoder_->format().pb->error;
        const int closed = avio_closep(&encoder_->format().pb);
        encoder_->check(std::min(written, closed));
    }

  private:
    void add(AVPacket& packet) {
        encoder_->check(av_interleaved_write_frame(&encoder_->format(), &packet));
        encoder_->check(encoder_->format().pb->error);  // which its buffer may have had before
    }
    void give_up() {
        if (!is_open_) return;
        avio_closep(&encoder_->format().pb);
        is_open_ = false;
    }

    std::unique_ptr<Encoder> encoder_;
    bool is_open_ = false;
};

class VideoStream : public VideoWriter {
  public:
    VideoStream(const VideoSettings& settings, TakeFragment take) : take_(std::move(take)) {
        FfmpegOptions options{{"crf", std::to_string(settings.crf.value_or(kStreamCrf))},
                              {"preset", "veryfast"},
                              {"tune", "zerolatency"}};
        encoder_ = std::make_unique<Encoder>("the stream", "mp4", "libx264", settings, options, true);
        constexpr int buffer_bytes = 1 << 16;
        AVFormatContext& format = encoder_->format();
        format.pb = avio_alloc_context(static_cast<unsigned char*>(av_malloc(buffer_bytes)), buffer_bytes, 1, this,
                                       nullptr, &VideoStream::collect, nullptr);
        format.flags |= AVFMT_FLAG_CUSTOM_IO;
        // The muxer ends a fragment where it is told to (frag_custom): otherwise it would wait for the next picture.
        FfmpegOptions muxer{{"movflags", "empty_moov+default_base_moof+frag_custom"}, {"write_prft", "wallclock"}};
        try {
            encoder_->write_header(muxer);
            hand_over(false);
        } catch (...) {
            close();
            throw;
        }
    }
    ~VideoStream() override { close(); }

    void write(const Pixels& pixels, double seconds, WallTime made) override {
        encoder_->convert(pixels);
        encoder_->encode(seconds, [&](AVPacket& packet) { add(packet, made); });
    }

    void finish() override {
        encoder_->end([&](AVPacket& packet) { add(packet, WallTime::clock::now()); });
    }

  private:
    static int collect(void* self, uint8_t* bytes, int count) {
        std::vector<std::byte>& fragment = static_cast<VideoStream*>(self)->fragment_;
        const auto* begin = reinterpret_cast<const std::byte*>(bytes);
        fragment.insert(fragment.end(), begin, begin + count);
        return count;
    }

    void add(AVPacket& packet, WallTime made) {
        const bool is_key = packet.flags & AV_PKT_FLAG_KEY;
        auto* time = reinterpret_cast<AVProducerReferenceTime*>(
            av_packet_new_side_data(&packet, AV_PKT_DATA_PRFT, sizeof(AVProducerReferenceTime)));
        if (!time) encoder_->check(AVERROR(ENOMEM));
        *time = {std::chrono::duration_cast<std::chrono::microseconds>(made.time_since_epoch()).count(), 24};
        encoder_->check(av_write_frame(&encoder_->format(), &packet));
        encoder_->check(av_write_frame(&encoder_->format(), nullptr));
        hand_over(is_key);
    }

    void hand_over(bool is_key) {
        avio_flush(encoder_->format().pb);
        if (!fragment_.empty()) take_(fragment_, is_key);
        fragment_.clear();
    }

    void close() {
        AVIOContext*& io = encoder_->format().pb;
        av_freep(&io->buffer);
        avio_context_free(&io);
    }

    TakeFragment take_;
    std::vector<std::byte> fragment_;
    std::unique_ptr<Encoder> encoder_;
};

class Ffmpeg final : public VideoModule {
  public:
    Ffmpeg() { av_log_set_level(AV_LOG_FATAL); }  // errors are told by who calls
    std::unique_ptr<VideoWriter> write(const std::filesystem::path& path, const std::filesystem::path& unfinished,
                                       const VideoSettings& settings) const override {
        return std::make_unique<VideoFile>(path, unfinished, settings);
    }
    std::unique_ptr<VideoWriter> stream(const VideoSettings& settings, TakeFragment take) const override {
        return std::make_unique<VideoStream>(settings, std::move(take));
    }
    std::unique_ptr<VideoReader> open(const std::filesystem::path& path) const override { return decode_video(path); }
};

}  // namespace
}  // namespace clarus::io

extern "C" __attribute__((visibility("default"))) const clarus::io::VideoModule& clarus_video() {
    static const clarus::io::Ffmpeg instance;
    return instance;
}
