#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <optional>

#include "base/error.h"
#include "clarus/error.h"
#include "link/link.h"
#include "link/protocol.h"
#include "link/worker.h"
#include "share/peer.h"

namespace clarus::link {

// What the sending and the receiving side do alike.

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kHeartbeat{500};  // between signs of life
constexpr std::chrono::milliseconds kSilence{3000};   // without any, the other side is taken for dead
constexpr int kGoodbyeMilliseconds = 500;             // that last words may take to go

/// Wakes a thread that waits.
class Bell {
  public:
    Bell() : descriptor_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
        if (descriptor_ < 0) fail(ErrorKind::file, "cannot make an eventfd: {}", std::strerror(errno));
    }
    ~Bell() { close(descriptor_); }
    Bell(const Bell&) = delete;
    Bell& operator=(const Bell&) = delete;

    void ring() const { share_ring(descriptor_); }
    int descriptor() const { return descriptor_; }

  private:
    int descriptor_;
};

/// What a message begins with, zeros where it is shorter.
template <typename Header>
Header begin_of(const Message& message) {
    Header header{};
    if (!message.header.empty())
        std::memcpy(&header, message.header.data(), std::min(sizeof header, message.header.size()));
    return header;
}

/// A message of this type; none, with the reason in clarus_share_last_error(), where it is another.
template <typename Header>
std::optional<Header> read(const Message& message, uint32_t type, clarus_share_status* status = nullptr) {
    Header header = begin_of<Header>(message);
    const clarus_share_status found = share_check_head(&header.head, message.header.size(), type, sizeof header);
    if (status) *status = found;
    return found == CLARUS_SHARE_OK ? std::optional(header) : std::nullopt;
}

inline uint32_t type_of(const Message& message) {
    const auto head = begin_of<share_head>(message);
    return head.magic == SHARE_MAGIC ? head.type : 0;
}

inline share_leave leave_word(uint32_t reason, const std::string& text) {
    share_leave leave{};
    leave.head = share_make_head(SHARE_LEAVE, sizeof leave);
    leave.reason = reason;
    std::strncpy(leave.text, text.c_str(), sizeof leave.text - 1);
    return leave;
}

std::unique_ptr<Link> make_sender(const std::string& name, const RemoteStream& to);
std::unique_ptr<Link> make_receiver(const std::string& name, const Address& at);

}  // namespace clarus::link
