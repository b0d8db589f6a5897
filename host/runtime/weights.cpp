#include "runtime/weights.h"

#include <algorithm>

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
                       [&](int index) { return graph.parameters[index].sets == 1; });
}

int sets_on_device(const graph::Graph& graph, const graph::Parameters& parameters) {
    const bool computes = parameters.conditioned && predicts(graph) && !is_universal(graph);
    return parameters.sets + (computes ? kComputedSets : 0);
}

/// Floats of the largest weights and of the most biases that are packed at once.
std::pair<size_t, size_t> largest_set(const graph::Graph& graph, const std::map<int, Lowered>& convolutions) {
    std::pair<size_t, size_t> largest{1, 1};
    for (const auto& [index, lowered] : convolutions) {
        const graph::Parameters& parameters = graph.parameters[index];
        largest.first = std::max(largest.first, parameters.weights_per_set());
        largest.second = std::max(largest.second, static_cast<size_t>(parameters.out_channels));
    }
    return largest;
}

}  // namespace

Weights::Weights(ocl::Context& context, const graph::Graph& graph, const std::map<int, Lowered>& convolutions)
    : context_(context) {
    ocl::checked("upload weights", [&] {
        const auto [most_weights, most_biases] = largest_set(graph, convolutions);
        weights_ = cl::Buffer(context.context(), CL_MEM_READ_WRITE, most_weights * sizeof(float));
        biases_ = cl::Buffer(context.context(), CL_MEM_READ_WRITE, most_biases * sizeof(float));

        for (const auto& [index, lowered] : convolutions) {
            const graph::Parameters& parameters = graph.parameters[index];
            Packed& packed = packed_[index];
            packed.floats = lowered.packing->floats;
            packed.conditioned = parameters.conditioned;
            packed.weights = parameters.weights_per_set();
            packed.biases = parameters.out_channels;
            packed.buffer = cl::Buffer(context.context(), CL_MEM_READ_WRITE,
                                       packed.floats * sets_on_device(graph, parameters) * sizeof(float));
            packed.pack = std::make_unique<PackLaunch>(context, lowered);
            for (int set = 0; set < parameters.sets; ++set) {
                context.queue().enqueueWriteBuffer(weights_, CL_FALSE, 0, packed.weights * sizeof(float),
                                                   parameters.weights.data() + set * packed.weights);
                context.queue().enqueueWriteBuffer(biases_, CL_FALSE, 0, packed.biases * sizeof(float),
                                                   parameters.biases.data() + set * packed.biases);
                packed.pack->enqueue(context.queue(), weights_, biases_, packed.buffer, set);
            }
        }
        context.queue().finish();
    });

    if (graph.jitter_kernels && !is_universal(graph)) {
        const graph::JitterKernels& kernels = *graph.jitter_kernels;
        predicted_ = kernels.conditioned;
        if (predicts(graph)) predictor_ = std::make_unique<KernelPredictor>(context, kernels.predictor);
        sets_.emplace(kernels.table, predictor_ ? kComputedSets : 0);
    }
}

void Weights::select(Vec2 jitter) {
    if (!sets_) return;
    const JitterSets::Selection selection = sets_->select(jitter);
    if (selection.compute) compute(jitter, selection.set);
    current_set_ = selection.set;
}

void Weights::compute(Vec2 jitter, int set) {
    const cl::Buffer& predicted = predictor_->predict(jitter);
    ocl::checked("pack predicted kernels", [&] {
        size_t position = 0;
        for (const int index : predicted_) {
            const Packed& packed = packed_.at(index);
            context_.queue().enqueueCopyBuffer(predicted, weights_, position * sizeof(float), 0,
                                               packed.weights * sizeof(float));
            position += packed.weights;
            context_.queue().enqueueCopyBuffer(predicted, biases_, position * sizeof(float), 0,
                                               packed.biases * sizeof(float));
            position += packed.biases;
            packed.pack->enqueue(context_.queue(), weights_, biases_, packed.buffer, set);
        }
    });
}

cl_uint Weights::offset(int parameters) const {
    const Packed& packed = packed_.at(parameters);
    return packed.conditioned ? static_cast<cl_uint>(packed.floats * current_set_) : 0;
}

size_t Weights::bytes(const graph::Graph& graph, const std::map<int, Lowered>& convolutions) {
    const auto [most_weights, most_biases] = largest_set(graph, convolutions);
    size_t floats = most_weights + most_biases;
    for (const auto& [index, lowered] : convolutions)
        floats += lowered.packing->floats * sets_on_device(graph, graph.parameters[index]);
    const size_t predictor =
        predicts(graph) && !is_universal(graph) ? KernelPredictor::bytes(graph.jitter_kernels->predictor) : 0;
    return floats * sizeof(float) + predictor;
}

}  // namespace clarus::runtime
