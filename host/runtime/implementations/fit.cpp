#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    const TensorLayout &in = problem.inputs[0], &out = problem.output;
    KernelCall call;
    call.file = call.entry = "fit";
    call.options = fmt::format("-DENLARGES_X={:d} -DENLARGES_Y={:d} -DMOST_TAPS={}", out.width > in.width,
                               out.height > in.height, graph::kMostFitRatio + 1);
    add_images(call, {{"IN", in}, {"OUT", out}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(out);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    return in_strips(lower_plain(problem, choices), problem, 64, 16);
}

}  // namespace

std::span<const Implementation> fit_implementations() {
    static const Implementation implementations[] = {
        {"fit strips", prefer_strips_of_quads, single_choices, lower_strips},
        {"fit", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
