// Connects to `clarus serve NAME --listen 127.0.0.1:PORT` and says what it should not: KIND is what. Prints the words
// by which it was refused; ends with 1 where it was not, in half a minute: a server that begins may be slow to answer.
// Usage: stranger PORT NAME KIND

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "link/sides.h"
#include "share/layout.h"

using namespace clarus::link;

namespace {

constexpr int kSide = 16;

/// What it says to begin with; right but for the kind.
Hello make_hello(const std::string& name, const std::string& kind, share_layout& layout) {
    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = {{CLARUS_F32, 3}, kSide, kSide, 0};
    share_lay_out(&description, &layout);
    Hello hello{};
    hello.head = share_make_head(kHello, sizeof hello);
    hello.session = static_cast<uint64_t>(getpid());
    std::strncpy(hello.name, name.c_str(), sizeof hello.name - 1);
    share_describe_to_wire(&description, &layout, &hello.stream);
    share_wire_resource& color = hello.stream.resources[CLARUS_SHARE_COLOR];
    if (kind == "magic") hello.head.magic = 0x31313131;
    if (kind == "version") hello.head.version = SHARE_VERSION + 1;
    if (kind == "type") hello.head.type = 99;
    if (kind == "bytes") hello.head.bytes = 0xffffffff;
    if (kind == "name") std::memset(hello.name, 1, sizeof hello.name);
    if (kind == "width") color.width = 0xffffffff;
    if (kind == "pixels") color.width = color.height = 32768;
    if (kind == "format") color.type = 77;
    if (kind == "channels") color.channels = 9;
    if (kind == "pitch") color.row_pitch = UINT64_MAX;
    if (kind == "slots") hello.stream.slots = 1000;
    if (kind == "slot size") hello.stream.slot_bytes += 4096;
    if (kind == "user data") hello.stream.user_bytes = UINT64_MAX;
    return hello;
}

Frame make_frame(const std::string& kind) {
    Frame frame{};
    frame.head = share_make_head(kFrame, sizeof frame);
    frame.frame.width = frame.frame.height = kSide;
    frame.frame.exposure = frame.frame.motion_scale_x = frame.frame.motion_scale_y = 1;
    if (kind == "frame index") frame.index = 1;
    if (kind == "frame width") frame.frame.width = 1 << 20;
    if (kind == "frame jitter") frame.frame.jitter_x = NAN;
    if (kind == "frame user data") frame.frame.user_bytes = UINT64_MAX;
    return frame;
}

/// The words; empty where there were none.
std::string say(const std::string& port, const std::string& name, const std::string& kind) {
    Worker worker("lo");
    Endpoint endpoint(worker, resolve({"127.0.0.1", port}));
    share_layout layout;
    const Hello hello = make_hello(name, kind, layout);
    if (kind == "random") {
        std::vector<std::byte> bytes(sizeof hello);
        for (std::byte& byte : bytes) byte = static_cast<std::byte>(std::rand());
        Hello random;
        std::memcpy(&random, bytes.data(), sizeof random);
        endpoint.send(random);
    } else if (kind == "truncated") {
        endpoint.send(hello.head);
    } else if (kind == "with data") {
        endpoint.send(hello, &hello, sizeof hello, {});
    } else {
        endpoint.send(hello);
    }
    const std::vector<std::byte> slot(layout.slot_bytes);
    const size_t bytes = layout.slot_bytes - SHARE_PAGE_BYTES;
    if (kind == "hello again") endpoint.send(hello);
    if (kind == "frame without data") endpoint.send(make_frame(kind));
    if (kind == "frame too long") endpoint.send(make_frame(kind), slot.data(), bytes + 1, {});
    if (kind == "frame too short") endpoint.send(make_frame(kind), slot.data(), bytes - 1, {});
    if (kind.starts_with("frame ")) endpoint.send(make_frame(kind), slot.data(), bytes, {});
    if (kind == "many frames")
        for (uint64_t index = 0; index < 20; ++index) {
            Frame frame = make_frame(kind);
            frame.index = index;
            endpoint.send(frame, slot.data(), bytes, {});
        }
    for (const auto until = Clock::now() + std::chrono::seconds(30); Clock::now() < until;) {
        for (; !worker.messages.empty(); worker.messages.pop_front()) {
            const Message& message = worker.messages.front();
            if (type_of(message) != SHARE_LEAVE) continue;
            share_leave leave{};
            std::memcpy(&leave, message.header.data(), std::min(sizeof leave, message.header.size()));
            char words[SHARE_TEXT_BYTES];
            share_words(&leave, message.header.size(), words);
            return words;
        }
        if (endpoint.is_broken()) break;  // by a server that has gone; its words may have come with that
        worker.wait({}, 50);
    }
    return {};
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc != 4) return 2;
    const std::string words = say(argv[1], argv[2], argv[3]);
    std::puts(words.c_str());
    return words.empty() ? 1 : 0;
} catch (const std::exception& error) {
    std::fprintf(stderr, "stranger: %s\n", error.what());
    return 1;
}
