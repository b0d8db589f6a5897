#include "cli/sequence_facts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "base/log.h"
#include "clarus/jitter.h"
#include "clarus/quality.h"
#include "pipelines/pipeline.h"

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

/// Whether jitter follows MNSS's pattern for this scale, from any place in it; anew after each cut.
bool has_mnss_jitter(const std::vector<io::FrameFiles>& frames, int scale) {
    constexpr int longest_period = 12;
    constexpr float rounding = 0.001f;  // render pixels
    const auto follows = [&](auto first, auto last, int place) {
        return std::all_of(first, last, [&](const io::FrameFiles& frame) {
            const Vec2 expected = mnss_jitter(place++, scale);
            return std::abs(frame.jitter.x - expected.x) < rounding && std::abs(frame.jitter.y - expected.y) < rounding;
        });
    };
    for (auto first = frames.begin(); first != frames.end();) {
        const auto last = std::find_if(std::next(first), frames.end(), [](const auto& frame) { return frame.reset; });
        int place = 0;
        while (place < longest_period && !follows(first, last, place)) ++place;
        if (place == longest_period) return false;
        first = last;
    }
    return true;
}

void warn_of_mip_bias(const io::Sequence& sequence, const Upscaler& upscaler, const Model& model) {
    constexpr double noticeable = 0.5;  // mip levels
    if (!sequence.is_described || !upscaler.needs_motion() || sequence.is_dynamic()) return;
    const double scale = static_cast<double>(upscaler.output_size().width) / upscaler.render_size().width;
    const double wanted = mip_bias(std::max(1.0, scale));
    if (!sequence.mip_bias) {
        log(LogLevel::warning,
            "the sequence does not say what mip bias its textures were sampled with (`mip_bias` in sequence.json), and "
            "{} wants {:.3g} here: without one they come out blurred (docs/choosing-a-model.md, \"What each wants as "
            "input\")",
            model.name(), wanted);
        return;
    }
    if (std::abs(*sequence.mip_bias - wanted) <= noticeable) return;
    log(LogLevel::warning,
        "textures were sampled with a mip bias of {:g}, and {} wants {:.3g} here: they come out {} "
        "(docs/choosing-a-model.md, \"What each wants as input\")",
        *sequence.mip_bias, model.name(), wanted, *sequence.mip_bias > wanted ? "blurred" : "aliased");
}

void warn_of_jitter(const io::Sequence& sequence, const Model& model) {
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
    else if (!pipelines::takes_jitter_out(model.pipeline()))
        log(LogLevel::warning,
            "the frames are jittered, and {} does not take jitter out: results are shifted by it. It wants frames that "
            "are rendered without",
            model.name());
    else if (model.pipeline() == "mnss" && !has_mnss_jitter(sequence.frames, static_cast<int>(model.scale())))
        log(LogLevel::warning,
            "{} wants frames with MNSS's own pattern of jitter (docs/conventions.md, \"Jitter\"; `clarus render "
            "--jitter mnss`), and these have another: results are less sharp",
            model.name());
}

}  // namespace

void warn_of_facts(const io::Sequence& sequence, const Upscaler& upscaler, const Model& model) {
    warn_of_mip_bias(sequence, upscaler, model);
    warn_of_jitter(sequence, model);
}

}  // namespace clarus::cli
