#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "clarus/stream.h"

namespace clarus::cli {

/// Rules as they are given on the command line, or in a file of that name: one a line, # before remarks. Errors: file.
std::string placement_rules(const std::string& given);

/// Adds `--place` and `--fallback`, which set the options.
void add_placement_options(CLI::App& command, StreamOptions& options);

}  // namespace clarus::cli
