#pragma once

#include <doctest/doctest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <thread>

namespace clarus::test {

/// A process that runs a function, and does not outlive the test.
class ChildProcess {
  public:
    explicit ChildProcess(const std::function<int()>& main) {
        const pid_t parent = getpid();
        id_ = fork();
        REQUIRE(id_ >= 0);
        if (id_ > 0) return;
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) _exit(1);
        _exit(main());
    }
    ~ChildProcess() {
        if (id_ > 0) kill();
    }
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    pid_t id() const { return id_; }
    void signal(int number) const { ::kill(id_, number); }
    /// At once, as a crash would.
    void kill() {
        signal(SIGKILL);
        waitpid(id_, nullptr, 0);
        id_ = -1;
    }
    /// At once; false where it had ended before.
    bool kill_unless_ended() {
        signal(SIGKILL);
        int status = 0;
        waitpid(id_, &status, 0);
        id_ = -1;
        code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        return WIFSIGNALED(status);
    }
    /// Its exit code, or -1 where it does not end in a minute, of sanitizers' ten.
    int result() {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
        constexpr int minutes = 10;
#else
        constexpr int minutes = 1;
#endif
        if (id_ < 0) return code_;
        for (int i = 0; i < minutes * 6000; ++i) {
            int status = 0;
            if (waitpid(id_, &status, WNOHANG) == id_) {
                id_ = -1;
                return code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return -1;
    }

  private:
    pid_t id_;
    int code_ = -1;  // once it has ended
};

}  // namespace clarus::test
