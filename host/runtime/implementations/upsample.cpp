#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    const auto& upsample = std::get<graph::Upsample>(problem.node.op);
    KernelCall call;
    call.file = "upsample";
    call.entry = "upsample_image";  // OpenCL has a function upsample
    call.options =
        fmt::format("-DSCALE={} -DSTRIP={} {}", upsample.scale, choices.at("STRIP"), shift_options(upsample.shift));
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_motion(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = call.entry = "upsample_motion";
    call.options = fmt::format("-DSCALE={} -DSTRIP={}", std::get<graph::UpsampleMotion>(problem.node.op).scale,
                               choices.at("STRIP"));
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = strips(problem.output, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

// --- rows: four pixels as one vector

int prefer_rows(const Problem& problem, const DeviceProfile& profile) {
    const TensorLayout& in = problem.inputs[0];
    const bool fits = in.channels <= 4 && in.block == 1 && in.stride == 4 && problem.output.block == 1;
    return fits && profile.device_class != DeviceClass::gpu ? 2 : 0;
}

std::vector<Choices> row_choices(const Problem&, const DeviceProfile&) {
    return {{{"WG_X", 1}, {"WG_Y", 1}, {"STRIP", 64}}};
}

Lowered in_rows(Lowered lowered, const Problem& problem, const Choices& choices) {
    lowered.call.file = lowered.call.entry = "upsample_rows";
    lowered.call.global = {strips(problem.inputs[0], choices)[0], static_cast<size_t>(problem.output.height)};
    return lowered;
}

Lowered lower_rows(const Problem& problem, const Choices& choices) {
    return in_rows(lower(problem, choices), problem, choices);
}

Lowered lower_motion_rows(const Problem& problem, const Choices& choices) {
    Lowered lowered = in_rows(lower_motion(problem, choices), problem, choices);
    lowered.call.options += " -DMOTION " + shift_options(graph::Shift::motion_jitter);
    return lowered;
}

}  // namespace

std::span<const Implementation> upsample_implementations() {
    static const Implementation implementations[] = {{"upsample rows", prefer_rows, row_choices, lower_rows},
                                                     {"upsample", obvious, strip_choices, lower}};
    return implementations;
}

std::span<const Implementation> upsample_motion_implementations() {
    static const Implementation implementations[] = {{"motion rows", prefer_rows, row_choices, lower_motion_rows},
                                                     {"upsample motion", obvious, strip_choices, lower_motion}};
    return implementations;
}

}  // namespace clarus::runtime
