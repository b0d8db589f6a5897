#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

Lowered lower_plain(const Problem& problem, const Choices& choices) {
    const TensorLayout &past = problem.inputs[0], &out = problem.output;
    KernelCall call;
    call.file = call.entry = "sense";
    call.options = fmt::format("-DSTRIP={}", choices.at("STRIP"));
    add_images(call, {{"PAST", past}, {"OUT", out}});
    add_tensor(call, "DEPTH", problem.inputs[1]);
    add_scale(call, static_cast<double>(past.width) / out.width, "_x");
    add_scale(call, static_cast<double>(past.height) / out.height, "_y");
    call.arguments = {
        {ArgumentKind::input, 0}, {ArgumentKind::input, 1}, {ArgumentKind::output}, {ArgumentKind::frame}};
    call.global = strips(out, choices);
    call.local = group_size(choices);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> sense_implementations() {
    static const Implementation implementations[] = {{"sense", obvious, strip_choices, lower_plain}};
    return implementations;
}

}  // namespace clarus::runtime
