#ifndef CLARUS_TESTS_C_CHECK_H
#define CLARUS_TESTS_C_CHECK_H

#include <stdio.h>
#include <stdlib.h>

#include "clarus/clarus.h"

/* Ends the function it stands in as a failed program does, with what the library said last. */
#define CHECK(condition)                                                                                            \
    do {                                                                                                            \
        if (!(condition)) {                                                                                         \
            fprintf(stderr, "%s:%d: %s does not hold (%s)\n", __FILE__, __LINE__, #condition, clarus_last_error()); \
            return EXIT_FAILURE;                                                                                    \
        }                                                                                                           \
    } while (0)

#endif
