#include <fmt/format.h>

#include "runtime/implementations/lowering.h"

namespace clarus::runtime {
namespace {

KernelCall call_for(const Problem& problem, const Choices& choices, std::string entry) {
    KernelCall call;
    call.file = "fsr1";
    call.entry = std::move(entry);
    call.options = image_options({{"IN", problem.inputs[0]}, {"OUT", problem.output}});
    call.arguments = {{ArgumentKind::input, 0}, {ArgumentKind::output}};
    call.global = pixels(problem.output);
    call.local = group_size(choices);
    return call;
}

Lowered lower_easu(const Problem& problem, const Choices& choices) {
    KernelCall call = call_for(problem, choices, "easu");
    call.options += fmt::format(" {}", scale_options(std::get<graph::Easu>(problem.node.op).scale));
    call.arguments.push_back({ArgumentKind::frame});
    return {std::move(call), std::nullopt};
}

Lowered lower_rcas(const Problem& problem, const Choices& choices) {
    KernelCall call = call_for(problem, choices, "rcas");
    call.options += fmt::format(" -DSHARPNESS={:.9e}f", std::get<graph::Rcas>(problem.node.op).sharpness);
    return {std::move(call), std::nullopt};
}

}  // namespace

std::span<const Implementation> easu_implementations() {
    static const Implementation implementations[] = {{"easu", obvious, group_choices, lower_easu}};
    return implementations;
}

std::span<const Implementation> rcas_implementations() {
    static const Implementation implementations[] = {{"rcas", obvious, group_choices, lower_rcas}};
    return implementations;
}

}  // namespace clarus::runtime
