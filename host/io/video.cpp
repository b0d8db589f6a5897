#include "io/video.h"

#include <utility>

#include "base/error.h"
#include "base/module.h"
#include "base/output_file.h"
#include "io/video_module.h"

namespace clarus::io {
const VideoModule& video_module() {
    if (!CLARUS_VIDEO)
        fail(ErrorKind::invalid_argument,
             "this clarus was built without videos: install libavformat-dev, libavcodec-dev and libswscale-dev, and "
             "build it again, with CLARUS_VIDEO");
    static const VideoModule& module = module_function<const VideoModule&()>("clarus_video", "clarus_video")();
    return module;
}

namespace {

/// Has its name when it is finished.
class FinishedVideo : public VideoWriter {
  public:
    FinishedVideo(const std::filesystem::path& path, const VideoSettings& settings)
        : file_(path), writer_(video_module().write(path, file_.unfinished(), settings)) {}

    void write(const Pixels& pixels, double seconds, WallTime taken) override {
        writer_->write(pixels, seconds, taken);
    }
    void finish() override {
        writer_->finish();
        file_.commit();
    }

  private:
    OutputFile file_;
    std::unique_ptr<VideoWriter> writer_;
};

}  // namespace

bool is_video(const std::filesystem::path& path) {
    const std::filesystem::path extension = path.extension();
    return extension == ".mp4" || extension == ".mkv" || extension == ".webm";
}

void require_videos() { video_module(); }

int largest_crf(const std::filesystem::path& path) { return path.extension() == ".webm" ? 63 : 51; }

std::unique_ptr<VideoWriter> write_video(const std::filesystem::path& path, const VideoSettings& settings) {
    return std::make_unique<FinishedVideo>(path, settings);
}

std::unique_ptr<VideoWriter> stream_video(const VideoSettings& settings, TakeFragment take) {
    return video_module().stream(settings, std::move(take));
}

}  // namespace clarus::io
