#include "api/stream.h"

#include <cmath>
#include <utility>

#include "base/error.h"
#include "cl/context.h"

namespace clarus {

Stream::Stream(Device device, Build build, Size render, runtime::PlanOptions options, std::vector<Size> others)
    : device_(std::move(device)),
      build_(std::move(build)),
      options_(std::move(options)),
      others_(std::move(others)),
      largest_(build_(render)),
      tuner_(device_.context(), options_.tuning) {
    check_options(options_, largest_.graph);
    begin_with(
        plan_of_largest([&](const runtime::Problem& problem) { return tuner_.select_without_measuring(problem); }));
}

void Stream::begin_with(std::unique_ptr<runtime::Plan> plan_of_largest) {
    plan_ = std::move(plan_of_largest);
    sizes_ = largest_.sizes;
    scale_ = largest_.scale;
    memory_.weights = plan_->weight_bytes;
    memory_.arena = plan_->memory.bytes;
    memory_.peak_live_bytes = plan_->memory.peak_live_bytes;
    memory_.staging = runtime::Executor::staging_bytes(*plan_, options_.dynamic_resolution, options_);
}

std::unique_ptr<runtime::Plan> Stream::plan_of_largest(const Select& select) const {
    return runtime::make_plan(largest_.graph, options_, device_.profile(), select);
}

std::unique_ptr<runtime::Plan> Stream::plan_like(const runtime::KeptChoices& choices, const graph::Graph& graph) const {
    const auto select = [&](const runtime::Problem& problem) {
        const std::optional<runtime::Selection> kept = choices.find(problem);
        return kept ? *kept : tuner_.select_without_measuring(problem);
    };
    return runtime::make_plan(graph, options_, device_.profile(), select, choices.bands());
}

SizedGraph Stream::built(Size render) const {
    const Size most = largest_.sizes.render;
    if (render != most && !options_.dynamic_resolution)
        fail(ErrorKind::invalid_argument,
             "frame.render_size: {}x{}, and frames are {}x{} unless options.dynamic_resolution is set", render.width,
             render.height, most.width, most.height);
    if (render.width < 1 || render.height < 1 || render.width > most.width || render.height > most.height)
        fail(ErrorKind::invalid_argument, "frame.render_size: {}x{}; must be from 1x1 to {}x{}", render.width,
             render.height, most.width, most.height);
    return build_(render);
}

FrameSizes Stream::sizes(Size render) const { return built(render).sizes; }

std::vector<std::unique_ptr<runtime::Plan>> Stream::other_plans() const {
    std::vector<std::unique_ptr<runtime::Plan>> plans;
    if (!options_.dynamic_resolution) return plans;
    const Size most = largest_.sizes.render;
    std::vector<Size> sizes{{(most.width + 1) / 2, (most.height + 1) / 2}};
    sizes.insert(sizes.end(), others_.begin(), others_.end());
    for (const Size size : sizes) {
        if (size.width < 1 || size.height < 1 || size.width > most.width || size.height > most.height) continue;
        try {
            plans.push_back(plan_like(*choices_, build_(size).graph));
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::invalid_argument) throw;  // too small for the output
        }
    }
    if (plans.empty()) plans.push_back(plan_like(*choices_, largest_.graph));
    return plans;
}

void Stream::change_size(const SizedGraph& sized, bool keeps_history) {
    std::unique_ptr<runtime::Plan> next = plan_like(*choices_, sized.graph);
    try {
        executor_->change_plan(*next, keeps_history);
    } catch (...) {
        executor_.reset();  // its memory is neither the old plan's nor the new one's
        begin_with(plan_like(*choices_, largest_.graph));
        throw;
    }
    plan_ = std::move(next);
    const auto rescaled = [](float jitter, int to, int from) { return jitter * static_cast<float>(to) / from; };
    const Size to = sized.sizes.render, from = sizes_.render;
    previous_jitter_ = {rescaled(previous_jitter_.x, to.width, from.width),
                        rescaled(previous_jitter_.y, to.height, from.height)};
    sizes_ = sized.sizes;
    scale_ = sized.scale;
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
    const Vec2 motion_scale = frame.motion_scale.value_or(options_.motion.scale);
    constants.motion_scale_x = motion_scale.x;
    constants.motion_scale_y = motion_scale.y;
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

void Stream::prepare(const std::function<void(double)>& progress) {
    if (executor_) return;
    // Measuring takes the first half of the bar where there is any.
    const bool measures = options_.tuning == Tuning::measure;
    if (measures) {
        const double stages = static_cast<double>(plan_->stages.size());
        double measured = 0;
        begin_with(plan_of_largest([&](const runtime::Problem& problem) {
            if (progress) progress(0.5 * measured++ / stages);
            return tuner_.select(problem);
        }));
    }
    choices_.emplace(*plan_, device_.profile());
    const std::vector<std::unique_ptr<runtime::Plan>> others = other_plans();
    const double begin = measures ? 0.5 : 0;
    executor_ = std::make_unique<runtime::Executor>(device_.context(), *plan_, others, options_, [&](double done) {
        if (progress) progress(begin + (1 - begin) * done);
    });
}

FrameEvent Stream::submit(const FrameDescription& frame) {
    const Size render = frame.render_size == Size{} ? largest_.sizes.render : frame.render_size;
    std::optional<SizedGraph> other;
    if (render != sizes_.render) other = built(render);
    check_frame(frame, options_, other ? other->sizes : sizes_, {needs_depth(), needs_motion()},
                device_.context().context()());
    prepare();
    const bool without_history = frame.reset || reset_;
    reset_ = true;  // where submit fails
    if (other) change_size(*other, !without_history);
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
