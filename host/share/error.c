#include "share/error.h"

#include <stdarg.h>
#include <stdio.h>

static _Thread_local char last_error[768];

const char* clarus_share_last_error(void) { return last_error; }

clarus_share_status share_fail(clarus_share_status status, const char* format, ...) {
    char text[sizeof last_error]; /* what is formatted may be the last error */
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    snprintf(last_error, sizeof last_error, "%s", text);
    return status;
}
