#include "cli/supervisor.h"

#include <signal.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>

#include "base/error.h"
#include "base/log.h"
#include "base/platform.h"

namespace clarus::cli {
namespace {

using Clock = std::chrono::steady_clock;

/// Signals that the supervisor waits for in place of being interrupted.
class WaitedSignals {
  public:
    WaitedSignals() {
        sigemptyset(&set_);
        for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) sigaddset(&set_, signal);
        sigprocmask(SIG_BLOCK, &set_, &before_);
    }
    siginfo_t wait() const {
        siginfo_t signal{};
        while (sigwaitinfo(&set_, &signal) < 0) {
        }
        return signal;
    }
    void leave_to_the_child() const { sigprocmask(SIG_SETMASK, &before_, nullptr); }

  private:
    sigset_t set_{}, before_{};
};

/// How the child has ended; hands on the signals that come until then.
int wait_for(pid_t child, const WaitedSignals& signals, bool& is_asked_to_end) {
    for (;;) {
        int status = 0;
        if (waitpid(child, &status, WNOHANG) == child) return status;
        const siginfo_t signal = signals.wait();
        if (signal.si_signo == SIGCHLD) continue;
        is_asked_to_end = true;
        // A terminal sends its signals to the child as well.
        if (signal.si_code != SI_KERNEL) kill(child, signal.si_signo);
    }
}

}  // namespace

void go_on_supervised(const std::string& what) {
    constexpr int kMostShortLives = 3;
    constexpr std::chrono::seconds kShort(10);
    const WaitedSignals signals;
    const pid_t supervisor = getpid();
    for (int short_lives = 0;;) {
        const Clock::time_point began = Clock::now();
        const pid_t child = fork();
        if (child < 0) fail(ErrorKind::file, "cannot start a process for {}: {}", what, strerror(errno));
        if (child == 0) {
            end_with_parent(supervisor);
            signals.leave_to_the_child();
            return;
        }
        bool is_asked_to_end = false;
        const int status = wait_for(child, signals, is_asked_to_end);
        if (WIFEXITED(status)) std::exit(WEXITSTATUS(status));
        const int signal = WTERMSIG(status);
        if (is_asked_to_end) std::exit(128 + signal);
        short_lives = Clock::now() - began < kShort ? short_lives + 1 : 0;
        const char* description = sigdescr_np(signal);
        const std::string death = fmt::format("{} died of signal {}, {}", what, signal, description ? description : "");
        if (short_lives == kMostShortLives) {
            log(LogLevel::warning, "{}, as did the {} before it within ten seconds: not started again", death,
                kMostShortLives - 1);
            std::exit(1);
        }
        log(LogLevel::warning, "{}; it is started again", death);
    }
}

}  // namespace clarus::cli
