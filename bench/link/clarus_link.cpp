// How fast frames go to another machine, or a network namespace that stands for one: one side is a renderer that draws
// nothing, the other takes frames and lets them go. Frames a second of as many as go, then milliseconds of single ones
// from the renderer's clarus_share_end to the return of the other side's clarus_share_reader_wait, where both have one
// clock: median and 95th percentile.
// Usage: clarus_link receive HOST:PORT     and then     clarus_link send HOST:PORT [WIDTH HEIGHT [FRAMES]]

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "clarus/share.h"
#include "link/link.h"

namespace {

constexpr int kPatienceMilliseconds = 20000;
constexpr int kSingle = 100;  // frames that go alone

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void check(clarus_share_status status) {
    if (status != CLARUS_SHARE_OK) throw std::runtime_error(clarus_share_last_error());
}

/// What a frame brings along.
struct Stamp {
    double ended;
    int is_single;
};

void receive(const std::string& at) {
    const auto link = clarus::link::receive_frames("link-bench", clarus::link::parse_address(at, "HOST:PORT"));
    clarus_share_reader* opened = nullptr;
    check(clarus_share_reader_open("link-bench", &opened));
    const std::unique_ptr<clarus_share_reader, void (*)(clarus_share_reader*)> reader(opened,
                                                                                      clarus_share_reader_close);
    check(clarus_share_reader_connect(opened, kPatienceMilliseconds));
    std::vector<double> latencies;
    double first = 0, last = 0;
    int frames = 0;
    for (;;) {
        clarus_share_frame frame;
        const clarus_share_status status = clarus_share_reader_wait(opened, kPatienceMilliseconds, &frame);
        if (status == CLARUS_SHARE_ENDED) break;
        check(status);
        const double taken = now();
        Stamp stamp;
        std::memcpy(&stamp, frame.user, sizeof stamp);
        if (stamp.is_single) {
            latencies.push_back(1e3 * (taken - stamp.ended));
        } else {
            if (frames++ == 0) first = taken;
            last = taken;
        }
        check(clarus_share_reader_release(opened));
    }
    fmt::print("{} frames, {:.1f} a second, {:.2f} ms each\n", frames, (frames - 1) / (last - first),
               1e3 * (last - first) / (frames - 1));
    std::ranges::sort(latencies);
    if (!latencies.empty())
        fmt::print("one way, alone: {:.2f} ms, 95th percentile {:.2f}\n", latencies[latencies.size() / 2],
                   latencies[latencies.size() * 95 / 100]);
}

void send(const std::string& to, int width, int height, int frames) {
    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = {{CLARUS_F16, 4}, width, height, 0};
    description.resources[CLARUS_SHARE_DEPTH] = {{CLARUS_F32, 1}, width, height, 0};
    description.resources[CLARUS_SHARE_MOTION] = {{CLARUS_F16, 2}, width, height, 0};
    description.user_bytes = sizeof(Stamp);
    const std::string name = fmt::format("link-bench-{}", getpid());
    clarus_share_stream* opened = nullptr;
    check(clarus_share_open(name.c_str(), &description, &opened));
    std::unique_ptr<clarus_share_stream, void (*)(clarus_share_stream*)> stream(opened, clarus_share_close);
    const auto link = clarus::link::send_frames(name, {clarus::link::parse_address(to, "HOST:PORT"), "link-bench"});
    for (int i = 0; i < frames + kSingle; ++i) {
        if (i >= frames) {
            check(clarus_share_drain(opened, kPatienceMilliseconds));
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        clarus_share_frame frame;
        check(clarus_share_begin(opened, kPatienceMilliseconds, &frame));
        const Stamp stamp{now(), i >= frames};
        std::memcpy(frame.user, &stamp, sizeof stamp);
        frame.user_bytes = sizeof stamp;
        check(clarus_share_end(opened, &frame));
    }
    check(clarus_share_drain(opened, kPatienceMilliseconds));
    stream.reset();
    link->finish(2000);
}

}  // namespace

int main(int argc, char** argv) try {
    const std::string side = argc > 2 ? argv[1] : "";
    const auto number = [&](int index, int otherwise) { return argc > index ? std::atoi(argv[index]) : otherwise; };
    if (side == "receive")
        receive(argv[2]);
    else if (side == "send")
        send(argv[2], number(3, 960), number(4, 540), number(5, 300));
    else
        throw std::runtime_error("usage: clarus_link receive|send HOST:PORT [WIDTH HEIGHT [FRAMES]]");
    return 0;
} catch (const std::exception& error) {
    fmt::print(stderr, "clarus_link: {}\n", error.what());
    return 1;
}
