#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "base/python_process.h"

namespace clarus::cli {

/// Publishes a video's fragments over Media-over-QUIC: a Python process (integrations/stream/publish.py) that has
/// PyPI's moq-rs hands them to a relay.
class MoqPublisher {
  public:
    /// `url`: https://HOST:PORT/NAME, or …/NAME#SHA256 with the one certificate, in hexadecimal, that the relay may
    /// have. Errors: invalid_argument where there is no such python3, or no relay.
    explicit MoqPublisher(const std::string& url);

    /// io::TakeFragment. Errors: file where the process has ended.
    void publish(std::span<const std::byte> fragment, bool is_key);

  private:
    std::string url_;
    PythonProcess python_;
};

}  // namespace clarus::cli
