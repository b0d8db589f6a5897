#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_fill(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "fill";
    call.options = fmt::format("-DVALUE={:.9e}f", std::get<graph::Fill>(problem.node.op).value);
    add_images(call, {{"OUT", problem.output}});
    call.arguments = {{ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_depth_before(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = "history";
    call.entry = "depth_before";
    call.options = "-DDEPTH_BEFORE";
    add_images(call, {{"MOTION", problem.inputs[0]}, {"DEPTH", problem.inputs[1]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_previous_depth(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = "history";
    call.entry = "previous_depth";
    call.options =
        fmt::format("-DPREVIOUS_DEPTH -DSHARE={:.9e}f", std::get<graph::PreviousDepth>(problem.node.op).share);
    add_tensor(call, "MOTION", problem.inputs[1]);
    add_images(call, {{"DEPTH", problem.inputs[2]}, {"OUT", problem.output}});
    call.arguments = {
        {ArgumentKind::input, 1}, {ArgumentKind::input, 2}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_checked_motion(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = "history";
    call.entry = "checked_motion";
    call.options = "-DCHECKED_MOTION";
    add_images(call, {{"MOTION", problem.inputs[0]},
                      {"DEPTH", problem.inputs[1]},
                      {"PREVIOUS", problem.inputs[2]},
                      {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_validity(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = "history";
    call.entry = "validity";
    call.options = "-DVALIDITY";
    add_tensor(call, "MOTION", problem.inputs[0]);
    add_images(call, {{"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> fill_implementations() {
    static const Implementation implementations[] = {{"fill", obvious, group_choices, lower_fill}};
    return implementations;
}

std::span<const Implementation> depth_before_implementations() {
    static const Implementation implementations[] = {{"depth before", obvious, group_choices, lower_depth_before}};
    return implementations;
}

std::span<const Implementation> previous_depth_implementations() {
    static const Implementation implementations[] = {{"previous depth", obvious, group_choices, lower_previous_depth}};
    return implementations;
}

std::span<const Implementation> checked_motion_implementations() {
    static const Implementation implementations[] = {{"checked motion", obvious, group_choices, lower_checked_motion}};
    return implementations;
}

std::span<const Implementation> validity_implementations() {
    static const Implementation implementations[] = {{"validity", obvious, group_choices, lower_validity}};
    return implementations;
}

}  // namespace clarus::runtime
