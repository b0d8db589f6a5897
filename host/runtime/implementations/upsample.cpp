#include <fmt/format.h>

#include <stdexcept>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

std::string shift_options(graph::Shift shift) {
    switch (shift) {
        case graph::Shift::none:
            return "-DSHIFT_X=0.0f -DSHIFT_Y=0.0f";
        case graph::Shift::jitter:
            return "-DSHIFT_X=frame.jitter_x -DSHIFT_Y=frame.jitter_y";
        case graph::Shift::motion_jitter:
            return "-DSHIFT_X=frame.motion_jitter_x -DSHIFT_Y=frame.motion_jitter_y";
    }
    throw std::logic_error("unknown shift");
}

Lowered lower(const Problem& problem, const Choices& choices) {
    const auto& upsample = std::get<graph::Upsample>(problem.node.op);
    KernelCall call;
    call.file = "upsample";
    call.entry = "upsample_image";  // OpenCL has a function upsample
    call.options =
        fmt::format("{} -DSCALE={} -DSTRIP={} {}", image_options({{"IN", problem.inputs[0]}, {"OUT", problem.output}}),
                    upsample.scale, choices.at("STRIP"), shift_options(upsample.shift));
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_motion(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "upsample_motion";
    call.options =
        fmt::format("{} -DSCALE={} -DSTRIP={}", image_options({{"IN", problem.inputs[0]}, {"OUT", problem.output}}),
                    std::get<graph::UpsampleMotion>(problem.node.op).scale, choices.at("STRIP"));
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> upsample_implementations() {
    static const Implementation implementations[] = {{"upsample", obvious, strip_choices, lower}};
    return implementations;
}

std::span<const Implementation> upsample_motion_implementations() {
    static const Implementation implementations[] = {{"upsample motion", obvious, strip_choices, lower_motion}};
    return implementations;
}

}  // namespace clarus::runtime
