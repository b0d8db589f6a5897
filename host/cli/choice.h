#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

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

}  // namespace clarus::cli
