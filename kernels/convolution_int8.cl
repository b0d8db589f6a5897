// Convolution in whole numbers in register tiles, for devices with wide vectors: a work-item stages the input of ROWS
// rows of PIXELS output pixels as numbers, the zero point outside the image, and keeps GROUP blocks of sixteen channels
// of one row's pixels in registers. With VNNI, a step of the innermost loop multiplies and adds four input channels of
// PIXELS pixels. Without, one, in float: the host sees to it that no sum reaches 2^24, so that it is exact.
//
// Options: CIN, COUT, KERNEL (odd), PIXELS, ROWS, GROUP, VNNI, WG_X, WG_Y (both 1: staging is not shared), and those of
// convolution_int8.clh. Work-items: (⌈height / ROWS⌉, ⌈width / PIXELS⌉). Packed biases are without what the zero point
// adds; weights are [group][tap][four input channels][16 · blocks of the group][4] bytes with VNNI, else floats as
// [group][tap][input channel][16 · blocks of the group].
//
// With VNNI, up to eight channels that are left over after blocks of sixteen are QUADS of four, a vector each: four
// output channels times sixteen input channels, whose partial sums are added up in the end. Their weights follow, as
// [quad][tap][sixteen input channels][4][16] bytes.

#include "convolution_int8.clh"

#if QUADS > 0
#define CHANNELS ((CIN + 15) / 16 * 16)
#define BLOCKS (COUT / 16)
#else
#define CHANNELS ((CIN + 3) / 4 * 4)
#define BLOCKS OUT_BLOCKS
#endif
#define TAPS (KERNEL * KERNEL)
#define PATCH_PIXELS (PIXELS + KERNEL - 1)
#define PATCH_ROWS (ROWS + KERNEL - 1)
#define PATCH_ROW (PATCH_PIXELS * CHANNELS)

#ifdef VNNI
typedef uchar operand;
#define OPERANDS4(to, v) *(local uchar4*)(to) = (v)
#define OPERANDS16(to, v) *(local uchar16_anywhere*)(to) = (v)
// Vectors of weights for a tap.
#define STEPS ((CIN + 3) / 4)
typedef int16 sums;
typedef int scalar;
// Four products of bytes each, numbers' times weights'. Registers only: with operands in memory the compiler spills.
INLINE sums add_products_of(sums sum, int16 numbers, int16 weights) {
    __asm__("vpdpbusd %2, %1, %0" : "+v"(sum) : "v"(numbers), "v"(weights));
    return sum;
}
INLINE sums add_products(sums sum, int number, int16 weights) { return add_products_of(sum, (int16)(number), weights); }
#define FIRST_SUMS(bias) (bias)
#define LAST_SUMS(sum, bias) (sum)
#else
typedef float operand;
#define OPERANDS4(to, v) vstore4(convert_float4(v), 0, to)
#define OPERANDS16(to, v) vstore16(convert_float16(v), 0, to)
#define STEPS CIN
typedef float16 sums;
typedef float scalar;
INLINE sums add_products(sums sum, float number, float16 weight) { return MAD((float16)(number), weight, sum); }
#define FIRST_SUMS(bias) 0.0f
#define LAST_SUMS(sum, bias) (convert_int16(sum) + (bias))
#endif
#define PIXEL_STEP (CHANNELS * (int)sizeof(operand) / 4)

// A part's channels of the input pixel (x, y), which is inside.
INLINE void stage_part(INPUT_PARAMETERS int part, int channels, int x, int y, float inverse_scale, int zero_point,
                       local operand* to) {
#define STAGE_PART(P)                                                                  \
    if (part == P) {                                                                   \
        int c = 0;                                                                     \
        for (; c + 16 <= channels; c += 16) OPERANDS16(to + c, NUMBER_16(P, x, y, c)); \
        for (; c < channels; c += 4) OPERANDS4(to + c, NUMBER_4(P, x, y, c));          \
    }
    EACH_PART(STAGE_PART)
}

INLINE void stage_pixel(INPUT_PARAMETERS int x, int y, float inverse_scale, int zero_point, local operand* to) {
    if (INSIDE(IN, x, y)) {
#define STAGE(P) stage_part(INPUT P, PART##P##_CHANNELS, x, y, inverse_scale, zero_point, to + PART##P##_FIRST);
        EACH_PART(STAGE)
    } else {
        for (int c = 0; c < CHANNELS; ++c) to[c] = zero_point;
    }
}

INLINE void stage(INPUT_PARAMETERS int x, int y, float inverse_scale, int zero_point, local operand* patch) {
    for (int r = 0; r < PATCH_ROWS; ++r, patch += PATCH_ROW) {
#if defined(VNNI) && defined(INPUT_BYTES) && PART0_STRIDE == CHANNELS
        // Pixels as they follow each other; what is beyond the patch's row is overwritten, or not read.
        if (INSIDE(IN, x, y + r) && x + PATCH_PIXELS <= IN_WIDTH) {
            global const uchar* row = in0 + AT(PART0, x, y + r, 0);
            for (int i = 0; i < PATCH_ROW; i += 16)
                *(local uchar16_anywhere*)(patch + i) = *(global const uchar16_anywhere*)(row + i);
            continue;
        }
#endif
        for (int p = 0; p < PATCH_PIXELS; ++p)
            stage_pixel(INPUT x + p, y + r, inverse_scale, zero_point, patch + p * CHANNELS);
    }
}

// Ahead of its use, with each tap a share of what comes next: the pixels of the next row that will be written, and a
// new row of the strip below.
INLINE void prefetch_share(INPUT_PARAMETERS global result_storage* out, int x, int y, int tap) {
    prefetch_input(INPUT x - KERNEL / 2, y + ROWS + KERNEL / 2, PATCH_PIXELS, tap, TAPS);
    const int line = 64 / sizeof(result_storage), lines = (PIXELS * OUT_STRIDE / line + TAPS) / TAPS;
    global result_storage* first = out + AT(OUT, x, y + 1, 0) + tap * lines * line;
    for (int i = 0; i < lines; ++i) PREFETCH_TO_WRITE(first + i * line);
}

// `blocks` blocks of sixteen channels, from `block` on, of the pixels from (x, y) on whose input is `patch`.
INLINE void convolve_row(INPUT_PARAMETERS local const operand* patch, global const int* packed,
                         global result_storage* out, int x, int y, int block, int blocks) {
    sums sum[PIXELS][GROUP];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p)
#pragma unroll
        for (int o = 0; o < blocks; ++o) sum[p][o] = FIRST_SUMS(vload16(block + o, BIASES(packed)));
    global const scalar* weights = (global const scalar*)WEIGHTS(packed) + block * 16 * TAPS * STEPS;
    for (int ky = 0; ky < KERNEL; ++ky) {
        for (int kx = 0; kx < KERNEL; ++kx) {
            if (block == 0) prefetch_share(INPUT out, x, y, KERNEL * ky + kx);
            local const scalar* tap = (local const scalar*)(patch + ky * PATCH_ROW + kx * CHANNELS);
            for (int c = 0; c < STEPS; ++c, weights += 16 * blocks)
#pragma unroll
                for (int p = 0; p < PIXELS; ++p)
#pragma unroll
                    for (int o = 0; o < blocks; ++o)
                        sum[p][o] = add_products(sum[p][o], tap[p * PIXEL_STEP + c], vload16(o, weights));
        }
    }
#pragma unroll
    for (int p = 0; p < PIXELS; ++p)
        if (x + p < OUT_WIDTH)
#pragma unroll
            for (int o = 0; o < blocks; ++o)
                store_sums(LAST_SUMS(sum[p][o], vload16(block + o, BIASES(packed))), block + o, packed, out,
                           AT(OUT, x + p, y, 16 * (block + o)));
}

#if QUADS > 0
// The channels left over.
INLINE void convolve_quads(INPUT_PARAMETERS local const uchar* patch, global const int* packed,
                           global result_storage* out, int x, int y) {
    int16 sum[PIXELS][QUADS];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p)
#pragma unroll
        for (int q = 0; q < QUADS; ++q) sum[p][q] = 0;
    global const int* weights = WEIGHTS(packed) + BLOCKS * 16 * TAPS * STEPS;
    const int quad = TAPS * CHANNELS;
    for (int ky = 0; ky < KERNEL; ++ky) {
        for (int kx = 0; kx < KERNEL; ++kx) {
            if (BLOCKS == 0) prefetch_share(INPUT out, x, y, KERNEL * ky + kx);
            local const uchar* tap = patch + ky * PATCH_ROW + kx * CHANNELS;
            for (int c = 0; c < CHANNELS; c += 16, weights += 16)
#pragma unroll
                for (int p = 0; p < PIXELS; ++p) {
                    const int4 numbers = as_int4(*(local const uchar16*)(tap + p * CHANNELS + c));
                    const int16 four = (int16)(numbers, numbers, numbers, numbers);
#pragma unroll
                    for (int q = 0; q < QUADS; ++q)
                        sum[p][q] = add_products_of(sum[p][q], four, vload16(0, weights + q * quad));
                }
        }
    }
#pragma unroll
    for (int p = 0; p < PIXELS; p += 4)
#pragma unroll
        for (int q = 0; q < QUADS; ++q) {
            float16 pixels[4];
#pragma unroll
            for (int i = 0; i < 4; ++i) pixels[i] = as_float16(sum[p + i][q]);
            transpose(pixels);
            const int16 by_channel =
                as_int16(pixels[0]) + as_int16(pixels[1]) + as_int16(pixels[2]) + as_int16(pixels[3]);
            const int16 by_pixel = by_channel.s048c159d26ae37bf;
            const int first = 16 * BLOCKS + 4 * q;
            store_quads(sizes, by_pixel, first, packed, out, x + p, y);
        }
}
#endif

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const int* restrict packed_sets, global result_storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local operand patch[PATCH_ROWS * PATCH_ROW + 64] __attribute__((aligned(64)));
    const int x = (int)get_global_id(1) * PIXELS, y = ROW_ITEM(0) * ROWS;
    global const int* packed = packed_sets + packed_offset;
    stage(INPUT x - KERNEL / 2, y - KERNEL / 2, HEAD_INVERSE_SCALE(packed), HEAD_ZERO_POINT(packed), patch);
    const int rows = min(ROWS, OUT_HEIGHT - y);
    int block = 0;
    for (; block + GROUP <= BLOCKS; block += GROUP)
        for (int r = 0; r < rows; ++r) convolve_row(INPUT patch + r * PATCH_ROW, packed, out, x, y + r, block, GROUP);
    if (BLOCKS % GROUP)
        for (int r = 0; r < rows; ++r)
            convolve_row(INPUT patch + r * PATCH_ROW, packed, out, x, y + r, block, BLOCKS % GROUP);
#if QUADS > 0
    for (int r = 0; r < rows; ++r) convolve_quads(INPUT patch + r * PATCH_ROW, packed, out, x, y + r);
#endif
}
