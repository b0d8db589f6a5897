#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower(const Problem& problem, const Choices& choices) {
    const auto& resample = std::get<graph::Resample>(problem.node.op);
    const auto scale = static_cast<float>(resample.scale);
    KernelCall call;
    call.file = "resample";
    call.entry = resample.filter == graph::Filter::bicubic ? "resample_bicubic" : "resample_bilinear";
    call.options =
        fmt::format("{} -DSCALE={:.9e}f -DSCALE_REST={:.9e}f",
                    image_options({{"IN", problem.inputs[0]}, {"OUT", problem.output}}), scale, resample.scale - scale);
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> resample_implementations() {
    static const Implementation implementations[] = {{"resample", obvious, group_choices, lower}};
    return implementations;
}

}  // namespace clarus::runtime
