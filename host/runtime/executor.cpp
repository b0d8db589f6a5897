#include "runtime/executor.h"

#include <CL/cl_half.h>
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "cl/error.h"
#include "runtime/inputs.h"

namespace clarus::runtime {
namespace {

using graph::Value;

constexpr size_t kExposureBytes = 2 * sizeof(cl_float);

float element_at(const std::vector<std::byte>& bytes, size_t index, Storage storage) {
    if (storage == Storage::u8) throw std::logic_error("what is handed on as bytes is no view");
    if (storage == Storage::f16) return cl_half_to_float(reinterpret_cast<const cl_half*>(bytes.data())[index]);
    return reinterpret_cast<const float*>(bytes.data())[index];
}

using Plans = std::span<const std::unique_ptr<Plan>>;

std::vector<KernelCall> resizing_calls(const Plan& plan, Plans others, const DeviceProfile& profile) {
    return others.empty() ? std::vector<KernelCall>() : state_resizing(plan, profile);
}

void add_calls(std::vector<const KernelCall*>& calls, const Plan& plan) {
    for (const PlannedStage& stage : plan.stages) {
        if (!stage.problem.presented) calls.push_back(&stage.lowered.call);
        if (stage.lowered.packing && !stage.lowered.packing->on_host) calls.push_back(&stage.lowered.packing->call);
    }
}

std::vector<const KernelCall*> calls_of(const Plan& plan, Plans others, const std::vector<KernelCall>& resizing) {
    std::vector<const KernelCall*> calls;
    add_calls(calls, plan);
    for (const auto& other : others) add_calls(calls, *other);
    for (const KernelCall& call : resizing) calls.push_back(&call);
    return calls;
}

/// Whether some stage of `other` runs a kernel that none of `plan` does.
bool adds_kernels(const Plan& other, const Plan& plan) {
    std::set<std::string> known;
    for (const PlannedStage& stage : plan.stages)
        known.insert(program_key(stage.lowered.call) + stage.lowered.call.entry);
    return (other.presenting < 0) != (plan.presenting < 0) ||
           std::any_of(other.stages.begin(), other.stages.end(), [&](const PlannedStage& stage) {
               return !known.contains(program_key(stage.lowered.call) + stage.lowered.call.entry);
           });
}

KernelCall present_call(const Plan& plan, const StreamOptions& options) {
    if (plan.presenting >= 0) return plan.stages[plan.presenting].lowered.call;
    return present(plan.layout.layouts[plan.layout.graph.output], options);
}

/// Adds what reads and writes the caller's formats.
void add_port_kernels(Kernels& kernels, ocl::Context& context, const Plan& plan, const StreamOptions& options) {
    std::vector<KernelCall> calls;
    if (plan.ingests() && computes_exposure(options)) calls.push_back(exposure(plan.ingest));
    if (plan.ingests()) calls.push_back(ingest(plan.ingest));
    if (plan.presents()) calls.push_back(present_call(plan, options));
    std::vector<const KernelCall*> added;
    for (const KernelCall& call : calls) added.push_back(&call);
    kernels.add(context, added);
}

Kernels port_kernels(ocl::Context& context, const Plan& plan, Plans others, const StreamOptions& options) {
    Kernels kernels(context, {});
    add_port_kernels(kernels, context, plan, options);
    for (const auto& other : others) add_port_kernels(kernels, context, *other, options);
    return kernels;
}

}  // namespace

Executor::Executor(ocl::Context& context, const Plan& plan, std::span<const std::unique_ptr<Plan>> others,
                   const StreamOptions& options, const HandedIn& handed_in, const std::function<void(double)>& progress)
    : context_(context),
      plan_(&plan),
      options_(options),
      compiled_before_(context.programs_compiled()),
      port_kernels_(port_kernels(context, plan, others, options)),
      kernels_(context, calls_of(plan, others, resizing_calls(plan, others, context.profile()))),
      weights_(context, kernels_, plan.layout.graph, plan.convolutions()),
      profiler_(options.profile && context.queue_has_profiling()),
      arena_(context, plan),
      ports_(context, plan, options, profiler_) {
    for (const auto& other : others) weights_.add(kernels_, other->layout.graph, other->convolutions());
    if (!others.empty()) resizing_.emplace(context, kernels_, plan);
    ocl::checked("allocate a counter", [&] {
        counter_ = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, sizeof(cl_uint));
        if (computes_exposure(options))
            exposure_value_ = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, kExposureBytes);
    });
    hand_in(handed_in);
    make_stages();
    // Some drivers finish a kernel's compilation when it is first run.
    if (context_.programs_compiled() > compiled_before_) warm_up(others, progress);
    if (progress) progress(1);
}

Executor::~Executor() { clFinish(context_.queue()()); }

void Executor::hand_in(const HandedIn& handed_in) {
    const auto hand_in = [&](const std::vector<const TensorLayout*>& layouts, const std::vector<cl::Buffer>& buffers) {
        for (size_t port = 0; port < layouts.size(); ++port)
            if (layouts[port]) arena_.hand_in(layouts[port]->memory, buffers[port]);
    };
    hand_in(plan_->imports(), handed_in.imports);
    hand_in(plan_->exports(), handed_in.exports);
}

void Executor::make_stages() {
    exposure_.reset();
    ingest_.reset();
    stages_.clear();
    present_.reset();
    profiler_.begin_stages();
    if (plan_->ingests()) {
        if (computes_exposure(options_))
            exposure_ = make_stage(port_kernels_, exposure(plan_->ingest), "exposure", "exposure", 0,
                                   exposure_bytes(*plan_, options_));
        ingest_ =
            make_stage(port_kernels_, ingest(plan_->ingest), "ingest", "ingest", 0, ingest_bytes(*plan_, options_));
        for (const auto* destination : destinations(plan_->ingest))
            ingest_->input_memories.push_back(*destination ? (*destination)->memory : -1);
    }
    for (const PlannedStage& planned : plan_->stages) {
        Stage& stage = stages_.emplace_back(make_stage(
            planned.problem.presented ? port_kernels_ : kernels_, planned.lowered.call, planned.problem.node.name,
            planned.selection.describe(), planned.problem.operations, planned.problem.bytes));
        for (const TensorLayout& input : planned.problem.inputs) stage.input_memories.push_back(input.memory);
        stage.output_memory = planned.problem.output.memory;
        if (const auto* convolution = std::get_if<graph::Convolution>(&planned.problem.node.op))
            stage.parameters = convolution->parameters;
    }
    if (plan_->presents() && plan_->presenting < 0) {
        present_ = make_stage(port_kernels_, present_call(*plan_, options_), "present", "present", 0,
                              present_bytes(*plan_, options_));
        present_->input_memories = {plan_->layout.layouts[plan_->layout.graph.output].memory};
    }
    ports_.add_stages();
    for (std::optional<Stage>* stage : {&exposure_, &ingest_, &present_})
        if (*stage) (*stage)->bindings.exposure = exposure_value_;
}

Executor::Stage Executor::make_stage(const Kernels& kernels, KernelCall call, std::string name, std::string kernel,
                                     double operations, double bytes) {
    const int profile = profiler_.add_stage(std::move(name), std::move(kernel), operations, bytes);
    return {Launch(kernels, std::move(call)), {}, {}, -1, -1, profile};
}

Executor::Stage* Executor::presenting() {
    if (plan_->presenting >= 0) return &stages_[plan_->presenting];
    return present_ ? &*present_ : nullptr;
}

void Executor::change_plan(const Plan& plan, bool keeps_states) {
    keeps_states = keeps_states && resizing_ && has_states_;
    if (keeps_states) resizing_->save(*plan_, arena_);
    const int compiled = context_.programs_compiled();
    std::vector<const KernelCall*> calls;
    add_calls(calls, plan);
    kernels_.add(context_, calls);
    add_port_kernels(port_kernels_, context_, plan, options_);
    if (context_.programs_compiled() > compiled) context_.save_programs();
    weights_.add(kernels_, plan.layout.graph, plan.convolutions());
    arena_.lay_out(plan);
    if (keeps_states) resizing_->restore(*plan_, plan, arena_);
    plan_ = &plan;
    make_stages();
}

size_t Executor::staging_bytes(const Plan& plan, bool resizes, const StreamOptions& options) {
    return Ports::bytes(plan, options) + sizeof(cl_uint) + (computes_exposure(options) ? kExposureBytes : 0) +
           (resizes ? StateResizing::bytes(plan) : 0);
}

void Executor::warm_up(std::span<const std::unique_ptr<Plan>> others, const std::function<void(double)>& progress) {
    ocl::checked("run every kernel once", [&] {
        const auto launches = static_cast<double>(plan_->launches.size()) + exposure_.has_value() +
                              ingest_.has_value() + present_.has_value();
        int done = 0;
        run_unseen([&] {
            if (!progress) return;
            context_.queue().finish();
            progress(std::min(1.0, ++done / launches));
        });
        const Plan& largest = *plan_;
        for (const auto& other : others) {
            if (!adds_kernels(*other, largest)) continue;
            change_plan(*other, false);
            run_unseen({});
        }
        if (plan_ != &largest) change_plan(largest, false);
        if (resizing_) resizing_->restore(*plan_, *plan_, arena_);
        context_.queue().finish();
    });
    profiler_.take();
    context_.save_programs();
}

/// A frame that nobody sees.
void Executor::run_unseen(const std::function<void()>& after_each) {
    if (ingest_) {
        ingest_->bindings.counter = counter_;
        ports_.stand_in_inputs(*plan_, ingest_->bindings);
    }
    if (exposure_) {
        ports_.stand_in_exposure(exposure_->bindings);
        exposure_->bindings.resources = ingest_->bindings.resources;
    }
    if (Stage* const stage = presenting()) ports_.stand_in_output(*plan_, stage->bindings);
    FrameConstants constants;
    constants.reset = 1;
    run_stages(constants, after_each);
    context_.queue().finish();  // before what was stood in goes
}

std::shared_ptr<FrameResult> Executor::submit(const FrameDescription& frame, const FrameConstants& constants,
                                              std::span<const cl_event> wait_for) {
    const std::shared_ptr<FrameResult> result = ocl::checked("submit a frame", [&] { return free_result(); });
    arena_.next_frame();
    has_states_ = true;
    try {
        enqueue_frame(frame, constants, wait_for, *result);
    } catch (...) {
        clFinish(context_.queue()());
        result->done = cl::Event();
        throw;
    }
    return result;
}

void Executor::enqueue_frame(const FrameDescription& frame, const FrameConstants& constants,
                             std::span<const cl_event> wait_for, FrameResult& result) {
    const cl::CommandQueue& queue = context_.queue();
    ocl::checked("submit a frame", [&] {
        if (!wait_for.empty()) {
            const cl_int status =
                clEnqueueBarrierWithWaitList(queue(), static_cast<cl_uint>(wait_for.size()), wait_for.data(), nullptr);
            if (status != CL_SUCCESS) throw cl::Error(status);
        }
        profiler_.begin_frame();
        weights_.select({constants.jitter_x, constants.jitter_y});
        queue.enqueueFillBuffer(counter_, cl_uint(0), 0, sizeof(cl_uint));
        if (ingest_) {
            ingest_->bindings.counter = counter_;
            ports_.bind_inputs(frame, plan_->ingest, ingest_->bindings);
        }
        if (exposure_) {
            if (options_.exposure_format) ports_.bind_exposure(frame.exposure_image, exposure_->bindings);
            exposure_->bindings.resources = ingest_->bindings.resources;
            exposure_->bindings.resource_offsets = ingest_->bindings.resource_offsets;
        }
        Stage* const presents = presenting();
        if (presents) ports_.bind_output(frame.output, presents->bindings);
        run_stages(constants);
        if (presents) ports_.hand_back(frame.output);
        queue.enqueueReadBuffer(counter_, CL_FALSE, 0, sizeof(cl_uint), &result.invalid_motion_vectors);
        queue.enqueueMarkerWithWaitList(nullptr, &result.done);
        queue.flush();
    });
}

void Executor::run_stages(const FrameConstants& constants, const std::function<void()>& after_each) {
    if (exposure_) bind(*exposure_, constants);
    if (ingest_) bind(*ingest_, constants);
    for (Stage& stage : stages_) bind(stage, constants);
    if (present_) bind(*present_, constants);
    const auto launch = [&](Stage& stage) {
        stage.launch.enqueue(context_.queue(), profiler_.event(stage.profile));
        if (after_each) after_each();
    };
    if (exposure_) launch(*exposure_);
    if (ingest_) launch(*ingest_);
    for (const auto& [index, first, end] : plan_->launches) {
        Stage& stage = stages_[index];
        if (end == 0) {
            launch(stage);
            continue;
        }
        stage.launch.enqueue_rows(context_.queue(), first, end, profiler_.event(stage.profile));
        if (after_each) after_each();
    }
    if (present_) launch(*present_);
}

void Executor::bind(Stage& stage, const FrameConstants& constants) {
    Bindings& bindings = stage.bindings;
    bindings.frame = constants;
    bindings.inputs.resize(stage.input_memories.size());
    for (size_t input = 0; input < stage.input_memories.size(); ++input)
        if (stage.input_memories[input] >= 0) bindings.inputs[input] = arena_.memory(stage.input_memories[input]);
    if (stage.output_memory >= 0) bindings.output = arena_.memory(stage.output_memory);
    if (stage.parameters >= 0) {
        bindings.packed_weights = weights_.packed(stage.parameters);
        bindings.packed_offset = weights_.offset(stage.parameters);
    }
    stage.launch.bind(bindings);
}

std::vector<KeptMemory> Executor::kept() const {
    std::vector<KeptMemory> kept;
    const graph::Graph& graph = plan_->layout.graph;
    for (size_t state = 0; state < graph.states.size(); ++state) {
        const TensorLayout& layout = plan_->layout.layouts[graph.states[state].next];
        kept.push_back({fmt::format("state {}, {}", state, graph.nodes[graph.states[state].previous].name), layout,
                        &context_, arena_.memory(layout.memory), plan_->memory.places[layout.memory].bytes});
    }
    if (exposure_ && options_.automatic_exposure) {
        TensorLayout layout;
        layout.width = 2;
        layout.height = layout.channels = layout.stride = 1;
        kept.push_back({"exposure", layout, &context_, exposure_value_, kExposureBytes});
    }
    return kept;
}

std::shared_ptr<FrameResult> Executor::free_result() {
    for (const auto& result : results_) {
        if (result.use_count() > 1) continue;
        // Its frame may still be on its way, and then it is going to write to it.
        if (!result->done() || result->done.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() <= CL_COMPLETE) return result;
    }
    results_.push_back(std::make_shared<FrameResult>());
    return results_.back();
}

std::vector<float> Executor::read(Value value) const {
    const TensorLayout& layout = plan_->layout.layouts[value];
    std::vector<std::byte> bytes(plan_->memory.places[layout.memory].bytes);
    ocl::checked("read a view", [&] {
        context_.queue().enqueueReadBuffer(arena_.memory(layout.memory), CL_TRUE, 0, bytes.size(), bytes.data());
    });
    std::vector<float> pixels;
    pixels.reserve(static_cast<size_t>(layout.width) * layout.height * layout.channels);
    const int block = layout.block;
    for (int y = 0; y < layout.height; ++y)
        for (int x = 0; x < layout.width; ++x)
            for (int channel = 0; channel < layout.channels; ++channel) {
                const size_t cell =
                    static_cast<size_t>(y / block) * layout.row() + static_cast<size_t>(x / block) * layout.stride;
                const size_t within = layout.offset + channel * block * block + y % block * block + x % block;
                pixels.push_back(element_at(bytes, cell + within, layout.storage));
            }
    return pixels;
}

}  // namespace clarus::runtime
