#pragma once

#include <utility>

#include "base/error.h"
#include "clarus/clarus.h"

namespace clarus::c {

/// The status of the exception that is being handled; clarus_last_error() tells its words in this thread.
clarus_status keep_error() noexcept;

/// No exception crosses into C.
template <typename F>
clarus_status guarded(F&& f) noexcept {
    try {
        std::forward<F>(f)();
        return CLARUS_OK;
    } catch (...) {
        return keep_error();
    }
}

/// What a pointer points to. Errors: invalid_argument, naming the argument, where it is null.
template <typename T>
T& given(T* pointer, const char* name) {
    if (!pointer) fail(ErrorKind::invalid_argument, "{} is NULL", name);
    return *pointer;
}

}  // namespace clarus::c
