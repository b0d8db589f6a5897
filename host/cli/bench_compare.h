#pragma once

#include <CLI/CLI.hpp>

namespace clarus::cli {

/// `clarus bench compare`.
void add_bench_compare_command(CLI::App& bench);

}  // namespace clarus::cli
