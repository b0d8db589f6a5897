#include "runtime/state_resizing.h"

#include <fmt/format.h>

#include <utility>

#include "cl/error.h"
#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

/// The pixels that are stored of a state, as an image of their own.
TensorLayout stored(const TensorLayout& state) {
    TensorLayout image = state;
    image.width /= state.samples;
    image.height /= state.samples;
    image.samples = 1;
    image.tiled = image.previous_samples = false;
    return image;
}

const TensorLayout& layout_of(const Plan& plan, size_t state) {
    return plan.layout.layouts[plan.layout.graph.states[state].previous];
}

constexpr int kStripPixels = 32, kMostStripRatio = 2;

/// By strips where these are smaller at most by their ratio along x; one program has both kernels.
KernelCall resize(const TensorLayout& state, const TensorLayout& resized, bool wants_strips) {
    const TensorLayout from = stored(state), to = stored(resized);
    KernelCall call;
    call.file = call.entry = "resize_state";
    add_images(call, {{"IN", from}, {"OUT", to}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(to);
    if (!wants_strips || !has_quads(from)) return call;
    call.options += fmt::format(" -DPIXELS={} -DMOST_RATIO={}", kStripPixels, kMostStripRatio);
    if (from.width > kMostStripRatio * to.width) return call;
    call.entry = "resize_state_strip";
    call.global = strips(to, kStripPixels, 1);
    return call;
}

size_t bytes_of_state(const Plan& plan, size_t state) {
    return plan.memory.places[layout_of(plan, state).memory].bytes;
}

}  // namespace

std::vector<KernelCall> state_resizing(const Plan& plan, const DeviceProfile& profile) {
    std::vector<KernelCall> calls;
    for (size_t state = 0; state < plan.layout.graph.states.size(); ++state)
        calls.push_back(resize(layout_of(plan, state), layout_of(plan, state), !wants_many_work_items(profile)));
    return calls;
}

StateResizing::StateResizing(ocl::Context& context, const Kernels& kernels, const Plan& largest)
    : context_(context), kernels_(kernels) {
    ocl::checked("allocate room for another size's history", [&] {
        for (size_t state = 0; state < largest.layout.graph.states.size(); ++state)
            saved_.emplace_back(context.context(), CL_MEM_READ_WRITE, bytes_of_state(largest, state));
        for (const cl::Buffer& state : saved_)
            context.queue().enqueueFillBuffer(state, cl_uchar(0), 0, state.getInfo<CL_MEM_SIZE>());
    });
}

void StateResizing::save(const Plan& plan, const Arena& arena) {
    ocl::checked("save the history", [&] {
        for (size_t state = 0; state < saved_.size(); ++state) {
            const int memory = plan.layout.layouts[plan.layout.graph.states[state].next].memory;
            // A model of any scale may make more of a smaller frame, where the largest is not the output at one scale.
            if (saved_[state].getInfo<CL_MEM_SIZE>() < bytes_of_state(plan, state))
                saved_[state] = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, bytes_of_state(plan, state));
            context_.queue().enqueueCopyBuffer(arena.memory(memory), saved_[state], 0, 0, bytes_of_state(plan, state));
        }
    });
}

void StateResizing::restore(const Plan& from, const Plan& to, const Arena& arena) {
    for (size_t state = 0; state < saved_.size(); ++state) {
        const TensorLayout &before = layout_of(from, state), &after = layout_of(to, state);
        const cl::Buffer& memory = arena.memory_next_frame(after.memory);
        if (before.width == after.width && before.height == after.height) {
            ocl::checked("restore the history", [&] {
                context_.queue().enqueueCopyBuffer(saved_[state], memory, 0, 0, bytes_of_state(to, state));
            });
            continue;
        }
        Launch launch(kernels_, resize(before, after, !wants_many_work_items(context_.profile())));
        Bindings bindings;
        bindings.inputs = {saved_[state]};
        bindings.output = memory;
        launch.bind(bindings);
        launch.enqueue(context_.queue());
    }
}

size_t StateResizing::bytes(const Plan& largest) {
    size_t bytes = 0;
    for (size_t state = 0; state < largest.layout.graph.states.size(); ++state) bytes += bytes_of_state(largest, state);
    return bytes;
}

}  // namespace clarus::runtime
