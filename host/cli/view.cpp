#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>
#include <utility>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/live_page.h"
#include "report/server.h"

namespace clarus::cli {
namespace {

constexpr int looks_apart_milliseconds = 1000;

struct ViewOptions {
    LivePage::Settings page;
    int port = 0;
};

void view(const ViewOptions& options) {
    LivePage page(options.page);
    const Interrupt interrupt;
    const std::unique_ptr<report::PageServer> server =
        report::serve_page(options.port, [&page] { return page.page(); });
    fmt::print("http://127.0.0.1:{}/  {} frames so far; Ctrl-C ends\n", server->port(), page.frames());
    std::fflush(stdout);
    const auto pause = std::chrono::milliseconds(Interrupt::look_milliseconds);
    for (int waited = 0; !Interrupt::came(); waited += Interrupt::look_milliseconds) {
        if (waited >= looks_apart_milliseconds) {
            page.update();
            waited = 0;
        }
        std::this_thread::sleep_for(pause);
    }
}

}  // namespace

void add_view_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand("view", "The report's page of results as they come, in a browser");
    const auto options = std::make_shared<ViewOptions>();
    LivePage::Settings& page = options->page;
    command
        .add_option("RESULT_DIR", page.results,
                    "Folders that `clarus upscale` writes into, or has written; several are compared")
        ->required()
        ->type_name("");
    command
        .add_option("--sequence", page.reference.sequence.path,
                    "What the results are upscaled from: its frames are shown beside them, and where it has "
                    "references, figures follow. Without, the results' pictures alone")
        ->type_name("SEQUENCE");
    page.reference.add_reading_to(command);
    command.add_option("--port", options->port, "Listen at this port of 127.0.0.1; 0: any that is free")
        ->type_name("N")
        ->check(CLI::Range(0, 65535))
        ->capture_default_str();
    command.add_option("--pictures", page.pictures, "Pictures of so many frames at most; figures are of all")
        ->type_name("N")
        ->check(CLI::Range(2, 1000))
        ->capture_default_str();
    command.add_flag("--lossless", page.lossless,
                     "Pictures as PNG, some four times as large, in place of JPEG of quality 95");
    command.add_option("--title", page.title, "The sequence's name where not given")->type_name("TEXT");
    command.footer(
        "It prints an address of this machine, which no other machine reaches. The page there is that of\n"
        "`clarus report`; while it is open it shows new frames as they come. Ctrl-C ends it.\n\n"
        "Examples:\n"
        "  clarus upscale sequence --model enss-s-x2 --output enss-s-x2    in one terminal\n"
        "  clarus view enss-s-x2 --sequence sequence                       in another\n"
        "  clarus view bicubic enss-s-x2 --sequence sequence --port 8080\n"
        "  clarus view upscaled-photos");
    command.callback([options] { view(*options); });
}

}  // namespace clarus::cli
