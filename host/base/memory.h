#pragma once

namespace clarus {

/// Has threads that are made from here on share the heap of the first one. Each otherwise gets one of its own from
/// glibc, which keeps the most that it ever had: models prepared on threads that come and go then cost the sum of their
/// peaks. For programs that run for long. Does nothing where the C library is another.
void share_one_heap();

/// Gives the system back what the allocator keeps of freed memory. Takes some milliseconds; likewise.
void return_freed_memory();

}  // namespace clarus
