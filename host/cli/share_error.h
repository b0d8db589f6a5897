#pragma once

#include "base/error.h"
#include "clarus/share.h"

namespace clarus::cli {

/// Throws what clarus_share_last_error() tells of a call that returned `status`.
[[noreturn]] inline void fail_with_share(clarus_share_status status) {
    const bool asked_wrongly = status == CLARUS_SHARE_INVALID_ARGUMENT || status == CLARUS_SHARE_REFUSED;
    fail(asked_wrongly ? ErrorKind::invalid_argument : ErrorKind::file, "{}", clarus_share_last_error());
}

inline void check_share(clarus_share_status status) {
    if (status != CLARUS_SHARE_OK) fail_with_share(status);
}

}  // namespace clarus::cli
