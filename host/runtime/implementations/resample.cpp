#include <fmt/format.h>

#include <stdexcept>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

constexpr int kStripPixels = 32, kStripRows = 32;

/// Of a filter, along each axis.
int taps(graph::Filter filter) {
    switch (filter) {
        case graph::Filter::nearest:
            return 1;
        case graph::Filter::bilinear:
            return 2;
        case graph::Filter::bicubic:
            return 4;
        case graph::Filter::lanczos:
            return 6;
    }
    throw std::logic_error("unknown filter");
}

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    const auto& resample = std::get<graph::Resample>(problem.node.op);
    KernelCall call;
    call.file = call.entry = "resample";
    call.options = fmt::format("{} {} -DTAPS={}", scale_options(resample.scale), shift_options(resample.shift),
                               taps(resample.filter));
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

int prefer_strips(const Problem& problem, const DeviceProfile& profile) {
    const bool fits = problem.inputs[0].channels == 3 && has_quads(problem.inputs[0]) && problem.output.block == 1;
    return fits && profile.device_class != DeviceClass::gpu ? 2 : 0;
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    const auto& resample = std::get<graph::Resample>(problem.node.op);
    Lowered lowered = lower_plain(problem, choices);
    lowered.call.entry = "resample_strip";
    lowered.call.options += fmt::format(" -DPIXELS={} -DROWS={} -DSPAN={}", kStripPixels, kStripRows,
                                        source_span(kStripPixels, resample.scale, taps(resample.filter)));
    lowered.call.global = strips(problem.output, kStripPixels, kStripRows);
    return lowered;
}

}  // namespace

std::span<const Implementation> resample_implementations() {
    static const Implementation implementations[] = {{"resample strips", prefer_strips, single_choices, lower_strips},
                                                     {"resample", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
