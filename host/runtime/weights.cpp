#include "runtime/weights.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "cl/error.h"

namespace clarus::runtime {
namespace {

// Enough for a Halton sequence of 32 beside a table's; a set of ENSS-L takes half a megabyte.
constexpr int kComputedSets = 32;

bool predicts(const graph::Graph& graph) { return graph.jitter_kernels && !graph.jitter_kernels->predictor.empty(); }

/// A table of one entry serves every jitter, even beside a predictor.
bool is_universal(const graph::Graph& graph) {
    if (!graph.jitter_kernels) return true;
    const auto& conditioned = graph.jitter_kernels->conditioned;
    return std::all_of(conditioned.begin(), conditioned.end(),
                       [&](int index) { return graph.parameters[index]->sets == 1; });
}

int sets_on_device(const graph::Graph& graph, const graph::Parameters& parameters) {
    const bool computes = parameters.conditioned && predicts(graph) && !is_universal(graph);
    return parameters.sets + (computes ? kComputedSets : 0);
}

cl::Buffer upload(ocl::Context& context, const std::vector<float>& values) {
    const size_t bytes = std::max<size_t>(values.size(), 1) * sizeof(float);
    cl::Buffer buffer(context.context(), CL_MEM_READ_ONLY, bytes);
    if (!values.empty())
        context.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, values.size() * sizeof(float), values.data());
    return buffer;
}

}  // namespace

Weights::Weights(ocl::Context& context, const Kernels& kernels, const graph::Graph& graph,
                 const std::map<int, Lowered>& convolutions)
    : context_(context) {
    add(kernels, graph, convolutions);
    if (graph.jitter_kernels && !is_universal(graph)) {
        const graph::JitterKernels& jitter_kernels = *graph.jitter_kernels;
        for (const int index : jitter_kernels.conditioned) {
            const graph::Parameters& parameters = *graph.parameters[index];
            predicted_.push_back({index, parameters.weights_per_set(), static_cast<size_t>(parameters.out_channels)});
        }
        if (predicts(graph)) predictor_ = std::make_unique<KernelPredictor>(context, jitter_kernels.predictor);
        sets_.emplace(jitter_kernels.table, predictor_ ? kComputedSets : 0);
    }
}

void Weights::add(const Kernels& kernels, const graph::Graph& graph, const std::map<int, Lowered>& convolutions) {
    ocl::checked("upload weights", [&] {
        bool waits = false;
        for (const auto& [index, lowered] : convolutions) {
            if (const auto known = packed_.find(index); known != packed_.end()) {
                if (known->second.floats != lowered.packing->floats)
                    throw std::logic_error("the same weights are packed in two ways");
                continue;
            }
            pack(kernels, graph, index, *lowered.packing);
            waits = true;
        }
        if (waits) context_.queue().finish();
    });
}

void Weights::pack(const Kernels& kernels, const graph::Graph& graph, int index, const Packing& packing) {
    const graph::Parameters& parameters = *graph.parameters[index];
    Packed packed;
    packed.floats = packing.floats;
    packed.conditioned = parameters.conditioned;
    packed.buffer = cl::Buffer(context_.context(), CL_MEM_READ_WRITE,
                               packed.floats * sets_on_device(graph, parameters) * sizeof(float));
    if (packing.on_host) {
        upload_packed(parameters, packing, packed.buffer);
    } else {
        packed.pack = std::make_unique<PackLaunch>(kernels, packing);
        const size_t weights_a_set = parameters.weights_per_set(), biases_a_set = parameters.out_channels;
        const cl::Buffer weights = upload(context_, parameters.weights), biases = upload(context_, parameters.biases);
        for (int set = 0; set < parameters.sets; ++set)
            packed.pack->enqueue(context_.queue(), {weights, set * weights_a_set, biases, set * biases_a_set},
                                 packed.buffer, set);
    }
    packed_.emplace(index, std::move(packed));
}

void Weights::upload_packed(const graph::Parameters& parameters, const Packing& packing, const cl::Buffer& buffer) {
    for (int set = 0; set < parameters.sets; ++set) {
        const std::vector<std::int32_t> packed = packing.on_host(parameters, set);
        const size_t bytes = packed.size() * sizeof packed.front();
        context_.queue().enqueueWriteBuffer(buffer, CL_TRUE, set * bytes, bytes, packed.data());
    }
}

void Weights::select(Vec2 jitter) {
    if (!sets_) return;
    const JitterSets::Selection selection = sets_->select(jitter);
    if (selection.compute) {
        try {
            compute(jitter, selection.set);
        } catch (...) {
            sets_->forget(selection.set);
            throw;
        }
    }
    current_set_ = selection.set;
}

void Weights::compute(Vec2 jitter, int set) {
    const cl::Buffer& predicted = predictor_->predict(jitter);
    size_t position = 0;
    for (const auto& [index, weight_count, bias_count] : predicted_) {
        const size_t biases = position + weight_count;
        if (const auto packed = packed_.find(index); packed != packed_.end())
            packed->second.pack->enqueue(context_.queue(), {predicted, position, predicted, biases},
                                         packed->second.buffer, set);
        position = biases + bias_count;
    }
}

cl_uint Weights::offset(int parameters) const {
    const Packed& packed = packed_.at(parameters);
    return packed.conditioned ? static_cast<cl_uint>(packed.floats * current_set_) : 0;
}

size_t Weights::bytes(const graph::Graph& graph, const std::map<int, Lowered>& convolutions) {
    size_t floats = 0;
    for (const auto& [index, lowered] : convolutions)
        floats += lowered.packing->floats * sets_on_device(graph, *graph.parameters[index]);
    const size_t predictor =
        predicts(graph) && !is_universal(graph) ? KernelPredictor::bytes(graph.jitter_kernels->predictor) : 0;
    return floats * sizeof(float) + predictor;
}

}  // namespace clarus::runtime
