#include <fcntl.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/explain.h"
#include "base/nearest.h"
#include "clarus/log.h"
#include "clarus/version.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/printable.h"

namespace {

constexpr int exit_failure = 1;
constexpr int exit_usage = 2;

spdlog::level::level_enum spdlog_level(clarus::LogLevel level) {
    switch (level) {
        case clarus::LogLevel::debug:
            return spdlog::level::debug;
        case clarus::LogLevel::info:
            return spdlog::level::info;
        case clarus::LogLevel::warning:
            break;
    }
    return spdlog::level::warn;
}

/// Where standard error takes nothing, the exit status alone tells.
void report(std::string_view message) {
    std::fputs(fmt::format("clarus: error: {}\n", clarus::cli::printable(message)).c_str(), stderr);
}

/// The command that was given, as far as it is one: `clarus bench compare`.
const CLI::App& innermost(const CLI::App& app) {
    const std::vector<CLI::App*> given = app.get_subcommands();
    return given.empty() ? app : innermost(*given.back());
}

std::string full_name(const CLI::App& command) {
    return command.get_parent() ? full_name(*command.get_parent()) + " " + command.get_name() : command.get_name();
}

/// What a command takes: options and commands below it.
std::vector<std::string> words_of(const CLI::App& command) {
    std::vector<std::string> words;
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    for (const CLI::App* below : command.get_subcommands({})) words.push_back(below->get_name());
    return words;
}

/// Words that the command does not know go before what is missing: they may be that, misspelt.
std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App& command = innermost(app);
    const std::vector<std::string> unknown = app.remaining(true);
    std::string text = error.what();
    const auto kind = static_cast<CLI::ExitCodes>(error.get_exit_code());
    if (!unknown.empty() && (kind == CLI::ExitCodes::RequiredError || kind == CLI::ExitCodes::ExtrasError)) {
        text = fmt::format("{} does not take {}", full_name(command), fmt::join(unknown, " "));
        const std::vector<std::string> words = words_of(command);
        const std::vector<std::string_view> views(words.begin(), words.end());
        const std::string_view meant = clarus::nearest(unknown.front(), views);
        if (!meant.empty()) text += fmt::format("; is it {}?", meant);
    }
    return fmt::format("{}\n`{} --help` lists options", text, full_name(command));
}

/// A stream that is closed would otherwise be the first file that is opened.
void fill_standard_streams() {
    int file = 0;
    do file = open("/dev/null", O_RDONLY);  // writing to it is an error
    while (file >= 0 && file <= STDERR_FILENO);
    if (file >= 0) close(file);
}

/// Whether what was printed has arrived is known when the last of it is written.
void finish_output() {
    std::cout.flush();
    const bool flushed = std::fflush(stdout) == 0 && std::cout.good();
    if (flushed && !std::ferror(stdout)) return;
    clarus::fail(clarus::ErrorKind::file, "cannot write to standard output{}",
                 flushed ? "" : ": " + std::generic_category().message(errno));
}

int run(int argc, char** argv) {
    const auto logger = spdlog::stderr_color_st("clarus");
    logger->set_pattern("clarus: %^%l%$: %v");
    logger->set_level(spdlog::level::warn);
    clarus::set_log_callback([logger](clarus::LogLevel level, std::string_view message) {
        logger->log(spdlog_level(level), clarus::cli::printable(message));
    });

    CLI::App app("Neural supersampling on any OpenCL device.", "clarus");
    app.set_version_flag("--version", "clarus " CLARUS_VERSION_STRING "\nbuilt with " CLARUS_DEPENDENCIES);
    app.add_flag_callback(
        "--verbose", [&] { logger->set_level(spdlog::level::debug); }, "Say what is compiled, measured and chosen");
    app.fallthrough();
    app.require_subcommand(1);
    clarus::cli::add_upscale_command(app);
    clarus::cli::add_compare_command(app);
    clarus::cli::add_check_command(app);
    clarus::cli::add_report_command(app);
    clarus::cli::add_view_command(app);
    clarus::cli::add_render_command(app);
    clarus::cli::add_devices_command(app);
    clarus::cli::add_models_command(app);
    clarus::cli::add_model_command(app);
    clarus::cli::add_prepare_command(app);
    clarus::cli::add_quantize_command(app);
    clarus::cli::add_bench_command(app);
    clarus::cli::add_serve_command(app);
    clarus::cli::add_control_command(app);
    clarus::cli::add_play_command(app);
    clarus::cli::add_relay_command(app);

    if (argc < 2) {
        std::fputs(app.help().c_str(), stderr);
        return exit_usage;
    }
    std::vector<std::string> words(argv + 1, argv + argc);
    if (words.front() == "help") {
        words.erase(words.begin());
        words.emplace_back("--help");
    }
    std::ranges::reverse(words);  // as CLI11 takes them

    int result = 0;
    try {
        app.parse(std::move(words));
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() != 0) {
            report(complaint(app, error));
            return exit_usage;
        }
        app.exit(error);  // prints help, or the version
    } catch (const clarus::cli::FoundWrong&) {
        result = exit_failure;
    }
    finish_output();
    return result;
}

}  // namespace

int main(int argc, char** argv) {
    fill_standard_streams();
    clarus::cli::guard_terminal();
    clarus::cli::remove_unfinished_files_when_ended();
    try {
        return run(argc, argv);
    } catch (const std::system_error& error) {
        report(std::ferror(stdout) ? "cannot write to standard output: " + error.code().message()
                                   : clarus::explain(error));
    } catch (const std::exception& error) {
        report(clarus::explain(error));
    }
    return exit_failure;
}
