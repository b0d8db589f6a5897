#pragma once

#include <stdexcept>
#include <string>

#include "clarus/export.h"

namespace clarus {

enum class ErrorKind {
    invalid_argument,  // a value the caller gave; the message names it
    file,              // a file or folder that is missing, unreadable, unwritable or malformed; the message names it
    no_device,         // no OpenCL platform, or no device that fits the selector
    build,             // a kernel did not compile; the message carries the compiler's log
    out_of_memory,     // device or host memory
    device,            // any other OpenCL failure
};

/// The one exception that Clarus throws on purpose. `what()` says what is wrong and what to do about it.
class CLARUS_API Error : public std::runtime_error {
  public:
    Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
    ErrorKind kind() const noexcept { return kind_; }

  private:
    ErrorKind kind_;
};

}  // namespace clarus
