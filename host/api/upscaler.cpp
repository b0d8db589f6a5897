#include "clarus/upscaler.h"

#include <cmath>
#include <utility>

#include "api/build_graph.h"
#include "api/effects.h"
#include "api/frame_checks.h"
#include "base/error.h"
#include "base/log.h"
#include "cl/context.h"
#include "cl/error.h"
#include "runtime/executor.h"
#include "runtime/plan.h"
#include "runtime/tuner.h"

namespace clarus {
namespace {

// pipelines.md, "Jitter-conditioned kernels": what is farther than this from every table entry is said.
constexpr double kTrainedJitterDistance = 0.01;

}  // namespace

FrameEvent::FrameEvent(std::shared_ptr<const runtime::FrameResult> result) : result_(std::move(result)) {}

void FrameEvent::wait() const {
    ocl::checked("wait for a frame", [&] { result_->done.wait(); });
}

cl_event FrameEvent::get() const { return result_->done(); }

unsigned FrameEvent::invalid_motion_vectors() const {
    wait();
    return result_->invalid_motion_vectors;
}

struct Upscaler::State {
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    Device device;
    Model model;
    Size render_size, output_size;
    UpscalerOptions options;
    graph::Graph graph;
    runtime::Tuner tuner;
    std::unique_ptr<runtime::Plan> plan;
    std::unique_ptr<runtime::Executor> executor;
    bool reset = true;  // the next frame starts without history
    Vec2 previous_jitter;

    State(Device used_device, Model used_model, Size render, UpscalerOptions used_options)
        : device(std::move(used_device)),
          model(std::move(used_model)),
          render_size(render),
          output_size(clarus::output_size(render, model.scale())),
          options(std::move(used_options)),
          graph(with_effects(build_graph(model, render, output_size, options), options)),
          tuner(device.context(), options.tuning) {
        check_options(options, graph);
        plan_with([&](const runtime::Problem& problem) { return tuner.select_without_measuring(problem); });
    }

    /// Only now is the largest distance of the run known.
    ~State() {
        const double distance = executor ? executor->largest_jitter_distance() : 0;
        if (distance > kTrainedJitterDistance)
            log(LogLevel::warning,
                "{} has no kernels for the jitter of some frames; the nearest it has are for a jitter up to {:.3f} "
                "pixels away",
                model.name(), distance);
    }

    void plan_with(const std::function<runtime::Selection(const runtime::Problem&)>& select) {
        plan = runtime::make_plan(graph, options, device.profile(), select);
    }

    runtime::FrameConstants constants(const FrameDescription& frame, bool without_history) const {
        runtime::FrameConstants constants;
        constants.jitter_x = frame.jitter.x;
        constants.jitter_y = frame.jitter.y;
        if (options.motion.sampled_at_jitter) {
            constants.motion_jitter_x = frame.jitter.x;
            constants.motion_jitter_y = frame.jitter.y;
        }
        if (options.motion.jittered) {
            constants.jitter_change_x = previous_jitter.x - frame.jitter.x;
            constants.jitter_change_y = previous_jitter.y - frame.jitter.y;
        }
        constants.motion_scale_x = options.motion.scale.x;
        constants.motion_scale_y = options.motion.scale.y;
        if (options.depth.projective) {
            const bool infinite = std::isinf(frame.far_plane);
            constants.depth_numerator =
                static_cast<float>(infinite ? 1e-4 : static_cast<double>(frame.near_plane) / frame.far_plane);
            constants.depth_addend = infinite ? 0.0f : constants.depth_numerator;
        }
        constants.exposure = frame.exposure;
        constants.scale = static_cast<float>(model.scale());
        const int scale = static_cast<int>(std::ceil(model.scale()));
        constants.sample_x = sample_position(frame.jitter.x, scale);
        constants.sample_y = sample_position(frame.jitter.y, scale);
        constants.previous_sample_x = sample_position(previous_jitter.x, scale);
        constants.previous_sample_y = sample_position(previous_jitter.y, scale);
        constants.reset = without_history;
        return constants;
    }
};

Upscaler::Upscaler(Device device, Model model, Size render_size, UpscalerOptions options)
    : state_(std::make_unique<State>(std::move(device), std::move(model), render_size, std::move(options))) {}
Upscaler::~Upscaler() = default;
Upscaler::Upscaler(Upscaler&&) noexcept = default;
Upscaler& Upscaler::operator=(Upscaler&&) noexcept = default;

Size Upscaler::render_size() const { return state_->render_size; }
Size Upscaler::output_size() const { return state_->output_size; }

bool Upscaler::needs_depth() const { return state_->plan->ingest.depth.has_value(); }
bool Upscaler::needs_motion() const { return state_->plan->ingest.motion.has_value(); }

MemoryRequirements Upscaler::memory_requirements() const {
    MemoryRequirements requirements;
    requirements.weights = state_->plan->weight_bytes;
    requirements.arena = state_->plan->memory.bytes;
    requirements.live_at_worst = state_->plan->memory.live_at_worst;
    requirements.staging = runtime::Executor::staging_bytes(*state_->plan, state_->options);
    return requirements;
}

void Upscaler::prepare(const std::function<void(double)>& progress) {
    if (state_->executor) return;
    // Measuring takes the first half of the bar where there is any.
    const bool measures = state_->options.tuning == Tuning::measure;
    if (measures) {
        const double stages = static_cast<double>(state_->plan->stages.size());
        double measured = 0;
        state_->plan_with([&](const runtime::Problem& problem) {
            if (progress) progress(0.5 * measured++ / stages);
            return state_->tuner.select(problem);
        });
    }
    const double begin = measures ? 0.5 : 0;
    state_->executor =
        std::make_unique<runtime::Executor>(state_->device.context(), *state_->plan, state_->options, [&](double done) {
            if (progress) progress(begin + (1 - begin) * done);
        });
}

FrameEvent Upscaler::submit(const FrameDescription& frame) {
    check_frame(frame, state_->options, state_->render_size, state_->output_size, {needs_depth(), needs_motion()},
                state_->device.context().context()());
    prepare();
    const bool without_history = frame.reset || state_->reset;
    state_->reset = true;  // where submit fails
    const FrameEvent event(state_->executor->submit(frame, state_->constants(frame, without_history)));
    state_->reset = false;
    state_->previous_jitter = frame.jitter;
    return event;
}

void Upscaler::reset() { state_->reset = true; }

std::vector<std::string> Upscaler::view_names() const {
    std::vector<std::string> names;
    for (const auto& [name, value] : state_->graph.views) names.push_back(name);
    return names;
}

Upscaler::View Upscaler::view(const std::string& name) const {
    if (!state_->executor || !state_->executor->has_run())
        fail(ErrorKind::invalid_argument, "view \"{}\": no frame was submitted yet", name);
    const graph::Graph& graph = state_->plan->layout.graph;
    const auto found = graph.views.find(name);
    if (found == graph.views.end())
        fail(ErrorKind::invalid_argument, "view \"{}\" was not asked for in UpscalerOptions::views", name);
    const graph::Shape& shape = graph.shape(found->second);
    return {{shape.width, shape.height},
            shape.channels,
            state_->executor->read(found->second),
            graph.map_views.contains(name)};
}

double Upscaler::largest_jitter_distance() const {
    return state_->executor ? state_->executor->largest_jitter_distance() : 0;
}

std::vector<StageProfile> Upscaler::take_profile() {
    return state_->executor ? state_->executor->profiler().take() : std::vector<StageProfile>{};
}

}  // namespace clarus
