#include "cli/interrupt.h"

#include <atomic>
#include <csignal>

namespace clarus::cli {
namespace {

std::atomic<bool> interrupted = false;  // lock-free, as handlers need it
static_assert(std::atomic<bool>::is_always_lock_free);

// A second one ends the process, whatever it does.
void interrupt(int signal) {
    interrupted = true;
    std::signal(signal, SIG_DFL);
}

}  // namespace

Interrupt::Interrupt() {
    interrupted = false;
    std::signal(SIGINT, interrupt);
    std::signal(SIGTERM, interrupt);
}

Interrupt::~Interrupt() {
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
}

bool Interrupt::came() { return interrupted; }

}  // namespace clarus::cli
