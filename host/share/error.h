#ifndef CLARUS_SHARE_ERROR_H
#define CLARUS_SHARE_ERROR_H

#include "clarus/share.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Keeps the text for clarus_share_last_error() and returns `status`. */
clarus_share_status share_fail(clarus_share_status status, const char* format, ...)
    __attribute__((format(printf, 2, 3)));

#ifdef __cplusplus
}
#endif

#endif
