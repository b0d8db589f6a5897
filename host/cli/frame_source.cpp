#include "cli/frame_source.h"

#include <utility>

namespace clarus::cli {

Image image_of(io::Pixels& pixels) {
    return pixels.values.empty() ? Image{} : Image{.host = pixels.values.data(), .size = pixels.size};
}

SequenceSource::SequenceSource(const io::Sequence& sequence, bool want_motion, bool want_reference, size_t ahead)
    : sequence_(sequence), reader_(sequence, 0, sequence.frames.size(), want_motion, want_reference, ahead) {}

std::optional<SourceFrame> SequenceSource::next() {
    std::optional<io::FrameReader::Frame> read = reader_.next();
    if (!read) return std::nullopt;
    const io::FrameFiles& files = sequence_.frames[read->index];
    const auto pixels = std::make_shared<io::FramePixels>(std::move(read->pixels));
    SourceFrame frame;
    frame.name = files.name;
    static_cast<FrameParameters&>(frame.inputs) = files;
    frame.inputs.render_size = sequence_.render_size_of(files);
    frame.inputs.motion_scale = sequence_.motion_scale(files);
    frame.inputs.color = image_of(pixels->color);
    frame.inputs.depth = image_of(pixels->depth);
    frame.inputs.motion = image_of(pixels->motion);
    frame.reference = std::move(pixels->reference);
    frame.hold = pixels;
    return frame;
}

}  // namespace clarus::cli
