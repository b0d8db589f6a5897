#pragma once

#include <memory>
#include <string>

#include "clarus/share.h"

namespace clarus::cli {

/// The end of a stream that shares frames (clarus/share.h), whose waits end where Interrupt comes. What an upscaler
/// says when it leaves is logged.
class SharePublisher {
  public:
    /// Errors: invalid_argument, file.
    SharePublisher(const std::string& name, const clarus_share_description& description);

    /// Waits for a free slot. False where Interrupt came instead.
    bool begin(clarus_share_frame& frame);
    /// An image without gaps, where the stream has it.
    static void copy(const clarus_share_frame& frame, clarus_share_kind kind, const void* pixels);
    void end(const clarus_share_frame& frame);
    /// Waits until all frames are taken and released.
    void drain();
    void close() { stream_.reset(); }

    clarus_share_state state() const { return clarus_share_stream_state(stream_.get()); }

  private:
    void tell_message();

    std::unique_ptr<clarus_share_stream, void (*)(clarus_share_stream*)> stream_;
    std::string told_;
};

}  // namespace clarus::cli
