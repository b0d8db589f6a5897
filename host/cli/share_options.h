#pragma once

#include <CLI/CLI.hpp>

#include "base/parse.h"
#include "cli/shared_frames.h"

namespace clarus::cli {

/// The options of every command that shares frames; returns `--share`.
inline CLI::Option* add_share_options(CLI::App& command, ShareOptions& options) {
    CLI::Option* share = command
                             .add_option("--share", options.name,
                                         "Share the frames as a stream of this name, by which `clarus serve` finds it; "
                                         "ucx:HOST:PORT/NAME: with `clarus serve NAME --listen` on another machine")
                             ->type_name("NAME");
    command
        .add_option("--frame-rate", options.frame_rate,
                    "Share so many frames a second, where they are taken as fast; without, as fast as they are")
        ->type_name("N")
        ->check([](const std::string& text) {
            const auto rate = parse_number(text);
            const bool is_one = rate && *rate >= 0.01 && *rate <= 10000;
            return is_one ? std::string() : text + " is not a number from 0.01 to 10000";
        });
    command.add_flag("--newest", options.newest,
                     "Do not wait for the upscaler: it gets the newest frame. Without, it gets every one");
    command
        .add_option("--trace", options.trace, "With --share: write a Chrome trace of rendering and sharing at the end")
        ->type_name("FILE");
    command.add_option("--slots", options.slots, "How many frames the stream has room for, 2 to 8")
        ->type_name("N")
        ->capture_default_str();
    return share;
}

}  // namespace clarus::cli
