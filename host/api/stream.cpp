#include "api/stream.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/kept_placement.h"
#include "api/stage_costs.h"
#include "base/error.h"
#include "base/hash.h"
#include "base/log.h"
#include "cl/context.h"
#include "graph/passes.h"
#include "runtime/placement.h"

namespace clarus {
namespace {

constexpr std::string_view kMeasuredPlacement = "auto";

// The fastest devices take a second for so many, two cores of a CPU a quarter of an hour: a mistake, or an attack,
// rather than a network in real time.
constexpr double kMostOperations = 1e14;

// Of the way that automatic exposure has to go, after a sixtieth of a second.
constexpr double kExposureKept = 0.9;

// Of a step between convolutions, of which each channel is compiled: 1024 times tanh take PoCL 3.1 16 s.
constexpr int kMostChannels = 1024;

/// Whether what one of these devices hands to another is copied.
std::function<bool(int, int)> copies_between(const std::vector<std::shared_ptr<ocl::Context>>& contexts) {
    return [&contexts](int from, int to) { return !contexts[from]->shares_memory_with(*contexts[to]); };
}

void check_work(const graph::Graph& graph, Size render) {
    double all = 0;
    for (const graph::Node& node : graph.nodes)
        if (std::holds_alternative<graph::Pointwise>(node.op) && node.shape.channels > kMostChannels)
            fail(ErrorKind::invalid_argument,
                 "the network has {} channels between two convolutions; more than {} are not compiled",
                 node.shape.channels, kMostChannels);
    for (const graph::Node& node : graph.nodes) all += graph::operations(graph, node);
    if (!(all <= kMostOperations))
        fail(ErrorKind::invalid_argument,
             "render size {}x{}: the network takes {:.1e} operations a frame, more than the {:.0e} that are allowed; a "
             "smaller size or network is needed",
             render.width, render.height, all, kMostOperations);
}

/// Of parameters that only plans of other sizes use, as they are in the model; packed, they take as much or a little
/// more.
size_t bytes_of_other_sizes(const runtime::Plan& plan) {
    const std::map<int, runtime::Lowered> used = plan.convolutions();
    const auto& parameters = plan.layout.graph.parameters;
    size_t floats = 0;
    for (int index = 0; index < static_cast<int>(parameters.size()); ++index)
        if (!used.contains(index)) floats += parameters[index]->weights.size() + parameters[index]->biases.size();
    return floats * sizeof(float);
}

}  // namespace

Stream::Stream(Device device, Build build, Size render, runtime::PlanOptions options, std::vector<Size> others)
    : device_(std::move(device)),
      build_(std::move(build)),
      options_(std::move(options)),
      others_(std::move(others)),
      largest_(build_(render)) {
    check_options(options_, largest_.graph);
    check_work(largest_.graph, render);
    sizes_ = largest_.sizes;
    scale_ = largest_.scale;
    const std::vector<DeviceProfile> devices = device_.profiles();
    lost_.resize(devices.size());
    if (devices.size() == 1) {
        if (options_.fallback)
            fail(ErrorKind::invalid_argument, "options.fallback: is for several devices, and there is one");
        if (options_.placement != kMeasuredPlacement)
            fail(ErrorKind::invalid_argument, "options.placement: '{}' is for several devices, and there is one",
                 options_.placement);
        part_out(largest_.graph, std::vector<int>(largest_.graph.nodes.size(), 0));
        return;
    }
    if (options_.dynamic_resolution)
        fail(ErrorKind::invalid_argument, "options.dynamic_resolution: of one device alone, and there are {}",
             devices.size());
    if (runtime::computes_exposure(options_))
        fail(ErrorKind::invalid_argument, "options.{}: of one device alone, and there are {}",
             options_.automatic_exposure ? "automatic_exposure" : "exposure_format", devices.size());
    options_.precision = runtime::common_precision(options_.precision, devices);
    const graph::Graph fused = graph::fuse(largest_.graph, options_.views);
    const bool measures = options_.placement == kMeasuredPlacement;
    part_out(fused, runtime::place_by_rules(fused, measures ? "" : options_.placement, devices));
}

bool Stream::ingests(std::optional<runtime::TensorLayout> runtime::IngestProblem::*resource) const {
    return std::any_of(parts_.begin(), parts_.end(),
                       [&](const Part& part) { return (part.plan->ingest.*resource).has_value(); });
}

bool Stream::needs_depth() const { return ingests(&runtime::IngestProblem::depth); }
bool Stream::needs_motion() const { return ingests(&runtime::IngestProblem::motion); }

std::string Stream::name_of(int device) const {
    const DeviceProfile& profile = device_.contexts()[device]->profile();
    if (device_.contexts().size() == 1) return profile.name;
    return fmt::format("device {}, {} ({})", device, profile.selector, profile.name);
}

std::vector<runtime::PartPlan> Stream::part_plans() const {
    std::vector<runtime::PartPlan> plans;
    for (const Part& part : parts_) plans.push_back({part.context.get(), part.plan.get(), name_of(part.device)});
    return plans;
}

void Stream::part_out(const graph::Graph& fused, const std::vector<int>& places,
                      const std::vector<std::vector<double>>& seconds) {
    graph::Partition partition = graph::partition(fused, places, copies_between(device_.contexts()));
    std::vector<double> of_parts(partition.parts.size());
    if (!seconds.empty()) of_parts = runtime::seconds_of_parts(fused, places, partition, seconds);
    seconds_alone_.clear();
    for (int device = 0; device < static_cast<int>(seconds.size()); ++device) {
        const std::vector<int> alone(fused.nodes.size(), device);
        const graph::Partition whole = graph::partition(fused, alone);
        seconds_alone_.push_back(runtime::seconds_of_parts(fused, alone, whole, seconds).front());
    }
    std::vector<Part> parts;
    std::vector<bool> has_queue(device_.contexts().size(), false);
    for (graph::Part& each : partition.parts) {
        const std::shared_ptr<ocl::Context>& own = device_.contexts()[each.place];
        Part& part = parts.emplace_back();
        // A queue is in order, and so would be several streams that share it: a frame that waits for another device
        // would hold up the others'. A caller's own is taken, once: there frames are ordered with what else is in it.
        const bool takes_callers = own->queue_is_callers() && !has_queue[each.place];
        part.context = takes_callers ? own : own->with_another_queue();
        part.device = each.place;
        part.graph = std::move(each.graph);
        part.seconds = of_parts[parts.size() - 1];
        part.tuner = std::make_unique<runtime::Tuner>(*part.context, options_.tuning);
        plan_part(part, [&](const runtime::Problem& problem) { return part.tuner->select_without_measuring(problem); });
        has_queue[each.place] = true;
    }
    parts_ = std::move(parts);
    links_ = std::move(partition.links);
    places_ = places;
    take_memory_requirements();
}

void Stream::place_by_measuring(const std::function<void(double)>& progress) {
    const std::vector<std::shared_ptr<ocl::Context>>& contexts = device_.contexts();
    const graph::Graph fused = graph::fuse(largest_.graph, options_.views);
    const KeptPlacement kept(fused, device_.profiles(), copies_between(contexts), options_);
    if (options_.tuning != Tuning::measure) {
        const KeptPlacement::Choice choice = kept.find();
        if (!choice.places.empty()) return part_out(fused, choice.places, choice.seconds);
    }
    runtime::PlacementCosts costs;
    for (const auto& context : contexts) {
        costs.seconds.push_back(measure_nodes(*context, fused, options_, sizes_, constants({}, false)));
        if (progress) progress(static_cast<double>(costs.seconds.size()) / static_cast<double>(contexts.size()));
    }
    std::vector<std::vector<TransferTime>> times(contexts.size(), std::vector<TransferTime>(contexts.size()));
    for (size_t from = 0; from < contexts.size(); ++from)
        for (size_t to = 0; to < contexts.size(); ++to)
            if (from != to) times[from][to] = measure_transfer(*contexts[from], *contexts[to]);
    if (options_.precision == Precision::fp16) costs.bytes_of_a_float = 2;
    costs.copied = copies_between(contexts);
    costs.transfer = [&](int from, int to, double bytes) {
        return times[from][to].start + times[from][to].a_byte * bytes;
    };
    const KeptPlacement::Choice choice{runtime::place_for_speed(fused, costs), costs.seconds};
    kept.keep(choice);
    part_out(fused, choice.places, choice.seconds);
}

std::vector<PlacedPart> Stream::placement() const {
    std::vector<PlacedPart> result;
    if (device_.contexts().size() == 1) return result;
    for (size_t index = 0; index < parts_.size(); ++index) {
        const runtime::Plan& plan = *parts_[index].plan;
        PlacedPart part;
        part.device = parts_[index].device;
        part.seconds = parts_[index].seconds;
        for (const runtime::PlannedStage& stage : plan.stages)
            if (!runtime::only_moves(stage)) part.stages.push_back(stage.problem.node.name);
        for (const graph::Link& link : links_) {
            if (link.to != static_cast<int>(index)) continue;
            const runtime::TensorLayout* const layout = plan.imports()[link.to_port];
            if (!layout) continue;
            const runtime::Plan& maker = *parts_[link.from].plan;
            const size_t bytes = maker.memory.places[maker.exports()[link.from_port]->memory].bytes;  // all is copied
            const graph::Graph& from = maker.layout.graph;
            part.inputs.push_back({link.from, from.nodes[from.exports[link.from_port]].name, link.frames_ago, bytes});
            if (parts_[link.from].device != part.device) part.bytes_in += bytes;
        }
        result.push_back(std::move(part));
    }
    return result;
}

void Stream::plan_part(Part& part, const Select& select) const {
    part.plan = runtime::make_plan(part.graph, options_, part.context->profile(), select);
}

void Stream::take_memory_requirements() {
    memory_ = {};
    for (const Part& part : parts_) {
        const runtime::Plan& plan = *part.plan;
        memory_ += {plan.weight_bytes + (options_.dynamic_resolution ? bytes_of_other_sizes(plan) : 0),
                    plan.memory.bytes, plan.memory.peak_live_bytes,
                    runtime::Executor::staging_bytes(plan, options_.dynamic_resolution, options_)};
    }
    memory_.arena += runtime::Program::link_bytes(part_plans(), links_);
}

std::unique_ptr<runtime::Plan> Stream::plan_like(runtime::KeptChoices& choices, const graph::Graph& graph) const {
    const auto select = [&](const runtime::Problem& problem) {
        const std::optional<runtime::Selection> kept = choices.find(problem);
        return kept ? *kept : parts_.front().tuner->select_without_measuring(problem);
    };
    std::unique_ptr<runtime::Plan> plan =
        runtime::make_plan(graph, options_, device_.profile(), select, choices.bands());
    choices.add(*plan);
    return plan;
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

std::vector<std::unique_ptr<runtime::Plan>> Stream::other_plans() {
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
        program_->executor(0).change_plan(*next, keeps_history);
    } catch (...) {
        program_.reset();  // its memory is neither the old plan's nor the new one's
        parts_.front().plan = plan_like(*choices_, largest_.graph);
        sizes_ = largest_.sizes;
        scale_ = largest_.scale;
        throw;
    }
    parts_.front().plan = std::move(next);
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
    if (options_.motion_size) {
        constants.motion_step_x = static_cast<float>(options_.motion_size->width) / sizes_.render.width;
        constants.motion_step_y = static_cast<float>(options_.motion_size->height) / sizes_.render.height;
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
    constants.exposure_share = static_cast<float>(1 - std::pow(kExposureKept, 60 * frame.frame_seconds));
    return constants;
}

void Stream::prepare(const std::function<void(double)>& progress) {
    if (program_) return;
    double begin = 0;
    // Measuring, of what there is left, takes the first half of the bar.
    const auto half = [&](double done) {
        if (progress) progress(begin + (1 - begin) / 2 * done);
    };
    const bool lost = std::find(lost_.begin(), lost_.end(), true) != lost_.end();
    if (device_.contexts().size() > 1 && options_.placement == kMeasuredPlacement && !lost) {
        place_by_measuring(half);
        begin = 0.5;
    }
    const bool measures = options_.tuning == Tuning::measure;
    if (measures) {
        double stages = 0, measured = 0;
        for (const Part& part : parts_) stages += static_cast<double>(part.plan->stages.size());
        for (Part& part : parts_)
            plan_part(part, [&](const runtime::Problem& problem) {
                half(measured++ / stages);
                return part.tuner->select(problem);
            });
        take_memory_requirements();
        begin = (1 + begin) / 2;
    }
    if (has_one_part()) choices_.emplace(plan(), device_.profile());
    const std::vector<std::unique_ptr<runtime::Plan>> others = other_plans();
    program_ =
        std::make_unique<runtime::Program>(device_.context(), part_plans(), links_, others, options_, [&](double done) {
            if (progress) progress(begin + (1 - begin) * done);
        });
}

cl_context Stream::context_of_images() const {
    return device_.is_one_context() ? device_.context().context()() : nullptr;
}

FrameEvent Stream::submit(const FrameDescription& frame) {
    const Size render = frame.render_size == Size{} ? largest_.sizes.render : frame.render_size;
    std::optional<SizedGraph> other;
    if (render != sizes_.render) other = built(render);
    check_frame(frame, options_, other ? other->sizes : sizes_,
                {needs_depth(), needs_motion(), ingests(&runtime::IngestProblem::opaque_color)}, context_of_images());
    leave_failed_device();
    prepare();
    bool without_history = frame.reset || reset_;
    reset_ = true;  // where submit fails
    if (other) change_size(*other, !without_history);
    for (;;) {
        try {
            const FrameEvent event(program_->submit(frame, constants(frame, without_history)));
            reset_ = false;
            previous_jitter_ = frame.jitter;
            return event;
        } catch (const Error& error) {
            if (!leave_failed_device(error.what())) throw;
            prepare();
            without_history = true;
        }
    }
}

std::string Stream::computed_by() const {
    std::string devices, kernels;
    for (const Part& part : parts_) {
        const DeviceProfile& profile = part.context->profile();
        devices += fmt::format("{}{} (driver {})", devices.empty() ? "" : ", ", profile.name, profile.driver_version);
        for (const runtime::PlannedStage& stage : part.plan->stages)
            kernels += fmt::format("{}: {}; ", stage.problem.node.name, stage.selection.describe());
    }
    return fmt::format("{} with the kernels {}", devices, hexadecimal(hash_of(kernels)));
}

History Stream::history() const {
    History history;
    if (reset_ || !program_) return history;
    history.starts_anew = false;
    history.render_size = sizes_.render;
    history.jitter = previous_jitter_;
    history.computed_by = computed_by();
    history.values = program_->read_kept();
    return history;
}

void Stream::restore(const History& history) {
    prepare();
    reset_ = true;  // where it fails
    if (history.starts_anew) return;
    if (history.render_size != sizes_.render && !options_.dynamic_resolution)
        fail(ErrorKind::invalid_argument, "history: its last frame was {}x{}, and frames are {}x{} here",
             history.render_size.width, history.render_size.height, sizes_.render.width, sizes_.render.height);
    if (history.render_size != sizes_.render) change_size(built(history.render_size), false);
    program_->write_kept(history.values);
    if (history.computed_by != computed_by())
        log(LogLevel::warning,
            "history was computed by {}, and goes on by {}: frames may differ in their last bits from those of one run",
            history.computed_by, computed_by());
    previous_jitter_ = history.jitter;
    reset_ = false;
}

bool Stream::leave_failed_device(std::string_view why) {
    const std::optional<int> part = options_.fallback && program_ ? program_->failed_part() : std::nullopt;
    if (!part) return false;
    const int device = parts_[*part].device;
    std::vector<bool> lost = lost_;
    lost[device] = true;
    const auto next = std::find(lost.begin(), lost.end(), false);
    if (next == lost.end()) return false;
    lost_ = std::move(lost);
    const auto heir = static_cast<int>(next - lost_.begin());
    log(LogLevel::warning, "{}. Its stages go on on {}, without history",
        why.empty() ? name_of(device) + " failed" : std::string(why), name_of(heir));
    std::vector<int> places = places_;
    std::replace(places.begin(), places.end(), device, heir);
    program_.reset();
    part_out(graph::fuse(largest_.graph, options_.views), places);
    reset_ = true;
    return true;
}

Upscaler::View Stream::view(const std::string& name) const {
    if (!program_ || !program_->has_run())
        fail(ErrorKind::invalid_argument, "view \"{}\": no frame was submitted yet", name);
    for (size_t part = 0; part < parts_.size(); ++part) {
        const graph::Graph& graph = parts_[part].plan->layout.graph;
        const auto found = graph.views.find(name);
        if (found == graph.views.end()) continue;
        const graph::Shape& shape = graph.shape(found->second);
        return {{shape.width, shape.height},
                shape.channels,
                program_->executor(static_cast<int>(part)).read(found->second),
                graph.views_by_channel.contains(name)};
    }
    fail(ErrorKind::invalid_argument, "view \"{}\" was not asked for in UpscalerOptions::views", name);
}

double Stream::largest_jitter_distance() const { return program_ ? program_->largest_jitter_distance() : 0; }

std::vector<StageProfile> Stream::take_profile() {
    std::vector<StageProfile> profiles;
    if (!program_) return profiles;
    const auto add = [&](std::vector<StageProfile> stages, int device) {
        for (StageProfile& stage : stages) {
            stage.device = device;
            profiles.push_back(std::move(stage));
        }
    };
    for (size_t part = 0; part < parts_.size(); ++part)
        add(program_->take_profile(static_cast<int>(part)), parts_[part].device);
    add(program_->take_transfers_profile(), -1);
    return profiles;
}

}  // namespace clarus
