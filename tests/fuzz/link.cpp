#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.h"
#include "bytes.h"
#include "clarus/share.h"
#include "link/sides.h"

// Both sides of a link without a network: the input says what UCX would.

namespace {

using namespace clarus::link;
using Stream = std::unique_ptr<clarus_share_stream, decltype(&clarus_share_close)>;

std::string own_name() { return "fuzz" + std::to_string(getpid()); }

/// Of one run. The link's thread alone changes it, but for `is_over`.
struct Network {
    Bytes script;
    std::list<std::pair<ucp_ep_h, std::function<void()>>> ends;  // and what breaks each
    std::function<void(bool)> fetched;
    uintptr_t names = 0;  // of endpoints and requests
    std::atomic<bool> is_over = false;

    template <typename T>
    T new_name() {
        return reinterpret_cast<T>(names += 16);
    }
    auto end(size_t number) { return std::next(ends.begin(), static_cast<std::ptrdiff_t>(number % ends.size())); }
};
std::unique_ptr<Network> network;

/// A header with the bytes of data that it says to come with; a hello that begins with the wanted name has all of it.
Message message_of(Bytes& script, ucp_ep_h from) {
    uint16_t header_bytes = 0;
    uint32_t data_bytes = 0;
    std::ranges::copy(take(script, sizeof header_bytes), reinterpret_cast<uint8_t*>(&header_bytes));
    std::ranges::copy(take(script, sizeof data_bytes), reinterpret_cast<uint8_t*>(&data_bytes));
    const Bytes header = take(script, header_bytes);
    Message message{from, {}};
    message.header.assign(reinterpret_cast<const std::byte*>(header.data()),
                          reinterpret_cast<const std::byte*>(header.data()) + header.size());
    if (data_bytes > 0) message.data = network.get(), message.data_bytes = data_bytes;
    if (message.header.size() != sizeof(Hello)) return message;
    auto* name = reinterpret_cast<char*>(message.header.data()) + offsetof(Hello, name);
    if (std::strncmp(name, "fuzz", sizeof Hello::name) == 0) std::strncpy(name, own_name().c_str(), sizeof Hello::name);
    return message;
}

/// Where a slot is free, it gets a frame.
void share_frame(clarus_share_stream* stream) {
    clarus_share_frame frame;
    if (clarus_share_begin(stream, 0, &frame) != CLARUS_SHARE_OK) return;
    if (clarus_share_end(stream, &frame) != CLARUS_SHARE_OK) __builtin_trap();
}

}  // namespace

namespace clarus::link {

struct Worker::Requested {};

Worker::Worker(const std::string&) {}
Worker::~Worker() { network->fetched = nullptr; }
void Worker::listen(const Address&) {}

bool Worker::progress() {
    Bytes& script = network->script;
    if (script.empty()) return false;
    const uint8_t what = take(script, 1)[0], which = what / 4;
    if (what % 4 == 0)
        requests.push_back(network->new_name<ucp_conn_request_h>());
    else if (what % 4 == 1 && !network->ends.empty())
        messages.push_back(message_of(script, network->end(which)->first));
    else if (what % 4 == 2 && network->fetched)
        std::exchange(network->fetched, nullptr)(which % 2 == 0);
    else if (what % 4 == 3 && !network->ends.empty())
        network->end(which)->second();
    return true;
}

void Worker::wait(const std::vector<int>&, int) {
    std::this_thread::sleep_for(std::chrono::microseconds(50));
    if (!network->script.empty()) return;
    for (const auto& [name, breaks] : network->ends) breaks();
    network->is_over = true;
}

void Worker::fetch(const Message& message, void* to, std::function<void(bool)> done) {
    if (message.data != network.get() || network->fetched) __builtin_trap();
    auto* bytes = static_cast<std::byte*>(to);
    if (message.data_bytes > 0) bytes[0] = bytes[message.data_bytes - 1] = std::byte{1};
    network->fetched = std::move(done);
}

void Worker::drop(const Message& message) {
    if (message.data && message.data != network.get()) __builtin_trap();
}

Endpoint::Endpoint(Worker& worker, const SocketAddress&) : Endpoint(worker, ucp_conn_request_h{}) {}
Endpoint::Endpoint(Worker& worker, ucp_conn_request_h) : worker_(worker), endpoint_(network->new_name<ucp_ep_h>()) {
    network->ends.emplace_back(endpoint_, [state = state_] { state->is_broken = true; });
}
Endpoint::~Endpoint() {
    std::erase_if(network->ends, [&](const auto& end) { return end.first == endpoint_; });
}

void Endpoint::send(const void*, size_t, const void*, size_t, std::function<void(bool)> done) {
    if (done) done(!is_broken());
}
void Endpoint::flush(int) {}

}  // namespace clarus::link

/// In the first byte which side hears it, the receiver of frames or their sender; then what happens there, an event a
/// byte: somebody wants to connect, a message, a fetch has ended, a connection has broken.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 2) return 0;
    clarus::set_log_callback([](clarus::LogLevel, std::string_view) {});
    network = std::make_unique<Network>();
    network->script = Bytes(data + 1, size - 1);
    const Address nowhere{"127.0.0.1", "1"};
    const bool receives = data[0] % 2 == 0;

    Stream stream{nullptr, clarus_share_close};
    if (!receives) {
        clarus_share_description description = clarus_share_default_description();
        description.resources[CLARUS_SHARE_COLOR] = {{CLARUS_U8, 3}, 4, 4, 0};
        description.slots = 2;
        description.policy = data[0] / 2 % 2 ? CLARUS_SHARE_NEWEST_FRAME : CLARUS_SHARE_EVERY_FRAME;
        clarus_share_stream* opened = nullptr;
        if (clarus_share_open(own_name().c_str(), &description, &opened) != CLARUS_SHARE_OK) __builtin_trap();
        stream.reset(opened);
    }
    const std::unique_ptr<Link> link =
        receives ? make_receiver(own_name(), nowhere) : make_sender(own_name(), {nowhere, "there"});
    for (int i = 0; i < 3000 && !network->is_over; ++i) {
        if (stream) share_frame(stream.get());
        std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    if (!link->state().failure.empty()) __builtin_trap();
    return 0;
}
