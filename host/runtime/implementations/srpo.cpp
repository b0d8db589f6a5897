#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

// Long strips are what a CPU's vectors are for; a GPU wants many work-items.
std::vector<Choices> mask_choices(const Problem&, const DeviceProfile& profile) {
    if (profile.device_class == DeviceClass::gpu) return {{{"WG_X", 8}, {"WG_Y", 8}, {"PIXELS", 4}, {"ROWS", 2}}};
    return {{{"WG_X", 1}, {"WG_Y", 1}, {"PIXELS", 64}, {"ROWS", 16}}};
}

Lowered lower_mask(const Problem& problem, const Choices& choices) {
    const int strip = choices.at("PIXELS"), rows = choices.at("ROWS");
    KernelCall call;
    call.file = "srpo";
    call.entry = "offset_mask";
    call.options = fmt::format("-DOFFSET_MASK -DPIXELS={} -DROWS={}", strip, rows);
    add_images(call, {{"OFFSETS", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = strips(problem.output, strip, rows);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_project(const Problem& problem, const Choices& choices) {
    KernelCall call;
    call.file = "srpo";
    call.entry = "project";
    call.options = fmt::format("-DSCALE={}", std::get<graph::Project>(problem.node.op).scale);
    add_images(call, {{"COLOR", problem.inputs[0]},
                      {"OFFSETS", problem.inputs[1]},
                      {"MASK", problem.inputs[2]},
                      {"INTERPOLATED", problem.inputs[3]},
                      {"OUT", problem.output}});
    for (int input = 0; input < 4; ++input) call.arguments.push_back({ArgumentKind::input, input});
    call.arguments.push_back({ArgumentKind::output});
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> offset_mask_implementations() {
    static const Implementation implementations[] = {{"offset mask", obvious, mask_choices, lower_mask}};
    return implementations;
}

std::span<const Implementation> project_implementations() {
    static const Implementation implementations[] = {{"project", obvious, group_choices, lower_project}};
    return implementations;
}

}  // namespace clarus::runtime
