#ifndef CLARUS_FORMAT_H
#define CLARUS_FORMAT_H

/* Pixel formats, for clarus.h and share.h alike. */

/* How a pixel's components are stored. u8 and u16 are normalised: 255 and 65535 are 1. The last three hold a pixel in
   32 bits, its first component in the lowest, and are read, not written. */
typedef enum clarus_element_type {
    CLARUS_U8,
    CLARUS_F16,
    CLARUS_F32,
    CLARUS_U16,
    CLARUS_RGB10A2,    /* 4 channels: 10, 10, 10 and 2 bits, normalised */
    CLARUS_R11G11B10F, /* 3 channels: floats of 11, 11 and 10 bits without sign */
    CLARUS_D24         /* 1 channel: depth in the low 24 bits, normalised; those above, a stencil, are skipped */
} clarus_element_type;

/* Components are interleaved; those beyond what is needed are skipped. */
typedef struct clarus_format {
    clarus_element_type type;
    int channels;
} clarus_format;

#endif
