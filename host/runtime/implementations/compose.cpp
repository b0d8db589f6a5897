#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

double scale_of(const Problem& problem) { return std::get<graph::Compose>(problem.node.op).scale; }

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "compose";
    call.options = shift_options(graph::Shift::jitter);
    add_images(call, {{"COLOR", problem.inputs[0]},
                      {"PAST", problem.inputs[1]},
                      {"PARAMETERS", problem.inputs[2]},
                      {"OUT", problem.output}});
    add_scale(call, scale_of(problem));
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_lanes(const Problem& problem, const Choices& choices) {
    return in_sample_lanes(lower_plain(problem, choices), problem, scale_of(problem));
}

}  // namespace

std::span<const Implementation> compose_implementations() {
    static const Implementation implementations[] = {
        {"compose lanes", prefer_sample_lanes, single_choices, lower_lanes},
        {"compose", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
