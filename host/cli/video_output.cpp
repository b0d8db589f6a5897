#include "cli/video_output.h"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <system_error>

#include "base/error.h"
#include "cli/taken_files.h"
#include "io/image_folder.h"

namespace clarus::cli {
namespace {

/// A name that cannot be meant as a folder's.
bool is_another_file(std::string_view extension) {
    constexpr std::string_view kinds[] = {".avi", ".bmp", ".exr", ".flv", ".gif",  ".jpeg", ".jpg", ".m4v",
                                          ".mov", ".mpg", ".png", ".tif", ".tiff", ".ts",   ".wmv", ".y4m"};
    return std::ranges::find(kinds, extension) != std::end(kinds);
}

}  // namespace

OutputTarget output_target(const std::string& text, Source source) {
    constexpr std::string_view published = "moq:", shared = "ring:";
    const bool streams = source == Source::stream;
    const std::string extension = io::extension_of(text);
    OutputTarget target;
    std::error_code unreadable;
    const bool is_folder = std::filesystem::is_directory(text, unreadable);
    if (streams && text.starts_with(published))
        target.stream = text.substr(published.size());
    else if (streams && text.starts_with(shared))
        target.shared = text.substr(shared.size());
    else if (io::is_video(text) && !is_folder)
        target.video = text;
    else if (!streams && !is_folder && (extension == ".png" || extension == ".exr"))
        target.picture = text, target.folder = folder_of(text);
    else
        target.folder = text;
    if (!is_folder && target.folder == text && is_another_file(extension))
        fail(ErrorKind::invalid_argument,
             "--output {}: {} files are not written; name a folder for pictures{}, or a video .mp4, .mkv or .webm",
             text, extension, streams ? "" : ", of one frame a .png or .exr file");
    if (target.is_video()) io::require_videos();
    return target;
}

void add_video_options(CLI::App& command, std::optional<int>& crf) {
    command
        .add_option("--crf", crf,
                    "Of a video: its quality, from 0, the best, to 51 (WebM: 63). 18 where not given, of WebM 24, of "
                    "streams 23")
        ->type_name("N");
}

void check_crf(const std::optional<int>& crf, const OutputTarget& target) {
    if (!crf) return;
    if (!target.is_video())
        fail(ErrorKind::invalid_argument, "--crf is of videos: name a file .mp4, .mkv or .webm as --output");
    const int largest = io::largest_crf(target.video);
    if (*crf < 0 || *crf > largest) fail(ErrorKind::invalid_argument, "--crf {} is not from 0 to {}", *crf, largest);
}

VideoOutput::VideoOutput(const OutputTarget& target) : path_(target.video) {
    if (!target.stream.empty()) publisher_.emplace(target.stream);
}

void VideoOutput::write(const io::Pixels& pixels, double seconds, WallTime made) {
    if (!writer_)
        writer_ = publisher_ ? io::stream_video(settings_, [this](std::span<const std::byte> bytes,
                                                                  bool is_key) { publisher_->publish(bytes, is_key); })
                             : io::write_video(path_, settings_);
    writer_->write(pixels, seconds, made);
    ++pictures_;
}

void VideoOutput::finish() {
    if (writer_) writer_->finish();
    writer_.reset();
}

void VideoOutput::keep() noexcept {
    try {
        finish();
    } catch (const std::exception&) {  // The one that ended it tells more.
        writer_.reset();
    }
}

}  // namespace clarus::cli
