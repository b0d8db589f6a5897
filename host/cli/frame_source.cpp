#include "cli/frame_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cli/frame_description.h"
#include "cli/interrupt.h"
#include "io/alpha.h"

namespace clarus::cli {

namespace {

size_t colors_without_numbers(const io::Pixels& color) {
    size_t count = 0;
    for (size_t i = 0; i + 2 < color.values.size(); i += color.channels)
        count += std::isnan(color.values[i]) || std::isnan(color.values[i + 1]) || std::isnan(color.values[i + 2]);
    return count;
}

// A sky may be anywhere.
bool is_beyond_far(const io::Pixels& depth) {
    const auto beyond = std::ranges::count_if(depth.values, [](float value) { return value > 1; });
    return 2 * static_cast<size_t>(beyond) > depth.values.size();
}

}  // namespace

SequenceSource::SequenceSource(const io::Sequence& sequence, bool want_motion, bool want_reference, bool with_alpha,
                               size_t ahead)
    : sequence_(sequence),
      with_alpha_(with_alpha),
      reader_(sequence, 0, sequence.frames.size(), want_motion, want_reference, ahead) {}

std::optional<SourceFrame> SequenceSource::next() {
    if (Interrupt::came()) return std::nullopt;
    std::optional<io::FrameReader::Frame> read = reader_.next();
    if (!read) return std::nullopt;
    const io::FrameFiles& files = sequence_.frames[read->index];
    const auto pixels = std::make_shared<io::FramePixels>(std::move(read->pixels));
    SourceFrame frame;
    frame.name = files.name;
    frame.colors_without_numbers = colors_without_numbers(pixels->color);
    frame.has_alpha = !pixels->alpha.values.empty();
    if (with_alpha_) pixels->color = io::with_alpha(pixels->color, std::exchange(pixels->alpha, {}));
    frame.inputs = describe_frame(sequence_, files, *pixels);
    frame.is_depth_beyond_far = is_beyond_far(pixels->depth);
    frame.reference = std::move(pixels->reference);
    frame.seconds = 1 / sequence_.frame_rate;
    frame.hold = pixels;
    return frame;
}

}  // namespace clarus::cli
