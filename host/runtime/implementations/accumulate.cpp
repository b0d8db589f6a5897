#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_foremost(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "foremost_motion";
    call.options = fmt::format("{} {} {}", image_options({{"DEPTH", problem.inputs[1]}}),
                               layout_options("MOTION", problem.inputs[0]), layout_options("OUT", problem.output));
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "accumulate";
    call.options = fmt::format(
        "{} {} {}",
        image_options({{"OUT", problem.output}, {"COLOR", problem.inputs[0]}, {"HISTORY", problem.inputs[2]}}),
        layout_options("MOTION", problem.inputs[1]), scale_options(std::get<graph::Accumulate>(problem.node.op).scale));
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> foremost_motion_implementations() {
    static const Implementation implementations[] = {{"foremost motion", obvious, group_choices, lower_foremost}};
    return implementations;
}

std::span<const Implementation> accumulate_implementations() {
    static const Implementation implementations[] = {{"accumulate", obvious, group_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
