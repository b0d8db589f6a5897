#include "base/error.h"
#include "base/log.h"
#include "base/module.h"
#include "cli/commands.h"

namespace clarus::cli {
namespace {

using Define = void(CLI::App&, LogCallback);

Define& renderer() {
    try {
        return *module_function<Define>("clarus_render_command", "clarus_define_render_command");
    } catch (const Error& error) {
        fail(error.kind(),
             "the sample renderer is not there, left out of this build (CLARUS_RENDERER) or of what is "
             "installed: {}",
             error.what());
    }
}

}  // namespace

void add_render_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("render", "Render a sequence with the sample renderer");
    // Even the names of its scenes, and with them the options, come from the module.
    command.preparse_callback([&command](size_t) { renderer()(command, log_message); });
}

}  // namespace clarus::cli
