#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "cli/moq_publisher.h"
#include "io/video.h"

namespace clarus::cli {

/// What `--output` names, which is one of these or nothing.
struct OutputTarget {
    std::filesystem::path folder;   // for pictures
    std::filesystem::path picture;  // .png or .exr: of one frame, in `folder`
    std::filesystem::path video;    // io::is_video
    std::string stream;             // a URL, that was after "moq:"
    std::string shared;             // a stream's name, that was after "ring:"

    bool is_video() const { return !video.empty() || !stream.empty(); }
};

/// Of a sequence of files, which may be one picture, or of a stream, which may go on as one. Errors: invalid_argument
/// where this build has no videos.
enum class Source { files, stream };
OutputTarget output_target(const std::string& text, Source source);

/// Adds `--crf`.
void add_video_options(CLI::App& command, std::optional<int>& crf);

/// Errors: invalid_argument where the value is not one of the video's encoder, or there is no video.
void check_crf(const std::optional<int>& crf, const OutputTarget& target);

/// A video or stream that frames are written to. It is made with the first one.
class VideoOutput : public io::VideoWriter {
  public:
    /// Starts what publishes a stream. Errors: MoqPublisher's.
    explicit VideoOutput(const OutputTarget& target);

    /// Before the first picture.
    void open(const io::VideoSettings& settings) { settings_ = settings; }
    void write(const io::Pixels& pixels, double seconds, WallTime made) override;
    void finish() override;
    /// Finishes what another error has ended, as far as it goes.
    void keep() noexcept;
    size_t pictures() const { return pictures_; }

  private:
    std::filesystem::path path_;
    io::VideoSettings settings_;
    std::optional<MoqPublisher> publisher_;
    std::unique_ptr<io::VideoWriter> writer_;
    size_t pictures_ = 0;
};

}  // namespace clarus::cli
