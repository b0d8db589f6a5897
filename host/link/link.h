#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "clarus/log.h"
#include "link/address.h"

namespace clarus::link {

struct LinkState {
    bool connected = false;  // the two machines
    uint64_t frames = 0;     // carried
    uint64_t connections = 0;
    bool ended = false;   // the renderer closed its stream, and the other machine has all of it
    std::string failure;  // why the link has given up; empty as long as it has not
};

/// Carries frames between a stream of this machine and one of another, as long as it lives, in a thread of its own
/// (docs/sharing.md, "Another machine"). What breaks is made anew; what was told to the log says what it was.
class Link {
  public:
    virtual ~Link() = default;
    /// From any thread.
    virtual LinkState state() const = 0;
    /// Waits for the end of a stream that its renderer has closed, or so long.
    virtual void finish(int milliseconds) = 0;
};

/// Takes the frames of the local stream `name`, as an upscaler does, and sends them to where `receive_frames` is. The
/// module's errors: file, where this build has no UCX; those of resolve.
std::unique_ptr<Link> send_frames(const std::string& name, const RemoteStream& to);

/// Lets one machine at a time send the frames of a stream `name`, and shares them here under this name, as a renderer
/// does. Errors: file, where it cannot listen there or this build has no UCX; those of resolve.
std::unique_ptr<Link> receive_frames(const std::string& name, const Address& at);

/// What the module has.
struct LinkModule {
    std::unique_ptr<Link> (*send)(const std::string& name, const RemoteStream& to, LogCallback log);
    std::unique_ptr<Link> (*receive)(const std::string& name, const Address& at, LogCallback log);
};

}  // namespace clarus::link
