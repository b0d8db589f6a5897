#ifndef CLARUS_SHARE_MEMORY_H
#define CLARUS_SHARE_MEMORY_H

/* Shared memory without a name. Its size is sealed, so that nobody can take pages away under a reader. */

#include <stddef.h>

#include "clarus/share.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Makes, allocates and maps it. With `only_here_writable`, no mapping made later can write it, whoever makes it. */
clarus_share_status share_make_memory(const char* what, size_t bytes, int only_here_writable, int* descriptor,
                                      void** memory);

/* Maps memory that the other side made, having checked its size and seals. */
clarus_share_status share_map_memory(const char* what, int descriptor, size_t bytes, int writable, void** memory);

void share_unmap(void** memory, size_t bytes); /* and makes it NULL */

#ifdef __cplusplus
}
#endif

#endif
