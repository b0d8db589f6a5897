#include "clarus/interpolator.h"

#include <optional>
#include <utility>

#include "api/build_graph.h"
#include "api/effects.h"
#include "api/history.h"
#include "api/stream.h"
#include "base/error.h"

namespace clarus {
namespace {

// Of the way from a frame to the one before it.
constexpr float kMiddle = 0.5f;
constexpr const char* kIdentity = "an interpolator";  // in saved history

double scale_of(Size render, Size output) {
    output_size(render, 1);
    output_size(output, 1);
    if (output.width < render.width || output.height < render.height)
        fail(ErrorKind::invalid_argument, "output size {}x{} is smaller than the render size {}x{}", output.width,
             output.height, render.width, render.height);
    const std::optional<double> scale = common_scale(render, output);
    if (!scale)
        fail(ErrorKind::invalid_argument, "output size {}x{} is not the render size {}x{} times one scale",
             output.width, output.height, render.width, render.height);
    if (static_cast<long long>(render.width) * render.height >= graph::kNoSource)
        fail(ErrorKind::invalid_argument, "render size {}x{}: frames are interpolated of less than {} pixels",
             render.width, render.height, graph::kNoSource);
    return *scale;
}

SizedGraph build(Size render, Size output, const InterpolatorOptions& options) {
    const double scale = scale_of(render, output);
    graph::Graph graph;
    const graph::Value color = graph.input(graph::Resource::color, output);
    const graph::Value depth = graph.input(graph::Resource::depth, render);
    const graph::Value motion = graph.input(graph::Resource::motion, render);
    const graph::Value previous = graph.previous({3, output.height, output.width}, "previous");
    graph.carry(previous, color);
    const graph::Value landed = graph.landed_depth(motion, depth, kMiddle);
    const graph::Value source = graph.landed_source(motion, depth, landed, kMiddle);
    graph.output = graph.between(graph.middle_motion(motion, depth, source), color, previous, scale);
    return {with_ui(graph, options), {.color = output, .render = render, .output = output}, scale};
}

}  // namespace

struct Interpolator::State {
    State(Device device, Size render, Size output, const InterpolatorOptions& options)
        : stream(std::move(device), [output, options](Size of) { return build(of, output, options); }, render,
                 {options, 0, {}}) {}
    Stream stream;
};

Interpolator::Interpolator(Device device, Size render_size, Size output_size, InterpolatorOptions options) {
    state_ = std::make_unique<State>(std::move(device), render_size, output_size, options);
}
Interpolator::~Interpolator() = default;
Interpolator::Interpolator(Interpolator&&) noexcept = default;
Interpolator& Interpolator::operator=(Interpolator&&) noexcept = default;

Size Interpolator::render_size() const { return state_->stream.sizes().render; }
Size Interpolator::output_size() const { return state_->stream.sizes().output; }
Size Interpolator::output_size(Size render_size) const { return state_->stream.sizes(render_size).output; }

MemoryRequirements Interpolator::memory_requirements() const { return state_->stream.memory_requirements(); }

void Interpolator::prepare(const std::function<void(double)>& progress) { state_->stream.prepare(progress); }

FrameEvent Interpolator::submit(const FrameDescription& frame) { return state_->stream.submit(frame); }

void Interpolator::reset() { state_->stream.reset(); }

std::vector<std::byte> Interpolator::save_history() const { return bytes_of(state_->stream.history(), kIdentity); }

void Interpolator::restore_history(std::span<const std::byte> history) {
    state_->stream.reset();
    state_->stream.restore(history_of(history, kIdentity));
}

std::vector<StageProfile> Interpolator::take_profile() { return state_->stream.take_profile(); }

}  // namespace clarus
