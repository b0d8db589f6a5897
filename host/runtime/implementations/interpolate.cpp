#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_landed_source(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = "history";
    call.entry = "landed_source";
    call.options = fmt::format("-DLANDED_SOURCE -DSHARE={:.9e}f", std::get<graph::LandedSource>(problem.node.op).share);
    add_images(call, {{"MOTION", problem.inputs[1]},
                      {"DEPTH", problem.inputs[2]},
                      {"LANDED", problem.inputs[3]},
                      {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::input, 3},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_middle_motion(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "middle_motion";
    call.options = fmt::format("-DNO_SOURCE={}.0f", graph::kNoSource);
    add_images(call, {{"MOTION", problem.inputs[0]},
                      {"DEPTH", problem.inputs[1]},
                      {"SOURCE", problem.inputs[2]},
                      {"OUT", problem.output}});
    call.arguments = {
        {ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::input, 2}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_between(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "between";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_tensor(call, "MIDDLE", problem.inputs[0]);
    add_images(call, {{"COLOR", problem.inputs[1]}, {"PREVIOUS", problem.inputs[2]}, {"OUT", problem.output}});
    add_scale(call, std::get<graph::Between>(problem.node.op).scale);
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> landed_source_implementations() {
    static const Implementation implementations[] = {{"landed source", obvious, group_choices, lower_landed_source}};
    return implementations;
}

std::span<const Implementation> middle_motion_implementations() {
    static const Implementation implementations[] = {{"middle motion", obvious, group_choices, lower_middle_motion}};
    return implementations;
}

std::span<const Implementation> between_implementations() {
    static const Implementation implementations[] = {{"between", obvious, strip_choices, lower_between}};
    return implementations;
}

}  // namespace clarus::runtime
