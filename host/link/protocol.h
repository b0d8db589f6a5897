#pragma once

#include <cstdint>

#include "share/wire.h"

namespace clarus::link {

// What two machines say to each other (docs/sharing.md, "Another machine"): headers of UCX's active messages, each
// beginning with the head of the local protocol's packets, whose version holds for these, too. SHARE_LEAVE is the same
// as there. Both machines have one byte order, or else the magic is another.

constexpr unsigned kActiveMessage = 1;  // UCX's number for all of them

enum MessageType : uint32_t { kHello = 16, kProgress, kFrame, kAlive };

/// Sender to receiver, first.
struct Hello {
    share_head head;
    uint64_t session;  // the same as long as the sender reads the same stream: what breaks is then taken up again
    uint64_t first;    // index of the oldest frame that the sender still has, or will have
    char name[72];     // of the stream, ends with a 0
    share_stream_packet stream;  // the description
};

/// The answer, and then, from receiver to sender, whenever it changes.
struct Progress {
    share_head head;
    uint64_t received;  // frames with indices below are in the receiver's slots
    uint64_t released;  // and of these are done
};

/// Sender to receiver. The message's data are the slot without its header: user data and images, as they lie there.
struct Frame {
    share_head head;
    uint64_t index;  // of the session, from 0, one more each time
    share_frame_header frame;
};

/// Either way, now and then.
struct Alive {
    share_head head;
};

}  // namespace clarus::link
