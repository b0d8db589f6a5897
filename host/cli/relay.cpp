#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "base/error.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "link/link.h"

namespace clarus::cli {
namespace {

struct RelayOptions {
    std::string name, to;
    bool goes_on = false;
};

void relay(const RelayOptions& options) {
    const std::string text = options.to.find('/') == std::string::npos ? options.to + "/" + options.name : options.to;
    const std::optional<link::RemoteStream> to = link::parse_remote_stream("ucx:" + text, "--to");
    const Interrupt interrupt;
    uint64_t frames = 0;
    do {
        const std::unique_ptr<link::Link> link = link::send_frames(options.name, *to);
        link::LinkState state;
        for (; !Interrupt::came() && !state.ended; state = link->state()) {
            if (!state.failure.empty()) fail(ErrorKind::file, "{}", state.failure);
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        frames += state.frames;
    } while (options.goes_on && !Interrupt::came());
    fmt::print("{} frames sent to {}\n", frames, to->address.text());
}

}  // namespace

void add_relay_command(CLI::App& app) {
    CLI::App& command =
        *app.add_subcommand("relay", "Send the frames that a renderer shares to `clarus serve` on another machine");
    const auto options = std::make_shared<RelayOptions>();
    command.add_option("NAME", options->name, "Of the renderer's stream on this machine, which may come later")
        ->required();
    command
        .add_option("--to", options->to,
                    "Where `clarus serve NAME --listen HOST:PORT` is; with /OTHER, where it serves another name")
        ->type_name("HOST:PORT[/NAME]")
        ->required();
    command.add_flag("--keep", options->goes_on,
                     "When the renderer closes its stream, wait for the next; without, that ends the command");
    command.footer(
        "It stands beside the game and takes its frames as an upscaler does, so that a game needs nothing more for "
        "another machine. For networks that are trusted: nothing is encrypted.\n"
        "Examples:\n"
        "  clarus serve game --model enss-m-x2 --listen 10.0.0.2:7788 --output upscaled      on the one machine\n"
        "  clarus relay game --to 10.0.0.2:7788                                              on the game's");
    command.callback([options] { relay(*options); });
}

}  // namespace clarus::cli
