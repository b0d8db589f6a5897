#pragma once

#include <CLI/CLI.hpp>

namespace clarus::cli {

/// `clarus bench share`.
void add_bench_share_command(CLI::App& bench);

}  // namespace clarus::cli
