#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>

#include "bytes.h"
#include "share/endpoint.h"
#include "share/memory.h"
#include "share/wire.h"

namespace {

using Stream = std::unique_ptr<clarus_share_stream, decltype(&clarus_share_close)>;

constexpr size_t control_bytes = 2 * SHARE_PAGE_BYTES;

Stream open_stream(const std::string& name, clarus_share_policy policy) {
    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = {{CLARUS_U8, 3}, 4, 4, 0};
    description.slots = 2;
    description.policy = policy;
    clarus_share_stream* stream = nullptr;
    clarus_share_open(name.c_str(), &description, &stream);
    return {stream, clarus_share_close};
}

/// As a renderer does it: where a slot is free, it gets a frame.
void share_frame(clarus_share_stream* stream) {
    clarus_share_frame frame;
    const clarus_share_status status = clarus_share_begin(stream, 0, &frame);
    if (status == CLARUS_SHARE_TIMED_OUT) return;
    if (status != CLARUS_SHARE_OK) __builtin_trap();
    std::memset(frame.images[CLARUS_SHARE_COLOR].pixels, 1, frame.images[CLARUS_SHARE_COLOR].row_pitch * frame.height);
    if (clarus_share_end(stream, &frame) != CLARUS_SHARE_OK) __builtin_trap();
    const clarus_share_state state = clarus_share_stream_state(stream);
    if (state.released > state.ready) __builtin_trap();
}

}  // namespace

/// What an upscaler says to a renderer: in the first byte the renderer's policy, and how many bytes the first packet
/// has; that; the two words of its page, twice; and a packet at the end.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const std::string name = "fuzz" + std::to_string(getpid());
    if (size < 2) return 0;
    Bytes rest(data + 1, size - 1);
    const Stream stream = open_stream(name, data[0] % 2 ? CLARUS_SHARE_NEWEST_FRAME : CLARUS_SHARE_EVERY_FRAME);
    int connection = -1;
    if (!stream || share_connect(name.c_str(), SHARE_FRAMES_SUFFIX, &connection) != CLARUS_SHARE_OK) __builtin_trap();
    share_frame(stream.get());
    const Bytes hello = take(rest, data[0] / 2);
    if (!hello.empty()) share_send(connection, hello.data(), hello.size(), nullptr, 0);
    share_frame(stream.get());

    share_stream_packet packet;
    std::array<int, SHARE_DESCRIPTORS> descriptors{-1, -1, -1, -1};
    int count = 0;
    share_receive(connection, &packet, sizeof packet, descriptors.data(), SHARE_DESCRIPTORS, &count);
    void* pages = nullptr;
    if (count == SHARE_DESCRIPTORS) share_map_memory("control", descriptors[1], control_bytes, 1, &pages);
    for (int i = 0; i < 2 && pages; ++i) {
        const Bytes words = take(rest, sizeof(share_reader_page));
        std::ranges::copy(words, static_cast<uint8_t*>(pages) + SHARE_PAGE_BYTES);
        share_frame(stream.get());
    }
    if (!rest.empty()) share_send(connection, rest.data(), rest.size(), nullptr, 0);
    share_frame(stream.get());
    share_close(&connection);
    share_frame(stream.get());
    share_unmap(&pages, control_bytes);
    for (int& descriptor : descriptors) share_close(&descriptor);
    return 0;
}
