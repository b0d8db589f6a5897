#pragma once

#include <CLI/CLI.hpp>

namespace clarus::cli {

/// `clarus bench placement`.
void add_bench_placement_command(CLI::App& bench);

}  // namespace clarus::cli
