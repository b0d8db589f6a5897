#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

constexpr int kTaps = 2;

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "reproject";
    call.options = fmt::format("{} {}", scale_options(std::get<graph::Reproject>(problem.node.op).scale),
                               shift_options(graph::Shift::motion_jitter));
    add_images(call, {{"MOTION", problem.inputs[0]}, {"DEPTH", problem.inputs[1]}, {"OUT", problem.output}});
    call.arguments = {
        {ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    return in_source_strips(lower_plain(problem, choices), problem, std::get<graph::Reproject>(problem.node.op).scale,
                            kTaps);
}

}  // namespace

std::span<const Implementation> reproject_implementations() {
    static const Implementation implementations[] = {
        {"reproject strips", prefer_source_strips, single_choices, lower_strips},
        {"reproject", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
