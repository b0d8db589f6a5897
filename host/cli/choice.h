#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "clarus/upscaler.h"

namespace clarus::cli {

/// An option that takes one of a few words, each standing for a value of `target`.
template <typename Target, typename Value>
CLI::Option* add_choice(CLI::App& command, const std::string& name, Target& target,
                        std::initializer_list<std::pair<const char*, Value>> words, const std::string& description) {
    std::string allowed;
    for (const auto& [word, value] : words) allowed += (allowed.empty() ? "" : "|") + std::string(word);
    const auto choose = [&target, name, allowed, choices = std::vector(words)](const std::string& given) {
        for (const auto& [word, value] : choices)
            if (given == word) return void(target = value);
        throw CLI::ValidationError(name, fmt::format("{} is none of {}", given, allowed));
    };
    return command.add_option_function<std::string>(name, choose, description)->type_name(allowed);
}

inline void add_precision_option(CLI::App& command, Precision& precision) {
    add_choice<Precision, Precision>(command, "--precision", precision,
                                     {{"fp32", Precision::fp32},
                                      {"fp16", Precision::fp16},
                                      {"bf16", Precision::bf16},
                                      {"auto", Precision::automatic}},
                                     "fp32 by default; how intermediates are stored; auto: fp16 where the device has "
                                     "half arithmetic; bf16: stored as "
                                     "fp32, products of convolutions in bfloat16 where the device has them");
}

/// A value of an option `--precision` that takes several.
inline Precision parse_precision(const std::string& text) {
    if (text == "fp32") return Precision::fp32;
    if (text == "fp16") return Precision::fp16;
    if (text == "bf16") return Precision::bf16;
    throw CLI::ValidationError("--precision", text + " is none of fp32|fp16|bf16");
}

}  // namespace clarus::cli
