#pragma once

#include <sys/types.h>

#include <cstddef>

namespace clarus::measure {

/// Processor time that a process of this user has taken so far, of all its threads, in seconds; 0 where there is none.
double processor_seconds(pid_t process);

/// What a process occupies of memory, each page that others have as well by its share (Linux's Pss), in bytes; 0 where
/// that is not told.
size_t occupied_bytes(pid_t process);

}  // namespace clarus::measure
