#ifndef CLARUS_SHARE_WIRE_H
#define CLARUS_SHARE_WIRE_H

/* What the two processes say to each other (docs/sharing.md, "The protocol"): packets over the socket, the control
   page of each side, and the header of every slot. Both run on one machine, so numbers are in its own byte order.
   Included by tests in C++, too. */

#include <stdint.h>

#include "clarus/share.h"

enum {
    SHARE_MAGIC = 0x53524c43, /* "CLRS" */
    SHARE_VERSION = 2,
    SHARE_TEXT_BYTES = 256,
    SHARE_PAGE_BYTES = 4096,
    SHARE_DESCRIPTORS = 4, /* with SHARE_STREAM, in this order: frames, control, ready, free */
    SHARE_SLOT_BITS = 4    /* of the words of newest-frame: number + 1 above, slot below */
};

enum share_packet_type { SHARE_HELLO = 1, SHARE_STREAM = 2, SHARE_LEAVE = 3 };

enum share_reason { SHARE_ENDS = 1, SHARE_REFUSES = 2, SHARE_OTHER_VERSION = 3, SHARE_NONSENSE = 4 };

/* Every packet begins with it. It and share_leave are the same in every version. */
struct share_head {
    uint32_t magic, version, type, bytes; /* bytes: of the whole packet */
};

/* Reader to publisher, first. */
struct share_hello {
    struct share_head head;
};

/* Either way, last. */
struct share_leave {
    struct share_head head;
    uint32_t reason;
    char text[SHARE_TEXT_BYTES]; /* ends with a 0 */
};

struct share_wire_resource {
    uint32_t type, channels, width, height;
    uint64_t row_pitch;
};

/* Publisher to reader, with the descriptors. */
struct share_stream_packet {
    struct share_head head;
    struct share_wire_resource resources[CLARUS_SHARE_KINDS];
    uint32_t slots, policy, linear_color, depth_projective, depth_reversed, motion_jittered, motion_sampled_at_jitter;
    float motion_scale_x, motion_scale_y, scale;
    uint32_t output_width, output_height;
    uint32_t dynamic_resolution, reserved;
    uint64_t user_bytes;
    uint64_t slot_bytes; /* what follows from the above, to compare */
};

/* The control memory holds two, the publisher's and then the reader's; each side writes its own alone. */
struct share_publisher_page {
    uint64_t ready; /* every frame: how many are ready. Newest frame: the word of the newest, 0 before the first */
};
struct share_reader_page {
    uint64_t taken;    /* newest frame: the word of the frame that is held, or about to be; 0: none */
    uint64_t released; /* every frame: how many. Newest frame: the word of the last that was */
};

/* At the beginning of a slot. User data follow at SHARE_PAGE_BYTES, then the images (share/layout.h). */
struct share_frame_header {
    uint64_t index; /* of the frame in the stream, from 0 */
    uint64_t number;
    uint64_t user_bytes;
    uint32_t width, height;
    float jitter_x, jitter_y, exposure, near_plane, far_plane, fov_y, frame_seconds, motion_scale_x, motion_scale_y;
    uint32_t reset, has_matrices;
    float view[16], projection[16];
    uint32_t reserved; /* 0 */
};

static inline uint64_t share_load(const uint64_t* word) { return __atomic_load_n(word, __ATOMIC_SEQ_CST); }
static inline void share_store(uint64_t* word, uint64_t value) { __atomic_store_n(word, value, __ATOMIC_SEQ_CST); }

static inline uint64_t share_word(uint64_t index, int slot) {
    return (index + 1) << SHARE_SLOT_BITS | (uint64_t)(unsigned)slot;
}
static inline uint64_t share_word_index(uint64_t word) { return (word >> SHARE_SLOT_BITS) - 1; }
static inline int share_word_slot(uint64_t word) { return (int)(word & ((1u << SHARE_SLOT_BITS) - 1)); }

#endif
