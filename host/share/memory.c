#include "share/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "share/endpoint.h"
#include "share/error.h"

enum { SIZE_SEALS = F_SEAL_SHRINK | F_SEAL_GROW };

static void* map(int descriptor, size_t bytes, int writable) {
    return mmap(NULL, bytes, PROT_READ | (writable ? PROT_WRITE : 0), MAP_SHARED, descriptor, 0);
}

clarus_share_status share_make_memory(const char* what, size_t bytes, int only_here_writable, int* descriptor,
                                      void** memory) {
    *memory = MAP_FAILED;
    *descriptor = memfd_create(what, MFD_CLOEXEC | MFD_ALLOW_SEALING);
    /* Allocated now, not when it is written: a machine without memory then says so, and kills nobody. */
    int cause = *descriptor < 0 ? errno : posix_fallocate(*descriptor, 0, (off_t)bytes);
    if (cause == 0 && (*memory = map(*descriptor, bytes, 1)) == MAP_FAILED) cause = errno;
    const int seals = SIZE_SEALS | F_SEAL_SEAL | (only_here_writable ? F_SEAL_FUTURE_WRITE : 0);
    if (cause == 0 && fcntl(*descriptor, F_ADD_SEALS, seals) != 0) cause = errno;
    if (cause == 0) return CLARUS_SHARE_OK;
    share_unmap(memory, bytes);
    share_close(descriptor);
    return share_fail(CLARUS_SHARE_SYSTEM, "cannot make %zu KiB of shared memory for %s: %s", bytes >> 10, what,
                      strerror(cause));
}

clarus_share_status share_map_memory(const char* what, int descriptor, size_t bytes, int writable, void** memory) {
    *memory = MAP_FAILED;
    const int seals = fcntl(descriptor, F_GET_SEALS);
    if (seals < 0 || (seals & SIZE_SEALS) != SIZE_SEALS)
        return share_fail(CLARUS_SHARE_PROTOCOL, "the %s came in memory that could be taken away: it is not sealed",
                          what);
    struct stat status;
    if (fstat(descriptor, &status) != 0 || (uint64_t)status.st_size != bytes)
        return share_fail(CLARUS_SHARE_PROTOCOL, "the %s came in %llu bytes of memory where %zu follow from the stream",
                          what, (unsigned long long)status.st_size, bytes);
    *memory = map(descriptor, bytes, writable);
    if (*memory != MAP_FAILED) return CLARUS_SHARE_OK;
    *memory = NULL;
    return share_fail(CLARUS_SHARE_SYSTEM, "cannot map %zu KiB of shared memory for %s: %s", bytes >> 10, what,
                      strerror(errno));
}

void share_unmap(void** memory, size_t bytes) {
    if (*memory && *memory != MAP_FAILED) munmap(*memory, bytes);
    *memory = NULL;
}
