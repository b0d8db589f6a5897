#include "runtime/arena.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "cl/error.h"

namespace clarus::runtime {

Arena::Arena(ocl::Context& context, const Plan& plan) : context_(context) { lay_out(plan); }

void Arena::allocate(size_t bytes) {
    // Some drivers give more than they say.
    const size_t most = context_.profile().max_allocation;
    const std::string limit = bytes <= most ? "" : fmt::format(" (it says that it gives {} MiB at once)", most >> 20);
    ocl::checked(fmt::format("allocate {} MiB for intermediates{}", (bytes >> 20) + 1, limit), [&] {
        whole_ = cl::Buffer(context_.context(), CL_MEM_READ_WRITE, bytes);
        context_.queue().enqueueFillBuffer(whole_, cl_uint(0), 0, bytes / 4 * 4);
        context_.queue().finish();
    });
    bytes_ = bytes;
}

void Arena::lay_out(const Plan& plan) {
    if (plan.memory.bytes > bytes_) allocate(plan.memory.bytes);
    memories_.clear();
    ocl::checked("lay out intermediates", [&] {
        for (size_t memory = 0; memory < plan.memory.places.size(); ++memory) {
            cl::Buffer& part = memories_.emplace_back();
            if (plan.layout.memories[memory].handed_in) continue;
            const cl_buffer_region region{plan.memory.places[memory].offset, plan.memory.places[memory].bytes};
            part = whole_.createSubBuffer(CL_MEM_READ_WRITE, CL_BUFFER_CREATE_TYPE_REGION, &region);
        }
    });
    partners_.resize(memories_.size());
    for (int memory = 0; memory < static_cast<int>(memories_.size()); ++memory) partners_[memory] = memory;
    const graph::Graph& graph = plan.layout.graph;
    for (size_t state = 0; state < graph.states.size(); ++state) {
        if (!plan.memory.alternates[state]) continue;
        const int previous = plan.layout.layouts[graph.states[state].previous].memory;
        const int next = plan.layout.layouts[graph.states[state].next].memory;
        std::swap(partners_[previous], partners_[next]);
    }
    odd_frame_ = false;
}

}  // namespace clarus::runtime
