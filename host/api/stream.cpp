#include "api/stream.h"

#include <cmath>
#include <utility>

#include "base/error.h"
#include "cl/context.h"

namespace clarus {

Stream::Stream(Device device, graph::Graph graph, FrameSizes sizes, double scale, UpscalerOptions options)
    : device_(std::move(device)),
      sizes_(sizes),
      scale_(scale),
      options_(std::move(options)),
      graph_(std::move(graph)),
      tuner_(device_.context(), options_.tuning) {
    check_options(options_, graph_);
    plan_with([&](const runtime::Problem& problem) { return tuner_.select_without_measuring(problem); });
}

void Stream::plan_with(const std::function<runtime::Selection(const runtime::Problem&)>& select) {
    plan_ = runtime::make_plan(graph_, options_, device_.profile(), select);
}

runtime::FrameConstants Stream::constants(const FrameDescription& frame, bool without_history) const {
    runtime::FrameConstants constants;
    constants.jitter_x = frame.jitter.x;
    constants.jitter_y = frame.jitter.y;
    if (options_.motion.sampled_at_jitter) {
        constants.motion_jitter_x = frame.jitter.x;
        constants.motion_jitter_y = frame.jitter.y;
    }
    if (options_.motion.jittered) {
        constants.jitter_change_x = previous_jitter_.x - frame.jitter.x;
        constants.jitter_change_y = previous_jitter_.y - frame.jitter.y;
    }
    constants.motion_scale_x = options_.motion.scale.x;
    constants.motion_scale_y = options_.motion.scale.y;
    if (options_.depth.projective) {
        const bool infinite = std::isinf(frame.far_plane);
        constants.depth_numerator =
            static_cast<float>(infinite ? 1e-4 : static_cast<double>(frame.near_plane) / frame.far_plane);
        constants.depth_addend = infinite ? 0.0f : constants.depth_numerator;
    }
    constants.exposure = frame.exposure;
    constants.scale = static_cast<float>(scale_);
    const int scale = static_cast<int>(std::ceil(scale_));
    constants.sample_x = sample_position(frame.jitter.x, scale);
    constants.sample_y = sample_position(frame.jitter.y, scale);
    constants.previous_sample_x = sample_position(previous_jitter_.x, scale);
    constants.previous_sample_y = sample_position(previous_jitter_.y, scale);
    constants.reset = without_history;
    return constants;
}

MemoryRequirements Stream::memory_requirements() const {
    MemoryRequirements requirements;
    requirements.weights = plan_->weight_bytes;
    requirements.arena = plan_->memory.bytes;
    requirements.peak_live_bytes = plan_->memory.peak_live_bytes;
    requirements.staging = runtime::Executor::staging_bytes(*plan_, options_);
    return requirements;
}

void Stream::prepare(const std::function<void(double)>& progress) {
    if (executor_) return;
    // Measuring takes the first half of the bar where there is any.
    const bool measures = options_.tuning == Tuning::measure;
    if (measures) {
        const double stages = static_cast<double>(plan_->stages.size());
        double measured = 0;
        plan_with([&](const runtime::Problem& problem) {
            if (progress) progress(0.5 * measured++ / stages);
            return tuner_.select(problem);
        });
    }
    const double begin = measures ? 0.5 : 0;
    executor_ = std::make_unique<runtime::Executor>(device_.context(), *plan_, options_, [&](double done) {
        if (progress) progress(begin + (1 - begin) * done);
    });
}

FrameEvent Stream::submit(const FrameDescription& frame) {
    check_frame(frame, options_, sizes_, {needs_depth(), needs_motion()}, device_.context().context()());
    prepare();
    const bool without_history = frame.reset || reset_;
    reset_ = true;  // where submit fails
    const FrameEvent event(executor_->submit(frame, constants(frame, without_history)));
    reset_ = false;
    previous_jitter_ = frame.jitter;
    return event;
}

Upscaler::View Stream::view(const std::string& name) const {
    if (!executor_ || !executor_->has_run())
        fail(ErrorKind::invalid_argument, "view \"{}\": no frame was submitted yet", name);
    const graph::Graph& graph = plan_->layout.graph;
    const auto found = graph.views.find(name);
    if (found == graph.views.end())
        fail(ErrorKind::invalid_argument, "view \"{}\" was not asked for in UpscalerOptions::views", name);
    const graph::Shape& shape = graph.shape(found->second);
    return {{shape.width, shape.height},
            shape.channels,
            executor_->read(found->second),
            graph.views_by_channel.contains(name)};
}

double Stream::largest_jitter_distance() const { return executor_ ? executor_->largest_jitter_distance() : 0; }

std::vector<StageProfile> Stream::take_profile() {
    return executor_ ? executor_->profiler().take() : std::vector<StageProfile>{};
}

}  // namespace clarus
