#include "api/c/guard.h"

#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include "cl/error.h"
#include "clarus/error.h"
#include "clarus/log.h"
#include "clarus/version.h"

namespace clarus::c {
namespace {

thread_local std::string last_error;

clarus_status status_of(ErrorKind kind) {
    switch (kind) {
        case ErrorKind::invalid_argument:
            return CLARUS_INVALID_ARGUMENT;
        case ErrorKind::file:
            return CLARUS_FILE;
        case ErrorKind::no_device:
            return CLARUS_NO_DEVICE;
        case ErrorKind::build:
            return CLARUS_BUILD;
        case ErrorKind::out_of_memory:
            return CLARUS_OUT_OF_MEMORY;
        case ErrorKind::device:
            return CLARUS_DEVICE;
    }
    return CLARUS_INTERNAL;
}

clarus_status keep(clarus_status status, std::string_view before, std::string_view words = {}) {
    try {
        last_error = before;
        last_error += words;
    } catch (const std::bad_alloc&) {
        last_error.clear();
    }
    return status;
}

}  // namespace

clarus_status keep_error() noexcept {
    try {
        throw;
    } catch (const Error& error) {
        return keep(status_of(error.kind()), error.what());
    } catch (const std::bad_alloc& error) {
        return keep(CLARUS_OUT_OF_MEMORY, error.what());
    } catch (const cl::Error& error) {
        return keep(CLARUS_DEVICE, "OpenCL's ", std::string(error.what()) + " says " + ocl::status_name(error.err()));
    } catch (const std::system_error& error) {
        return keep(CLARUS_INTERNAL, "the system refuses, threads or memory perhaps: ", error.what());
    } catch (const std::exception& error) {
        return keep(CLARUS_INTERNAL, error.what());
    } catch (...) {
        return keep(CLARUS_INTERNAL, "an exception of unknown type");
    }
}

}  // namespace clarus::c

extern "C" {

int clarus_version(void) { return CLARUS_VERSION; }

const char* clarus_version_string(void) { return CLARUS_VERSION_STRING; }

const char* clarus_last_error(void) { return clarus::c::last_error.c_str(); }

void clarus_set_log_callback(void (*callback)(clarus_log_level, const char*, void*), void* user) {
    if (!callback) return clarus::set_log_callback({});
    clarus::set_log_callback([callback, user](clarus::LogLevel level, std::string_view message) {
        callback(static_cast<clarus_log_level>(level), std::string(message).c_str(), user);
    });
}

}  // extern "C"
