#include "cli/sequence_facts.h"

#include <algorithm>
#include <cmath>

#include "base/log.h"
#include "io/image.h"

namespace clarus::cli {
namespace {

Vec2 largest_jitter(const io::Sequence& sequence) {
    Vec2 largest;
    for (const io::FrameFiles& frame : sequence.frames) {
        largest.x = std::max(largest.x, std::abs(frame.jitter.x));
        largest.y = std::max(largest.y, std::abs(frame.jitter.y));
    }
    return largest;
}

}  // namespace

void warn_of_facts(const io::Sequence& sequence, const Model& model) {
    const io::FrameFiles& first = sequence.frames.front();
    if (io::read_image_header(first.color).channels == 4)
        log(LogLevel::warning, "{} has a fourth channel, alpha, which is not upscaled: the results have none",
            first.color.string());

    const Vec2 jitter = largest_jitter(sequence);
    if (jitter == Vec2{}) return;
    const auto [width, height] = sequence.render_size;
    constexpr size_t enough_to_tell = 4;
    constexpr float half = 0.501f;  // of a pixel
    if (sequence.frames.size() >= enough_to_tell && jitter.x * static_cast<float>(width) <= half &&
        jitter.y * static_cast<float>(height) <= half)
        log(LogLevel::warning,
            "the largest jitter is ({:g}, {:g}): jitter is in render pixels, and this looks like shares of the image",
            jitter.x, jitter.y);
    else if (model.pipeline() == "srpo" || model.pipeline() == "stack")
        log(LogLevel::warning,
            "the frames are jittered, and {} does not take jitter out: results are shifted by it. It wants frames that "
            "are rendered without",
            model.name());
}

}  // namespace clarus::cli
