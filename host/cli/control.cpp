#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "base/json_text.h"
#include "cli/commands.h"
#include "cli/control_server.h"
#include "cli/progress.h"

namespace clarus::cli {
namespace {

using nlohmann::json;

struct ControlOptions {
    std::string name;
    std::vector<std::string> changes;
    bool as_json = false;
};

json request_of(const std::vector<std::string>& changes) {
    json request = json::object();
    for (const std::string& change : changes) {
        const size_t equals = change.find('=');
        if (equals == std::string::npos || equals + 1 == change.size())
            throw CLI::ValidationError("CHANGE", change + " is not of the form model=NAME, scale=S, output-size=WxH");
        const std::string key = change.substr(0, equals), value = change.substr(equals + 1);
        // The server runs in a folder of its own.
        std::error_code unreadable;
        request[key] = key == "model" && std::filesystem::is_regular_file(value, unreadable)
                           ? std::filesystem::absolute(value).string()
                           : value;
    }
    return request;
}

std::string size_text(const json& size) { return fmt::format("{}x{}", size[0].get<int>(), size[1].get<int>()); }

void print_state(const json& state) {
    fmt::print("{}: {}\n", state["stream"].get<std::string>(),
               state["connected"].get<bool>() ? "a renderer is there" : "waiting for a renderer");
    if (state.contains("model"))
        fmt::print("model {}, scale {:g}: {} to {} on {}{}\n", state["model"].get<std::string>(),
                   state["scale"].get<double>(), size_text(state["render_size"]), size_text(state["output_size"]),
                   state["device"].get<std::string>(),
                   state["copies"].get<bool>() ? "" : ", which reads frames where the renderer left them");
    const auto frames = state["frames"].get<int64_t>();
    fmt::print("{} frames, {} skipped", frames, state["skipped"].get<int64_t>());
    if (frames > 0)
        fmt::print("; the last took {:.2f} ms each, {:.1f} a second", state["milliseconds"].get<double>(),
                   state["frames_per_second"].get<double>());
    fmt::print("\n");
    fmt::print("renderers so far: {}; changes: {}\n", state["connections"].get<int64_t>(),
               state["changes"].get<int64_t>());
}

void control(const ControlOptions& options) {
    const json request = request_of(options.changes);
    json state;
    {
        Progress progress("preparing");
        state = ask_server(options.name, request, [&](double fraction) { progress.update(fraction); });
    }
    if (options.as_json)
        fmt::print("{}\n", json_text(state, 2));
    else
        print_state(state);
}

}  // namespace

void add_control_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("control", "Ask what `clarus serve` does, and change it while it runs");
    const auto options = std::make_shared<ControlOptions>();
    command.add_option("NAME", options->name, "The stream's name")->required();
    command.add_option("CHANGE", options->changes,
                       "model=NAME, scale=S or scale=auto, output-size=WxH or output-size=auto: holds from the frame "
                       "on that comes once it is prepared; no frame is lost");
    command.add_flag("--json", options->as_json, "Print state and figures as JSON");
    command.footer(
        "Examples:\n"
        "  clarus control game\n"
        "  clarus control game model=fsr2 scale=1.5\n"
        "  clarus control game output-size=1920x1080");
    command.callback([options] { control(*options); });
}

}  // namespace clarus::cli
