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

Lowered lower_plain(const Problem& problem, const Choices& choices) {
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

int prefer_strips(const Problem& problem, const DeviceProfile& profile) {
    return problem.output.block == 1 && profile.device_class != DeviceClass::gpu ? 2 : 0;
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    constexpr int kPixels = 32, kRows = 16, kTaps = 3;
    const double scale = std::get<graph::Accumulate>(problem.node.op).scale;
    Lowered lowered = lower_plain(problem, choices);
    lowered.call.entry = "accumulate_strip";
    lowered.call.options += fmt::format(" -DPIXELS={} -DROWS={} -DCOLUMNS={} -DLINES={}", kPixels, kRows,
                                        source_span(kPixels, scale, kTaps), source_span(kRows, scale, kTaps));
    lowered.call.global = strips(problem.output, kPixels, kRows);
    return lowered;
}

}  // namespace

std::span<const Implementation> foremost_motion_implementations() {
    static const Implementation implementations[] = {{"foremost motion", obvious, group_choices, lower_foremost}};
    return implementations;
}

std::span<const Implementation> accumulate_implementations() {
    static const Implementation implementations[] = {{"accumulate strips", prefer_strips, single_choices, lower_strips},
                                                     {"accumulate", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
