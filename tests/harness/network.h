#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "child_process.h"

namespace clarus::test {

/// A port of 127.0.0.1 at which nobody listens.
std::string free_port();

/// Two machines, as namespaces of the kernel's network, with a cable between them that is a thread of the test: it
/// takes its time, and can be cut. Needs the rights of an administrator and /dev/net/tun.
class Network {
  public:
    /// None where the rights are missing; `why` then says which.
    static std::unique_ptr<Network> make(std::string& why);
    ~Network();
    Network(const Network&) = delete;
    Network& operator=(const Network&) = delete;

    static std::string address(int machine);  // of machine 0 or 1
    /// What a command begins with that is to run on the machine.
    std::vector<std::string> on(int machine) const;

    void delay(std::chrono::milliseconds delay) { delay_ = delay; }
    /// Nothing goes through, and nobody is told.
    void cut(bool is_cut) { is_cut_ = is_cut; }

  private:
    struct Packet {
        std::chrono::steady_clock::time_point due;
        std::vector<char> bytes;
    };
    Network() = default;
    void carry();

    std::vector<std::unique_ptr<ChildProcess>> machines_;  // processes that keep the namespaces
    int ends_[2] = {-1, -1};                               // of the cable
    std::deque<Packet> under_way_[2];                      // to machine 0, to machine 1
    std::atomic<std::chrono::milliseconds> delay_{};
    std::atomic<bool> is_cut_ = false, stop_ = false;
    std::thread cable_;
};

}  // namespace clarus::test
