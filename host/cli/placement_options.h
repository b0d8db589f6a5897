#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "clarus/stream.h"

namespace clarus::cli {

/// Adds `--place` and `--fallback`, which set the options.
void add_placement_options(CLI::App& command, StreamOptions& options);

}  // namespace clarus::cli
