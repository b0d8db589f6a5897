#ifndef CLARUS_EXPORT_H
#define CLARUS_EXPORT_H

/* What the shared library exports; all else in it is hidden. */
#if defined(__GNUC__)
#define CLARUS_API __attribute__((visibility("default")))
#else
#define CLARUS_API
#endif

#endif
