#include "base/memory.h"

#include <cstdlib>  // tells of the C library

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace clarus {

void share_one_heap() {
#if defined(__GLIBC__)
    mallopt(M_ARENA_MAX, 1);
#endif
}

void return_freed_memory() {
#if defined(__GLIBC__)
    malloc_trim(0);
#endif
}

}  // namespace clarus
