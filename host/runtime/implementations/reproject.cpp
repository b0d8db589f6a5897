#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

double scale_of(const Problem& problem) { return std::get<graph::Reproject>(problem.node.op).scale; }

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "reproject";
    call.options = shift_options(graph::Shift::motion_jitter);
    add_images(call, {{"MOTION", problem.inputs[0]}, {"DEPTH", problem.inputs[1]}, {"OUT", problem.output}});
    add_scale(call, scale_of(problem));
    call.arguments = {
        {ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    constexpr int kPixels = 256, kRows = 16;  // wide, so that memory is read and written in long runs
    Lowered lowered = in_strips(lower_plain(problem, choices), problem, kPixels, kRows);
    add_span(lowered.call, "span", kPixels, scale_of(problem), 2);
    return lowered;
}

}  // namespace

std::span<const Implementation> reproject_implementations() {
    static const Implementation implementations[] = {
        {"reproject strips", prefer_not_on_gpus, single_choices, lower_strips},
        {"reproject", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
