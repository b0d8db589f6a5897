#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices, std::string entry, std::array<size_t, 2> global) {
    const auto& warp = std::get<graph::Warp>(problem.node.op);
    const TensorLayout& image = problem.inputs[0];
    KernelCall call;
    call.file = "warp";
    call.entry = std::move(entry);
    call.options = fmt::format("-DPIXELS_A_VECTOR={} -DSTRIP={}", warp.motion_block, choices.at("STRIP"));
    add_images(call, {{"OUT", problem.output}, {"IMAGE", image}});
    add_tensor(call, "MOTION", problem.inputs[1]);
    if (warp.border == graph::Border::zero) call.options += " -DBORDER_ZERO";
    if (image.samples > 1)
        call.options += fmt::format(" -DSAMPLES={} -DSAMPLE={}", image.samples,
                                    image.previous_samples ? "previous_sample" : "sample");
    call.arguments = {
        {ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}, {ArgumentKind::frame}};
    if (problem.inputs.size() > 2) {
        call.options += fmt::format(" -DFALLBACK_SCALE={}", warp.fallback_scale);
        add_images(call, {{"FALLBACK", problem.inputs[2]}});
        call.arguments.push_back({ArgumentKind::input, 2});
    }
    call.global = global;
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    return lower(problem, choices, "warp_plain", strips(problem.output, choices));
}

// One work-item a motion block is too few of them for a GPU.
int prefer_blocks(const Problem& problem, const DeviceProfile& profile) {
    const TensorLayout& image = problem.inputs[0];
    const bool fits = std::get<graph::Warp>(problem.node.op).motion_block == 8 && image.channels == 4 &&
                      image.block == 1 && image.stride == 4 && image.samples == 1;
    return fits && profile.device_class != DeviceClass::gpu ? 2 : 0;
}

std::vector<Choices> block_choices(const Problem&, const DeviceProfile&) {
    return {{{"WG_X", 8}, {"WG_Y", 1}, {"STRIP", 1}}};
}

Lowered lower_blocks(const Problem& problem, const Choices& choices) {
    return lower(problem, choices, "warp_block", pixels(problem.inputs[1]));
}

}  // namespace

std::span<const Implementation> warp_implementations() {
    static const Implementation implementations[] = {{"warp blocks", prefer_blocks, block_choices, lower_blocks},
                                                     {"warp", obvious, strip_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
