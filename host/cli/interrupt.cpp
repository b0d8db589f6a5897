#include "cli/interrupt.h"

#include <atomic>
#include <csignal>

#include "base/output_file.h"

namespace clarus::cli {
namespace {

std::atomic<bool> interrupted = false;  // lock-free, as handlers need it
static_assert(std::atomic<bool>::is_always_lock_free);

void end(int signal) {
    remove_unfinished_files();
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

// A second one ends the process, whatever it does.
void interrupt(int signal) {
    if (interrupted.exchange(true)) end(signal);
}

// What was to be ignored, as nohup wants it, stays so.
void handle(int signal, void (*handler)(int)) {
    if (std::signal(signal, handler) == SIG_IGN) std::signal(signal, SIG_IGN);
}

}  // namespace

void remove_unfinished_files_when_ended() {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT, SIGALRM, SIGUSR1, SIGUSR2, SIGXCPU})
        handle(signal, end);
    std::signal(SIGXFSZ, SIG_IGN);  // writing more than is allowed (ulimit -f) is then an error of that file
}

Interrupt::Interrupt() {
    interrupted = false;
    remove_unfinished_files_when_ended();  // once more: OpenCL's compiler may have put handlers of its own
    std::signal(SIGINT, interrupt);
    std::signal(SIGTERM, interrupt);
}

Interrupt::~Interrupt() { remove_unfinished_files_when_ended(); }

bool Interrupt::came() { return interrupted; }

}  // namespace clarus::cli
