#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

constexpr int kRows = 8;

Lowered lower(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "extremes";
    // Where a work-item makes many pixels, it makes them of several rows, which share what they read.
    const int strip = choices.at("STRIP"), rows = strip > 1 ? kRows : 1;
    call.options = fmt::format("{} -DSTRIP={} -DROWS={}",
                               image_options({{"IN", problem.inputs[0]}, {"OUT", problem.output}}), strip, rows);
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = strips(problem.output, strip, rows);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> extremes_implementations() {
    static const Implementation implementations[] = {{"extremes", obvious, strip_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
