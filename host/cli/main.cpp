#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <exception>
#include <new>

#include "clarus/error.h"
#include "clarus/log.h"
#include "cli/commands.h"

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

void report(const char* message) { fmt::print(stderr, "clarus: error: {}\n", message); }

}  // namespace

int main(int argc, char** argv) {
    const auto logger = spdlog::stderr_color_st("clarus");
    logger->set_pattern("clarus: %^%l%$: %v");
    logger->set_level(spdlog::level::warn);
    clarus::set_log_callback(
        [logger](clarus::LogLevel level, std::string_view message) { logger->log(spdlog_level(level), message); });

    CLI::App app("Neural supersampling on any OpenCL device.", "clarus");
    app.set_version_flag("--version", "clarus " CLARUS_VERSION);
    app.add_flag_callback(
        "--verbose", [&] { logger->set_level(spdlog::level::debug); }, "Say what is compiled, measured and chosen");
    app.fallthrough();
    app.require_subcommand(1);
    clarus::cli::add_upscale_command(app);
    clarus::cli::add_compare_command(app);
    clarus::cli::add_check_command(app);
    clarus::cli::add_report_command(app);
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

    try {
        app.parse(argc, argv);
        return 0;
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : exit_usage;
    } catch (const clarus::cli::FoundWrong&) {
        return exit_failure;
    } catch (const std::bad_alloc&) {
        report("out of host memory");
    } catch (const std::exception& error) {
        report(error.what());
    }
    return exit_failure;
}
