#include <algorithm>
#include <cstring>
#include <vector>

#include "share/layout.h"

// The description of a stream and the header of one of its frames, as another process or machine (host/link) says them.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    share_stream_packet packet{};
    share_frame_header header{};
    if (size < sizeof packet + sizeof header) return 0;
    std::memcpy(&packet, data, sizeof packet);
    std::memcpy(&header, data + sizeof packet, sizeof header);

    clarus_share_description description = share_description_from_wire(&packet);
    share_layout layout{};
    if (share_lay_out(&description, &layout) != CLARUS_SHARE_OK) return 0;
    if (layout.slot_bytes > layout.bytes) __builtin_trap();

    clarus_share_frame frame{};
    share_frame_from_wire(&header, &frame);
    if (share_check_frame(&description, &frame) != CLARUS_SHARE_OK) return 0;
    if (layout.bytes > 1 << 24) return 0;
    std::vector<unsigned char> memory(layout.bytes);
    share_point_into_slot(&description, &layout, memory.data(), &frame);
    // Whatever was accepted lies in the memory, to the last byte of the last row.
    for (int kind = 0; kind < CLARUS_SHARE_KINDS; ++kind) {
        const auto& image = frame.images[kind];
        if (image.pixels) std::fill_n(static_cast<unsigned char*>(image.pixels), image.row_pitch * image.height, 0);
    }
    return 0;
}
