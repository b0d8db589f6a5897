#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clarus/interpolator.h"
#include "clarus/upscaler.h"
#include "cli/image_folder.h"
#include "cli/trace.h"
#include "io/sequence.h"
#include "metrics/quality.h"

namespace clarus::cli {

/// What the loop leaves in the folder.
struct FrameOutput {
    std::filesystem::path folder;
    std::string extension;           // ".png": 8 bit; ".exr": 32-bit float
    std::vector<std::string> views;  // views/<name>/<frame>.png beside the frames
    Size view_size;                  // of their pictures: that of what the model makes
    bool measure = true;             // compare with references where the sequence has them
    bool interpolated = false;       // with pictures in between
    int png_compression = 1;         // zlib's level, 0 to 9

    std::filesystem::path file(const std::string& frame) const { return folder / (frame + extension); }
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
    std::optional<metrics::FrameQuality> quality;
};

/// Upscales every frame of the sequence: the next frames are read, and the last ones measured and written, on all cores
/// while the device works on one; as many frames are under way as there are cores, but no more than a GiB holds.
/// Existing files of the same name are replaced. Where there is an `interpolator`, it makes a picture before each frame
/// but the first. Errors: the first one in the order of frames; where a frame cannot be read, those before it are
/// written.
std::vector<FrameResult> upscale_frames(const io::Sequence& sequence, Upscaler& upscaler, Interpolator* interpolator,
                                        const FrameOutput& output, Trace& trace);

}  // namespace clarus::cli
