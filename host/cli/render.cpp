#include "base/log.h"
#include "base/module.h"
#include "cli/commands.h"

namespace clarus::cli {

void add_render_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("render", "Render a sequence with the sample renderer");
    // The renderer and its libraries are a module; even the names of its scenes come from there.
    command.preparse_callback([&command](size_t) {
        const auto define =
            module_function<void(CLI::App&, LogCallback)>("clarus_render_command", "clarus_define_render_command");
        define(command, log_message);
    });
}

}  // namespace clarus::cli
