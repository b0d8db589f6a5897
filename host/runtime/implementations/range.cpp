#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_range(const Problem& problem, const Choices& choices) {
    // Where a work-item makes many pixels, it makes them of several rows, which share what they read.
    constexpr int kRows = 8;
    const int strip = choices.at("STRIP"), rows = strip > 1 ? kRows : 1;
    KernelCall call;
    call.file = call.entry = "range";
    call.options =
        fmt::format("-DSCALE={} -DSTRIP={} -DROWS={}", std::get<graph::Range>(problem.node.op).scale, strip, rows);
    add_images(call, {{"COLOR", problem.inputs[0]}, {"HISTORY", problem.inputs[1]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}};
    call.global = strips(problem.output, strip, rows);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_believed(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = "range";
    call.entry = "believed";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> range_implementations() {
    static const Implementation implementations[] = {{"range", obvious, strip_choices, lower_range}};
    return implementations;
}

std::span<const Implementation> believed_implementations() {
    static const Implementation implementations[] = {{"believed", obvious, strip_choices, lower_believed}};
    return implementations;
}

}  // namespace clarus::runtime
