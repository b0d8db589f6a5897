#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>

#include "bytes.h"
#include "share/endpoint.h"
#include "share/layout.h"
#include "share/memory.h"

namespace {

/// A renderer that says what it likes, in memory of the size that a reader expects.
class Renderer {
  public:
    Renderer(int listener, Bytes packet, Bytes header) : connection_(share_accept(listener)) {
        constexpr size_t most_bytes = 1 << 22;
        share_hello hello;
        share_receive(connection_, &hello, sizeof hello, nullptr, 0, nullptr);
        share_stream_packet stream{};
        std::ranges::copy(packet, reinterpret_cast<uint8_t*>(&stream));
        clarus_share_description description = share_description_from_wire(&stream);
        share_layout layout{};
        if (share_lay_out(&description, &layout) == CLARUS_SHARE_OK && layout.bytes <= most_bytes)
            bytes_ = layout.bytes;
        share_make_memory("frames", bytes_, 0, &descriptors_[0], &frames_);
        share_make_memory("control", control_bytes, 0, &descriptors_[1], &pages_);
        for (const size_t event : {2, 3}) descriptors_[event] = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
        for (int slot = 0; slot < description.slots && layout.bytes == bytes_; ++slot) {
            uint8_t* at = static_cast<uint8_t*>(frames_) + slot * layout.slot_bytes;
            std::ranges::copy(header, at);
            reinterpret_cast<share_frame_header*>(at)->index += slot;
        }
        share_send(connection_, packet.data(), packet.size(), descriptors_.data(), SHARE_DESCRIPTORS);
    }
    ~Renderer() {
        share_unmap(&frames_, bytes_);
        share_unmap(&pages_, control_bytes);
        for (int& descriptor : descriptors_) share_close(&descriptor);
        share_close(&connection_);
    }
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    void say_ready(uint64_t word) { share_store(&static_cast<share_publisher_page*>(pages_)->ready, word); }
    void say(Bytes packet) { share_send(connection_, packet.data(), packet.size(), nullptr, 0); }

  private:
    static constexpr size_t control_bytes = 2 * SHARE_PAGE_BYTES;
    int connection_;
    size_t bytes_ = SHARE_PAGE_BYTES;
    std::array<int, SHARE_DESCRIPTORS> descriptors_{-1, -1, -1, -1};
    void *frames_ = nullptr, *pages_ = nullptr;
};

/// Takes frames as long as there are any, and reads all that they point to.
void take_all(clarus_share_reader* reader) {
    clarus_share_frame frame;
    unsigned sum = 0;
    while (clarus_share_reader_wait(reader, 0, &frame) == CLARUS_SHARE_OK) {
        for (const clarus_share_image& image : frame.images) {
            const auto* pixels = static_cast<const uint8_t*>(image.pixels);
            if (pixels) sum += pixels[0] + pixels[image.row_pitch * image.height - 1];
        }
        const auto* user = static_cast<const uint8_t*>(frame.user);
        if (frame.user_bytes > 0) sum += user[frame.user_bytes - 1];
        if (clarus_share_reader_release(reader) != CLARUS_SHARE_OK) __builtin_trap();
    }
    [[maybe_unused]] static volatile unsigned read;  // lest it be left out
    read = sum;
    const clarus_share_state state = clarus_share_reader_state(reader);
    if (state.skipped > state.ready) __builtin_trap();
}

}  // namespace

/// What a renderer says to an upscaler: its stream, a header that is in every slot, up to three words of its page one
/// after another, and a packet at the end.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const std::string name = "fuzz" + std::to_string(getpid());
    static share_endpoint endpoint;
    [[maybe_unused]] static const bool listens =
        share_listen(name.c_str(), SHARE_FRAMES_SUFFIX, &endpoint) == CLARUS_SHARE_OK &&
        std::atexit([] { share_stop_listening(&endpoint); }) == 0;

    Bytes rest(data, size);
    const Bytes packet = take(rest, sizeof(share_stream_packet)), header = take(rest, sizeof(share_frame_header));
    const Bytes words = take(rest, 3 * sizeof(uint64_t));
    clarus_share_reader* opened = nullptr;
    if (packet.empty() || clarus_share_reader_open(name.c_str(), &opened) != CLARUS_SHARE_OK) return 0;
    const std::unique_ptr<clarus_share_reader, decltype(&clarus_share_reader_close)> reader(opened,
                                                                                            clarus_share_reader_close);
    clarus_share_reader_connect(reader.get(), 0);  // greets
    Renderer renderer(endpoint.socket, packet, header);
    if (clarus_share_reader_connect(reader.get(), 0) != CLARUS_SHARE_OK) return 0;
    for (Bytes left = words; left.size() >= sizeof(uint64_t);) {
        uint64_t word = 0;
        std::memcpy(&word, take(left, sizeof word).data(), sizeof word);
        renderer.say_ready(word);
        take_all(reader.get());
    }
    if (!rest.empty()) renderer.say(rest);
    take_all(reader.get());
    return 0;
}
