#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clarus/interpolator.h"
#include "clarus/upscaler.h"
#include "cli/checkpoints.h"
#include "cli/frame_source.h"
#include "cli/image_folder.h"
#include "cli/shared_output.h"
#include "cli/trace.h"
#include "io/video.h"
#include "metrics/quality.h"

namespace clarus::cli {

/// What the loop leaves: pictures in a folder, a video, or frames in a stream.
struct FrameOutput {
    std::filesystem::path folder;    // empty: no pictures are written
    std::string extension;           // ".png" or ".exr"
    io::SampleType type;             // of the pictures, one that the format holds
    ColorSpace color_space;          // of the frames
    std::vector<std::string> views;  // views/<name>/<frame>.png beside the frames
    Size view_size;                  // of their pictures: that of what the model makes
    bool measure = true;             // compare with references where the sequence has them
    bool interpolated = false;       // with pictures in between
    int png_compression = 1;         // zlib's level, 0 to 9
    bool fallback = false;           // as the upscaler's option: a frame whose event fails is submitted again
    std::filesystem::path video;     // in place of the folder: a file's, empty for a stream
    io::VideoWriter* writer = nullptr;
    SharedOutput* shared = nullptr;
    bool alpha = false;  // whether the upscaler's output has it, for pictures of frames that bring it
    Checkpoints* checkpoints = nullptr;
    bool goes_on = false;             // frames were made before: a picture in between comes before the first one, too
    std::filesystem::path picture{};  // of the one frame there is, in the folder under a name of its own
    io::ColorTags tags{};             // of the pictures

    std::filesystem::path file(const std::string& frame) const {
        return writer ? video : picture.empty() ? folder / (frame + extension) : picture;
    }
    std::filesystem::path file_before(const std::string& frame) const { return file(name_before(frame)); }
    std::filesystem::path view_folder(const std::string& view) const { return folder / "views" / view; }
    std::filesystem::path view_file(const std::string& view, const std::string& frame) const {
        return view_folder(view) / (frame + ".png");
    }
};

struct FrameResult {
    std::string name;
    std::filesystem::path file;
    unsigned invalid_motion_vectors = 0;
    size_t colors_without_numbers = 0;  // pixels, of files
    bool is_depth_beyond_far = false;   // most of it, of files
    std::optional<metrics::FrameQuality> quality;
};

/// What upscales a frame. It may put buffers of its device in place of the frame's host memory.
using ChooseUpscaler = std::function<std::shared_ptr<Upscaler>(SourceFrame&)>;
/// A frame is upscaled, and written where it is to be. Called in the order of frames.
using Finished = std::function<void(FrameResult)>;

/// How many frames `upscale_frames` should have under way at once: one on the device and one with each core that
/// encodes, as far as a GiB goes.
size_t frames_under_way(const Upscaler& upscaler, const FrameOutput& output);

/// Upscales every frame of the source: the last ones are measured and written on all cores while the device works on
/// one. Existing files of the same name are replaced. Where there is an `interpolator`, it makes a picture before each
/// frame but the first. Errors: the first one in the order of frames; where a frame cannot be read, those before it are
/// written.
void upscale_frames(FrameSource& source, const ChooseUpscaler& choose, Interpolator* interpolator,
                    const FrameOutput& output, size_t under_way, Trace& trace, const Finished& finished);

}  // namespace clarus::cli
