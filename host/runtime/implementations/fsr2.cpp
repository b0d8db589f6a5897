#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_residual(const Problem& problem, const Choices& choices) {
    const TensorLayout &past = problem.inputs[1], &out = problem.output;
    KernelCall call;
    call.file = call.entry = "residual";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_images(call, {{"COLOR", problem.inputs[0]}, {"PAST", past}, {"OUT", out}});
    add_scale(call, static_cast<double>(past.width) / out.width, "_x");
    add_scale(call, static_cast<double>(past.height) / out.height, "_y");
    call.arguments = {
        {ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = strips(out, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_trust(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "trust";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_images(call, {{"RESIDUAL", problem.inputs[0]}, {"OUT", problem.output}});
    add_tensor(call, "MOTION", problem.inputs[1]);
    add_scale(call, std::get<graph::Trust>(problem.node.op).scale);
    call.arguments = {
        {ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_collect(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "collect";
    add_images(call, {{"COLOR", problem.inputs[0]},
                      {"PAST", problem.inputs[1]},
                      {"TRUST", problem.inputs[2]},
                      {"OUT", problem.output}});
    add_tensor(call, "MOTION", problem.inputs[3]);
    add_scale(call, std::get<graph::Collect>(problem.node.op).scale);
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::input, 2},
                      {ArgumentKind::input, 3}, {ArgumentKind::output},   {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_collect_lanes(const Problem& problem, const Choices& choices) {
    return in_sample_lanes(lower_collect(problem, choices), problem, std::get<graph::Collect>(problem.node.op).scale);
}

}  // namespace

std::span<const Implementation> residual_implementations() {
    static const Implementation implementations[] = {{"residual", obvious, strip_choices, lower_residual}};
    return implementations;
}

std::span<const Implementation> trust_implementations() {
    static const Implementation implementations[] = {{"trust", obvious, strip_choices, lower_trust}};
    return implementations;
}

std::span<const Implementation> collect_implementations() {
    static const Implementation implementations[] = {
        {"collect lanes", prefer_sample_lanes, single_choices, lower_collect_lanes},
        {"collect", obvious, group_choices, lower_collect}};
    return implementations;
}

}  // namespace clarus::runtime
