#ifndef CLARUS_FORMAT_H
#define CLARUS_FORMAT_H

/* Pixel formats, for clarus.h and share.h alike. */

/* How a pixel's component is stored. u8 is normalised: 255 is 1. */
typedef enum clarus_element_type { CLARUS_U8, CLARUS_F16, CLARUS_F32 } clarus_element_type;

/* Components are interleaved; those beyond what is needed are skipped. */
typedef struct clarus_format {
    clarus_element_type type;
    int channels;
} clarus_format;

#endif
