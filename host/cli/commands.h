#pragma once

#include <CLI/CLI.hpp>

namespace clarus::cli {

/// Thrown by a command that did its work and has said what is wrong: the program's exit status is 1, and no error is
/// printed.
struct FoundWrong {};

// Each adds its subcommand to the app; parsing a command line that names it then runs it. Errors leave as
// clarus::Error.
void add_upscale_command(CLI::App& app);
void add_compare_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_render_command(CLI::App& app);
void add_devices_command(CLI::App& app);
void add_models_command(CLI::App& app);
void add_model_command(CLI::App& app);
void add_prepare_command(CLI::App& app);
void add_quantize_command(CLI::App& app);
void add_bench_command(CLI::App& app);
void add_serve_command(CLI::App& app);
void add_control_command(CLI::App& app);
void add_play_command(CLI::App& app);
void add_relay_command(CLI::App& app);

}  // namespace clarus::cli
