#include "cli/frame_source.h"

#include <utility>

#include "cli/frame_description.h"
#include "cli/interrupt.h"

namespace clarus::cli {

SequenceSource::SequenceSource(const io::Sequence& sequence, bool want_motion, bool want_reference, size_t ahead)
    : sequence_(sequence), reader_(sequence, 0, sequence.frames.size(), want_motion, want_reference, ahead) {}

std::optional<SourceFrame> SequenceSource::next() {
    if (Interrupt::came()) return std::nullopt;
    std::optional<io::FrameReader::Frame> read = reader_.next();
    if (!read) return std::nullopt;
    const io::FrameFiles& files = sequence_.frames[read->index];
    const auto pixels = std::make_shared<io::FramePixels>(std::move(read->pixels));
    SourceFrame frame;
    frame.name = files.name;
    frame.inputs = describe_frame(sequence_, files, *pixels);
    frame.reference = std::move(pixels->reference);
    frame.seconds = 1 / sequence_.frame_rate;
    frame.hold = pixels;
    return frame;
}

}  // namespace clarus::cli
