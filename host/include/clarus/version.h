#ifndef CLARUS_VERSION_H
#define CLARUS_VERSION_H

/* Semantic versions: while the first number is 0, the second changes with the interface. CMake reads them here. */

#include "clarus/export.h"

#define CLARUS_VERSION_MAJOR 0
#define CLARUS_VERSION_MINOR 1
#define CLARUS_VERSION_PATCH 0
#define CLARUS_VERSION_STRING "0.1.0"

/* As numbers that compare: CLARUS_VERSION >= CLARUS_VERSION_OF(0, 2, 0). */
#define CLARUS_VERSION_OF(major, minor, patch) ((major)*1000000 + (minor)*1000 + (patch))
#define CLARUS_VERSION CLARUS_VERSION_OF(CLARUS_VERSION_MAJOR, CLARUS_VERSION_MINOR, CLARUS_VERSION_PATCH)

#ifdef __cplusplus
extern "C" {
#endif

/* CLARUS_VERSION of the library that runs, which may be another than the one of these headers. */
CLARUS_API int clarus_version(void);
/* "0.1.0" */
CLARUS_API const char* clarus_version_string(void);

#ifdef __cplusplus
}
#endif

#endif
