#include "clarus/upscaler.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "api/build_graph.h"
#include "api/diagnosis.h"
#include "api/effects.h"
#include "api/history.h"
#include "api/masks.h"
#include "api/model_identity.h"
#include "api/stream.h"
#include "base/error.h"
#include "base/log.h"
#include "cl/error.h"
#include "cl/event.h"
#include "pipelines/pipeline.h"
#include "runtime/program.h"

namespace clarus {
namespace {

// docs/pipelines.md, "Jitter-conditioned kernels": what is farther than this from every table entry is said.
constexpr double kTrainedJitterDistance = 0.01;

/// Just larger than what a scale makes the output size of: the first render size of which a model of any scale makes
/// just that, and the first of which it does not.
std::vector<Size> sizes_below(double scale, const Model& model, Size output) {
    std::vector<Size> sizes;
    for (const bool exact : {true, false})
        for (int width = static_cast<int>(output.width / scale) + 1; width < output.width; ++width) {
            const auto height =
                static_cast<int>(std::lround(static_cast<double>(width) * output.height / output.width));
            const ModelSizes made = model_sizes(model, {width, std::max(height, 1)}, output);
            if (!(made.scale < scale) || (made.own == output) != exact) continue;
            sizes.push_back({width, std::max(height, 1)});
            break;
        }
    return sizes;
}

/// Render sizes where a model's graph has other nodes: of which it makes the output size by its own scale, its largest
/// or its smallest one, or a little less along one axis or both, for there the result is shown as it is, or resampled
/// by other kernels than where it is larger; and at its pipeline's turning points and a little below them.
std::vector<Size> sizes_around(const Model& model, const std::optional<Size>& output) {
    if (!output) return {};
    const auto size = [&](double scale) {
        return Size{static_cast<int>(std::lround(output->width / scale)),
                    static_cast<int>(std::lround(output->height / scale))};
    };
    std::vector<Size> sizes;
    for (const double scale : std::set{model.scale(), model.scales().smallest, model.scales().largest}) {
        if (std::isinf(scale)) continue;
        const auto [width, height] = size(scale);
        sizes.insert(sizes.end(), {{width, height}, {width - 1, height - 1}, {width - 1, height}, {width, height - 1}});
    }
    for (const double scale : pipelines::turning_points(model.pipeline())) {
        sizes.push_back(size(scale));
        const std::vector<Size> below = sizes_below(scale, model, *output);
        sizes.insert(sizes.end(), below.begin(), below.end());
    }
    return sizes;
}

runtime::PlanOptions plan_options(const UpscalerOptions& options) {
    if (!(options.sharpen >= 0 && options.sharpen <= 1))
        fail(ErrorKind::invalid_argument, "options.sharpen: {}; must be from 0 to 1", options.sharpen);
    if (options.alpha && options.color_format.channels < 4)
        fail(ErrorKind::invalid_argument, "options.alpha: color_format has {} channels; alpha is the fourth",
             options.color_format.channels);
    if (options.alpha && options.output_format.channels != 4)
        fail(ErrorKind::invalid_argument, "options.alpha: output_format has {} channels; with alpha it has 4",
             options.output_format.channels);
    return {options, options.band_rows, options.views};
}

}  // namespace

FrameEvent::FrameEvent(std::shared_ptr<const runtime::FrameResult> result) : result_(std::move(result)) {}

void FrameEvent::wait() const {
    std::optional<Error> error;
    try {
        ocl::checked("wait for a frame", [&] { result_->done.wait(); });
    } catch (const Error& caught) {
        error = caught;
    }
    // What waits for a part that fails does not fail with every driver.
    const std::optional<runtime::FrameFailure> failure = runtime::failure_of(*result_);
    if (!failure && error) throw *error;
    if (!failure) return;
    const std::string& device = result_->parts.empty() ? result_->device : result_->parts[failure->part]->device;
    fail(ErrorKind::device,
         "{}: the device was lost, or its driver gave up, in the middle of a frame ({}). Open it anew, or take another "
         "device (`clarus devices`)",
         device, ocl::status_name(failure->status));
}

bool FrameEvent::wait_for(std::chrono::duration<double> longest) const {
    const cl_event done = get();
    if (!ocl::wait_at_most({&done, 1}, longest)) return false;
    wait();
    return true;
}

cl_event FrameEvent::get() const { return result_->done(); }

unsigned FrameEvent::invalid_motion_vectors() const {
    wait();
    unsigned vectors = result_->invalid_motion_vectors;
    for (const auto& part : result_->parts) vectors = std::max(vectors, part->invalid_motion_vectors);
    return vectors;
}

struct Upscaler::State {
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    Model model;
    Stream stream;
    std::optional<Diagnosis> diagnosis;

    State(Device device, Model used_model, Size render_size, const UpscalerOptions& options)
        : model(std::move(used_model)),
          stream(
              std::move(device), [this, options](Size render) { return build(render, options); }, render_size,
              plan_options(options), sizes_around(model, options.output_size)) {
        if (options.diagnose && stream.needs_motion())
            diagnosis.emplace(options, render_size,
                              static_cast<double>(stream.sizes().output.width) / render_size.width,
                              stream.needs_depth());
    }

    SizedGraph build(Size render, const UpscalerOptions& options) const {
        const auto [scale, own] = model_sizes(model, render, options.output_size);
        const Size output = shown_size(own, options.output_size);
        const graph::Graph graph = build_graph(model, render, own, options.pipeline_options, scale);
        graph::Graph shown = with_effects(with_masks(graph, scale, options), output, options);
        if (options.alpha)
            shown = with_alpha(shown, {render, scale, own, pipelines::takes_jitter_out(model.pipeline())});
        return {with_ui(shown, options), {.color = render, .render = render, .output = output}, scale};
    }

    /// Only now is the largest distance of the run known.
    ~State() {
        const double distance = stream.largest_jitter_distance();
        if (distance > kTrainedJitterDistance)
            log(LogLevel::warning,
                "{} has no kernels for the jitter of some frames; the nearest it has are for a jitter up to {:.3f} "
                "pixels away",
                model.name(), distance);
    }
};

Upscaler::Upscaler(Device device, Model model, Size render_size, UpscalerOptions options) {
    state_ = std::make_unique<State>(std::move(device), std::move(model), render_size, options);
}
Upscaler::~Upscaler() = default;
Upscaler::Upscaler(Upscaler&&) noexcept = default;
Upscaler& Upscaler::operator=(Upscaler&&) noexcept = default;

Size Upscaler::render_size() const { return state_->stream.sizes().render; }
Size Upscaler::output_size() const { return state_->stream.sizes().output; }
Size Upscaler::output_size(Size render_size) const { return state_->stream.sizes(render_size).output; }

bool Upscaler::needs_depth() const { return state_->stream.needs_depth(); }
bool Upscaler::needs_motion() const { return state_->stream.needs_motion(); }

MemoryRequirements Upscaler::memory_requirements() const { return state_->stream.memory_requirements(); }

void Upscaler::prepare(const std::function<void(double)>& progress) { state_->stream.prepare(progress); }

FrameEvent Upscaler::submit(const FrameDescription& frame) {
    try {
        FrameEvent event = state_->stream.submit(frame);
        if (state_->diagnosis) state_->diagnosis->add(frame, state_->stream.context());
        return event;
    } catch (...) {
        if (state_->diagnosis) state_->diagnosis->cut();
        throw;
    }
}

void Upscaler::reset() {
    state_->stream.reset();
    if (state_->diagnosis) state_->diagnosis->cut();
}

bool Upscaler::keeps_history() const { return state_->stream.keeps_history(); }

std::vector<std::byte> Upscaler::save_history() const {
    return bytes_of(state_->stream.history(), identity_of(state_->model));
}

void Upscaler::restore_history(std::span<const std::byte> history) {
    reset();
    state_->stream.restore(history_of(history, identity_of(state_->model)));
}

std::vector<std::string> Upscaler::view_names() const {
    std::vector<std::string> names;
    for (const auto& [name, value] : state_->stream.graph().views) names.push_back(name);
    return names;
}

Upscaler::View Upscaler::view(const std::string& name) const { return state_->stream.view(name); }

double Upscaler::largest_jitter_distance() const { return state_->stream.largest_jitter_distance(); }

std::vector<PlacedPart> Upscaler::placement() const { return state_->stream.placement(); }

std::vector<double> Upscaler::seconds_alone() const { return state_->stream.seconds_alone(); }

std::vector<StageProfile> Upscaler::take_profile() { return state_->stream.take_profile(); }

}  // namespace clarus
