#include <fmt/format.h>

#include <stdexcept>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

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
    call.options = fmt::format("{} -DTAPS={} -DCLAMPED={}", shift_options(resample.shift), taps(resample.filter),
                               resample.clamped ? 1 : 0);
    add_images(call, {{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    add_scale(call, resample.scale);
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

/// Where nothing is made smaller: then a strip is over no more source pixels than it has.
int prefer_strips(const Problem& problem, const DeviceProfile& profile) {
    const int channels = problem.inputs[0].channels;
    const bool fits = (channels == 1 || channels == 3 || channels == 4) && has_quads(problem.inputs[0]) &&
                      std::get<graph::Resample>(problem.node.op).scale >= 1;
    return fits ? prefer_not_on_gpus(problem, profile) : 0;
}

Lowered lower_strips(const Problem& problem, const Choices& choices) {
    constexpr int kPixels = 32, kRows = 32;
    const auto& resample = std::get<graph::Resample>(problem.node.op);
    Lowered lowered = in_strips(lower_plain(problem, choices), problem, kPixels, kRows);
    add_span(lowered.call, "span", kPixels, resample.scale, taps(resample.filter));
    return lowered;
}

}  // namespace

std::span<const Implementation> resample_implementations() {
    static const Implementation implementations[] = {{"resample strips", prefer_strips, single_choices, lower_strips},
                                                     {"resample", obvious, group_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
