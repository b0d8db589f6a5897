#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

constexpr int kTaps = 1;

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "hold";
    call.options =
        fmt::format("{} {} {}",
                    image_options({{"IMAGE", problem.inputs[0]},
                                   {"COLOR", problem.inputs[1]},
                                   {"HISTORY", problem.inputs[2]},
                                   {"OUT", problem.output}}),
                    scale_options(std::get<graph::Hold>(problem.node.op).scale), shift_options(graph::Shift::jitter));
    call.arguments = {{ArgumentKind::input, 0},
                      {ArgumentKind::input, 1},
                      {ArgumentKind::input, 2},
                      {ArgumentKind::output},
                      {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    return in_source_strips(lower_plain(problem, choices), problem, std::get<graph::Hold>(problem.node.op).scale,
                            kTaps);
}

}  // namespace

std::span<const Implementation> hold_implementations() {
    static const Implementation implementations[] = {
        {"hold strips", prefer_source_strips, single_choices, lower_strips},
        {"hold", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
