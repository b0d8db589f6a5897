#include <fmt/format.h>

#include "bench/suite.h"
#include "cl/context.h"
#include "cl/event.h"
#include "runtime/launch.h"
#include "runtime/tuner.h"

namespace clarus::bench {
namespace {

using namespace clarus::runtime;

constexpr Size kSize{960, 540};

cl::Buffer filled(ocl::Context& context, size_t bytes) {
    const cl::Buffer buffer(context.context(), CL_MEM_READ_WRITE, bytes);
    context.queue().enqueueFillBuffer(buffer, cl_float(0.01f), 0, bytes / sizeof(cl_float) * sizeof(cl_float));
    return buffer;
}

Work work(const Device& device, const Problem& problem, const Selection& selection, int channels) {
    ocl::Context& context = device.context();
    const Lowered lowered = selection.lower(problem);
    Bindings bindings;
    bindings.inputs = {filled(context, memory_bytes(problem.inputs[0]))};
    bindings.output = filled(context, memory_bytes(problem.output));
    bindings.packed_weights = filled(context, lowered.packing->floats * sizeof(float));
    auto launch = std::make_shared<Launch>(Kernels(context, {&lowered.call}), lowered.call);
    launch->bind(bindings);
    return {fmt::format("{0}→{0} {1}", channels, selection.describe()),
            2.0 * 9 * channels * channels * kSize.width * kSize.height, 0, [&context, launch, bindings] {
                cl::Event event;
                launch->enqueue(context.queue(), &event);
                return ocl::seconds_of(event);
            }};
}

}  // namespace

std::vector<Work> convolution_items(const Device& device) {
    std::vector<Work> items;
    for (const int channels : {16, 32, 64}) {
        const TensorLayout layout{0, Storage::f32, kSize.width, kSize.height, channels, 1, channels, 0};
        const graph::Parameters parameters{channels, channels};
        Problem problem;
        problem.node.op = graph::Convolution{0, graph::Activation::relu};
        problem.node.shape = {channels, kSize.height, kSize.width};
        problem.inputs = {layout};
        problem.output = layout;
        problem.parameters = &parameters;
        for (const Implementation& implementation : implementations(problem.node)) {
            // The obvious one is there to be right.
            if (implementation.preference(problem, device.profile()) <= 1) continue;
            const Selection selection{&implementation, implementation.choices(problem, device.profile()).front()};
            items.push_back(work(device, problem, selection, channels));
        }
    }
    return items;
}

}  // namespace clarus::bench
