#pragma once

#include <CLI/CLI.hpp>

namespace clarus::cli {

/// `clarus bench game`: the game of measure::measure_sharing, which reads a task a line and writes what a turn cost.
void add_bench_game_command(CLI::App& bench);

}  // namespace clarus::cli
