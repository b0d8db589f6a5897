#include "io/frames.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/error.h"
#include "io/alpha.h"
#include "io/decode.h"
#include "io/described.h"
#include "io/qrisp.h"

namespace clarus::io {
namespace {

/// What an image must be.
struct Expectation {
    Size size;     // {}: any
    int channels;  // at least
    const char* role;
    int most = channels;  // that are read
    ChannelNames named = {};
};

Expectation color_of(const Sequence& sequence, const FrameFiles& frame) {
    return {sequence.render_size_of(frame), 3, "colour", 4, sequence.color_channels};
}
Expectation depth_of(const Sequence& sequence, const FrameFiles& frame) {
    const bool packed = sequence.depth_storage == DepthStorage::packed_rgba8;
    const int channels = packed ? 4 : 1;
    return {sequence.render_size_of(frame), channels, packed ? "packed depth" : "depth", channels,
            sequence.depth_channels};
}
Expectation motion_of(const Sequence& sequence, const FrameFiles& frame) {
    return {sequence.render_size_of(frame), 2, "motion", 2, sequence.motion_channels};
}
Expectation reference_of(const Sequence& sequence) { return {sequence.output_size(), 3, "the reference"}; }

Expectation optional_of(const std::string& key, const Sequence& sequence, const FrameFiles& frame) {
    if (key == "reference_depth") return {sequence.output_size(), 1, "the reference's depth"};
    if (key == "reference_motion") return {sequence.output_size(), 2, "the reference's motion"};
    if (key == "reference_aliased") return {sequence.output_size(), 3, "the aliased reference"};
    if (key == "reactive" || key == "transparency") return {sequence.render_size_of(frame), 1, "a mask"};
    if (key == "opaque_color") return {sequence.render_size_of(frame), 3, "colour without transparency"};
    return {{}, 4, "user interface"};
}

void check(const std::filesystem::path& path, const ImageHeader& image, const Expectation& expected) {
    if (expected.size != Size{} && image.size != expected.size)
        fail(ErrorKind::file, "{} has {}x{} pixels where the sequence has {}x{} for {}", path.string(),
             image.size.width, image.size.height, expected.size.width, expected.size.height, expected.role);
    if (image.channels < expected.channels)
        fail(ErrorKind::file, "{} has {} of the {} channels that {} needs", path.string(), image.channels,
             expected.channels, expected.role);
}

ImageHeader check_file(const std::filesystem::path& path, const Expectation& expected) {
    if (path.empty()) return {};
    const ImageHeader image = read_image_header(path, expected.most, expected.named);
    check(path, image, expected);
    return image;
}

Pixels read_checked(const std::filesystem::path& path, const Expectation& expected) {
    if (path.empty()) return {};
    Pixels pixels = read_image(path, expected.most, expected.named);
    check(path, {pixels.size, pixels.channels}, expected);
    return pixels;
}

Pixels read_optional(const char* key, const Sequence& sequence, const FrameFiles& files) {
    const auto file = files.optional.find(key);
    return file == files.optional.end() ? Pixels{} : read_checked(file->second, optional_of(key, sequence, files));
}

}  // namespace

ColorFiles check_sequence(const Sequence& sequence, bool needs_depth, bool needs_motion) {
    check_described(sequence, needs_depth, needs_motion);
    ColorFiles colors;
    for (const FrameFiles& frame : sequence.frames) {
        const bool lacks_depth = needs_depth && frame.depth.empty();
        if (lacks_depth || (needs_motion && frame.motion.empty()))
            fail(ErrorKind::file, "{}: frame {} has no {}, which the model needs", sequence.folder.string(), frame.name,
                 lacks_depth ? "depth" : "motion");
        const ImageHeader color = check_file(frame.color, color_of(sequence, frame));
        colors.has_alpha = colors.has_alpha || color.channels == 4;
        if (&frame == &sequence.frames.front()) colors.type = color.type, colors.tags = color.tags;
        check_file(frame.depth, depth_of(sequence, frame));
        check_file(frame.motion, motion_of(sequence, frame));
        check_file(frame.reference, reference_of(sequence));
        for (const auto& [key, path] : frame.optional) check_file(path, optional_of(key, sequence, frame));
    }
    return colors;
}

FramePixels read_frame(const Sequence& sequence, size_t index, bool want_motion, bool want_reference) {
    const FrameFiles& files = sequence.frames.at(index);
    FramePixels pixels;
    pixels.color = read_checked(files.color, color_of(sequence, files));
    pixels.alpha = take_alpha(pixels.color);
    pixels.ui = read_optional("ui", sequence, files);
    if (want_motion) {
        pixels.depth = read_checked(files.depth, depth_of(sequence, files));
        if (sequence.depth_storage == DepthStorage::packed_rgba8) pixels.depth = unpack_depth(pixels.depth);
        pixels.motion = read_checked(files.motion, motion_of(sequence, files));
        pixels.reactive_mask = read_optional("reactive", sequence, files);
        pixels.transparency_mask = read_optional("transparency", sequence, files);
        if (sequence.any_has("opaque_color")) {
            pixels.opaque_color = read_optional("opaque_color", sequence, files);
            if (pixels.opaque_color.values.empty()) pixels.opaque_color = pixels.color;
        }
    }
    if (want_reference) pixels.reference = read_checked(files.reference, reference_of(sequence));
    return pixels;
}

std::optional<GroundTruth> read_ground_truth(const Sequence& sequence, size_t index) {
    const FrameFiles& files = sequence.frames.at(index);
    GroundTruth truth{read_optional("reference_depth", sequence, files),
                      read_optional("reference_motion", sequence, files)};
    if (truth.depth.values.empty() || truth.motion.values.empty()) return std::nullopt;
    truth.depth = decode_depth(truth.depth, sequence, files);
    truth.motion = decode_motion(truth.motion, sequence, files);
    const auto [width, height] = sequence.output_size();
    const Size render = sequence.render_size_of(files);
    for (size_t i = 0; i + 1 < truth.motion.values.size(); i += 2) {
        truth.motion.values[i] *= static_cast<float>(width) / render.width;
        truth.motion.values[i + 1] *= static_cast<float>(height) / render.height;
    }
    return truth;
}

FrameReader::FrameReader(Sequence sequence, size_t first, size_t last, bool want_motion, bool want_reference,
                         size_t ahead)
    : sequence_(std::move(sequence)),
      next_(first),
      last_(std::min(last, sequence_.frames.size())),
      want_motion_(want_motion),
      want_reference_(want_reference),
      ahead_(std::max<size_t>(ahead, 1)) {
    fill();
}

void FrameReader::fill() {
    for (; next_ < last_ && pending_.size() < ahead_; ++next_)
        pending_.push_back(std::async(std::launch::async, [this, index = next_] {
            return Frame{index, read_frame(sequence_, index, want_motion_, want_reference_)};
        }));
}

std::optional<FrameReader::Frame> FrameReader::next() {
    if (pending_.empty()) return std::nullopt;
    std::future<Frame> frame = std::move(pending_.front());
    pending_.pop_front();
    fill();
    try {
        return frame.get();
    } catch (...) {
        next_ = last_;
        pending_.clear();
        throw;
    }
}

}  // namespace clarus::io
