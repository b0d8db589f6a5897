#include "runtime/executor.h"

#include <CL/cl_half.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/image_format.h"
#include "cl/error.h"

namespace clarus::runtime {
namespace {

using graph::Resource;
using graph::Value;

const ImageFormat& format_of(Resource resource, const UpscalerOptions& options) {
    switch (resource) {
        case Resource::color:
            return options.color_format;
        case Resource::depth:
            return options.depth_format;
        case Resource::motion:
            break;
    }
    return options.motion_format;
}

cl_uint2 offset_and_pitch(size_t offset, size_t pitch) {
    return {{static_cast<cl_uint>(offset), static_cast<cl_uint>(pitch)}};
}

/// The parts of the ingest problem in the order of its arguments (inputs.h).
std::array<const std::optional<TensorLayout>*, 6> destinations(const IngestProblem& problem) {
    return {&problem.color, &problem.depth, &problem.motion, &problem.jitter_x, &problem.jitter_y, &problem.scale};
}

float element_at(const std::vector<std::byte>& bytes, size_t index, Storage storage) {
    if (storage == Storage::f16) return cl_half_to_float(reinterpret_cast<const cl_half*>(bytes.data())[index]);
    return reinterpret_cast<const float*>(bytes.data())[index];
}

std::vector<const KernelCall*> calls_of(const Plan& plan) {
    std::vector<const KernelCall*> calls;
    for (const PlannedStage& stage : plan.stages) {
        if (!stage.problem.presented) calls.push_back(&stage.lowered.call);
        if (stage.lowered.packing) calls.push_back(&stage.lowered.packing->call);
    }
    return calls;
}

}  // namespace

Executor::Executor(ocl::Context& context, const Plan& plan, const UpscalerOptions& options,
                   const std::function<void(double)>& progress)
    : context_(context),
      plan_(plan),
      options_(options),
      compiled_before_(context.programs_compiled()),
      ingest_(ingest(plan.ingest)),
      present_(plan.presenting < 0 ? present(plan.layout.layouts[plan.layout.graph.output], options)
                                   : plan.stages[plan.presenting].lowered.call),
      port_kernels_(context, {&ingest_, &present_}),
      kernels_(context, calls_of(plan)),
      weights_(context, kernels_, plan.layout.graph, plan.convolutions()),
      profiler_(options.profile && context.queue_has_profiling()) {
    allocate();
    const TensorLayout& output = plan.layout.layouts[plan.layout.graph.output];
    Stage& ingest_stage = add_stage(port_kernels_, ingest_, "ingest", "ingest", 0, ingest_bytes());
    for (const auto* destination : destinations(plan.ingest))
        ingest_stage.input_memories.push_back(*destination ? (*destination)->memory : -1);
    for (const PlannedStage& planned : plan.stages) {
        Stage& stage =
            add_stage(planned.problem.presented ? port_kernels_ : kernels_, planned.lowered.call,
                      planned.problem.node.name, planned.selection.describe(), planned.operations, planned.bytes);
        for (const TensorLayout& input : planned.problem.inputs) stage.input_memories.push_back(input.memory);
        stage.output_memory = planned.problem.output.memory;
        if (const auto* convolution = std::get_if<graph::Convolution>(&planned.problem.node.op))
            stage.parameters = convolution->parameters;
    }
    const double written = static_cast<double>(tight_bytes({output.width, output.height}, options.output_format));
    const double read = static_cast<double>(output.width) * output.height * output.channels * bytes_of(output.storage);
    presenting_ = plan.presenting < 0 ? stages_.size() : plan.presenting + 1;
    if (presenting_ == stages_.size())
        add_stage(port_kernels_, present_, "present", "present", 0, read + written).input_memories = {output.memory};
    upload_stage_ = profiler_.add_stage("upload", "copy", 0, 0);
    read_back_stage_ = profiler_.add_stage("read back", "copy", 0, 0);
    // Some drivers finish a kernel's compilation when it is first run.
    if (context_.programs_compiled() > compiled_before_) warm_up(progress);
    if (progress) progress(1);
}

Executor::~Executor() { clFinish(context_.queue()()); }

void Executor::warm_up(const std::function<void(double)>& progress) {
    // Resources and target are stood in for.
    ocl::checked("run every kernel once", [&] {
        const auto stand_in = [&](const std::optional<TensorLayout>& layout, const ImageFormat& format) {
            return layout ? zeroed(tight_bytes({layout->width, layout->height}, format)) : cl::Buffer();
        };
        Bindings& ingest = stages_.front().bindings;
        ingest.counter = counter_;
        ingest.resources = {stand_in(plan_.ingest.color, options_.color_format),
                            stand_in(plan_.ingest.depth, options_.depth_format),
                            stand_in(plan_.ingest.motion, options_.motion_format)};
        const TensorLayout& output = plan_.layout.layouts[plan_.layout.graph.output];
        const Size size{output.width, output.height};
        Bindings& presenting = stages_[presenting_].bindings;
        presenting.target = zeroed(tight_bytes(size, options_.output_format));
        presenting.target_offset = offset_and_pitch(0, tight_pitch(size, options_.output_format));
        FrameConstants constants;
        constants.reset = 1;
        const auto launches = static_cast<double>(plan_.launches.size()) + (plan_.presenting < 0 ? 2 : 1);
        int done = 0;
        run_stages(constants, [&] {
            if (!progress) return;
            context_.queue().finish();
            progress(++done / launches);
        });
        context_.queue().finish();
    });
    profiler_.take();
    context_.save_programs();
}

cl::Buffer Executor::zeroed(size_t bytes) const {
    const cl::Buffer buffer(context_.context(), CL_MEM_READ_WRITE, bytes);
    context_.queue().enqueueFillBuffer(buffer, cl_uchar(0), 0, bytes);
    return buffer;
}

void Executor::allocate() {
    // Some drivers give more than they say.
    const size_t most = context_.profile().max_allocation;
    const std::string limit =
        plan_.memory.bytes <= most ? "" : fmt::format(" (it says that it gives {} MiB at once)", most >> 20);
    ocl::checked(fmt::format("allocate {} MiB for intermediates{}", (plan_.memory.bytes >> 20) + 1, limit), [&] {
        arena_ = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, plan_.memory.bytes);
        context_.queue().enqueueFillBuffer(arena_, cl_uint(0), 0, plan_.memory.bytes / 4 * 4);
        for (const MemoryPlan::Place& place : plan_.memory.places) {
            const cl_buffer_region region{place.offset, place.bytes};
            memories_.push_back(arena_.createSubBuffer(CL_MEM_READ_WRITE, CL_BUFFER_CREATE_TYPE_REGION, &region));
        }
        counter_ = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, sizeof(cl_uint));
        context_.queue().finish();
    });
    partners_.resize(memories_.size());
    for (int memory = 0; memory < static_cast<int>(memories_.size()); ++memory) partners_[memory] = memory;
    for (size_t state = 0; state < plan_.layout.graph.states.size(); ++state) {
        if (!plan_.memory.alternates[state]) continue;
        const int previous = plan_.layout.layouts[plan_.layout.graph.states[state].previous].memory;
        const int next = plan_.layout.layouts[plan_.layout.graph.states[state].next].memory;
        std::swap(partners_[previous], partners_[next]);
    }
}

Executor::Stage& Executor::add_stage(const Kernels& kernels, KernelCall call, std::string name, std::string kernel,
                                     double operations, double bytes) {
    const int profile = profiler_.add_stage(std::move(name), std::move(kernel), operations, bytes);
    stages_.push_back({Launch(kernels, std::move(call)), {}, {}, -1, -1, profile});
    return stages_.back();
}

double Executor::ingest_bytes() const {
    double bytes = 0;
    for (const auto* destination : destinations(plan_.ingest)) {
        if (!*destination) continue;
        const TensorLayout& layout = **destination;
        bytes += static_cast<double>(layout.width) * layout.height * layout.channels * bytes_of(layout.storage);
    }
    const auto read = [&](const std::optional<TensorLayout>& layout, Resource resource) {
        if (layout)
            bytes += static_cast<double>(tight_bytes({layout->width, layout->height}, format_of(resource, options_)));
    };
    read(plan_.ingest.color, Resource::color);
    read(plan_.ingest.depth, Resource::depth);
    read(plan_.ingest.motion, Resource::motion);
    return bytes;
}

const cl::Buffer& Executor::memory(int index) const { return memories_[odd_frame_ ? partners_[index] : index]; }

std::shared_ptr<FrameResult> Executor::submit(const FrameDescription& frame, const FrameConstants& constants) {
    const std::shared_ptr<FrameResult> result = free_result();
    odd_frame_ = !odd_frame_;
    try {
        enqueue_frame(frame, constants, *result);
    } catch (...) {
        clFinish(context_.queue()());
        result->done = cl::Event();
        throw;
    }
    return result;
}

void Executor::enqueue_frame(const FrameDescription& frame, const FrameConstants& constants, FrameResult& result) {
    const cl::CommandQueue& queue = context_.queue();
    ocl::checked("submit a frame", [&] {
        if (!frame.wait_for.empty()) {
            const cl_int status = clEnqueueBarrierWithWaitList(queue(), static_cast<cl_uint>(frame.wait_for.size()),
                                                               frame.wait_for.data(), nullptr);
            if (status != CL_SUCCESS) throw cl::Error(status);
        }
        profiler_.begin_frame();
        weights_.select({constants.jitter_x, constants.jitter_y});
        queue.enqueueFillBuffer(counter_, cl_uint(0), 0, sizeof(cl_uint));

        Bindings& ingest = stages_.front().bindings;
        ingest.counter = counter_;
        bind_input(Resource::color, frame.color, plan_.ingest.color);
        bind_input(Resource::depth, frame.depth, plan_.ingest.depth);
        bind_input(Resource::motion, frame.motion, plan_.ingest.motion);
        const bool host_output = bind_target(frame.output);
        run_stages(constants);
        if (host_output) read_back(frame.output);
        queue.enqueueReadBuffer(counter_, CL_FALSE, 0, sizeof(cl_uint), &result.invalid_motion_vectors);
        queue.enqueueMarkerWithWaitList(nullptr, &result.done);
        queue.flush();
    });
}

void Executor::bind_input(Resource resource, const Image& image, const std::optional<TensorLayout>& layout) {
    if (!layout) return;
    const Size size{layout->width, layout->height};
    const ImageFormat& format = format_of(resource, options_);
    const size_t tight = tight_pitch(size, format);
    const size_t pitch = row_pitch(image, format);
    const int index = static_cast<int>(resource);
    Bindings& ingest = stages_.front().bindings;
    if (image.buffer) {
        ingest.resources[index] = cl::Buffer(image.buffer, true);
        ingest.resource_offsets[index] = offset_and_pitch(image.offset, pitch);
        return;
    }
    cl::Buffer& staging = staging_[index];
    if (!staging()) staging = cl::Buffer(context_.context(), CL_MEM_READ_ONLY, tight_bytes(size, format));
    const size_t rows = size.height;
    context_.queue().enqueueWriteBufferRect(staging, CL_FALSE, {0, 0, 0}, {0, 0, 0}, {tight, rows, 1}, tight, 0, pitch,
                                            0, image.host, nullptr, profiler_.event(upload_stage_));
    ingest.resources[index] = staging;
    ingest.resource_offsets[index] = offset_and_pitch(0, tight);
}

bool Executor::bind_target(const Image& image) {
    const TensorLayout& output = plan_.layout.layouts[plan_.layout.graph.output];
    const Size size{output.width, output.height};
    const size_t tight = tight_pitch(size, options_.output_format);
    Bindings& present = stages_[presenting_].bindings;
    if (image.buffer) {
        present.target = cl::Buffer(image.buffer, true);
        present.target_offset = offset_and_pitch(image.offset, row_pitch(image, options_.output_format));
        return false;
    }
    if (!staging_output_())
        staging_output_ = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, tight_bytes(size, options_.output_format));
    present.target = staging_output_;
    present.target_offset = offset_and_pitch(0, tight);
    return true;
}

void Executor::run_stages(const FrameConstants& constants, const std::function<void()>& after_each) {
    for (Stage& stage : stages_) bind(stage, constants);
    const auto launch = [&](Stage& stage) {
        stage.launch.enqueue(context_.queue(), profiler_.event(stage.profile));
        if (after_each) after_each();
    };
    launch(stages_.front());
    for (const auto& [index, first, end] : plan_.launches) {
        Stage& stage = stages_[index + 1];
        if (end == 0) {
            launch(stage);
            continue;
        }
        stage.launch.enqueue_rows(context_.queue(), first, end, profiler_.event(stage.profile));
        if (after_each) after_each();
    }
    if (plan_.presenting < 0) launch(stages_.back());
}

void Executor::bind(Stage& stage, const FrameConstants& constants) {
    Bindings& bindings = stage.bindings;
    bindings.frame = constants;
    bindings.inputs.resize(stage.input_memories.size());
    for (size_t input = 0; input < stage.input_memories.size(); ++input)
        if (stage.input_memories[input] >= 0) bindings.inputs[input] = memory(stage.input_memories[input]);
    if (stage.output_memory >= 0) bindings.output = memory(stage.output_memory);
    if (stage.parameters >= 0) {
        bindings.packed_weights = weights_.packed(stage.parameters);
        bindings.packed_offset = weights_.offset(stage.parameters);
    }
    stage.launch.bind(bindings);
}

void Executor::read_back(const Image& image) {
    const TensorLayout& output = plan_.layout.layouts[plan_.layout.graph.output];
    const size_t tight = tight_pitch({output.width, output.height}, options_.output_format);
    const size_t rows = output.height;
    context_.queue().enqueueReadBufferRect(staging_output_, CL_FALSE, {0, 0, 0}, {0, 0, 0}, {tight, rows, 1}, tight, 0,
                                           row_pitch(image, options_.output_format), 0, image.host, nullptr,
                                           profiler_.event(read_back_stage_));
}

std::shared_ptr<FrameResult> Executor::free_result() {
    for (const auto& result : results_) {
        if (result.use_count() > 1) continue;
        // Its frame may still be on its way, and then it is going to write to it.
        if (!result->done() || result->done.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() == CL_COMPLETE) return result;
    }
    results_.push_back(std::make_shared<FrameResult>());
    return results_.back();
}

std::vector<float> Executor::read(Value value) const {
    const TensorLayout& layout = plan_.layout.layouts[value];
    std::vector<std::byte> bytes(plan_.memory.places[layout.memory].bytes);
    ocl::checked("read a view", [&] {
        context_.queue().enqueueReadBuffer(memory(layout.memory), CL_TRUE, 0, bytes.size(), bytes.data());
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

size_t Executor::staging_bytes(const Plan& plan, const UpscalerOptions& options) {
    const auto bytes = [](const std::optional<TensorLayout>& layout, const ImageFormat& format) {
        return layout ? tight_bytes({layout->width, layout->height}, format) : 0;
    };
    const TensorLayout& output = plan.layout.layouts[plan.layout.graph.output];
    return bytes(plan.ingest.color, options.color_format) + bytes(plan.ingest.depth, options.depth_format) +
           bytes(plan.ingest.motion, options.motion_format) +
           tight_bytes({output.width, output.height}, options.output_format) + sizeof(cl_uint);
}

}  // namespace clarus::runtime
