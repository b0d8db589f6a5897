#pragma once

namespace clarus {

/// Gives the system back the memory that the allocator keeps of what was freed. glibc keeps it for each thread's heap:
/// after models were switched on threads that came and went, more than the models in use take. Takes some milliseconds;
/// does nothing where the C library is another.
void return_freed_memory();

}  // namespace clarus
