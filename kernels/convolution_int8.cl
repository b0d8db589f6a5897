// Convolution in whole numbers in register tiles, for devices with wide vectors: a work-item stages the input of ROWS
// rows of PIXELS output pixels as numbers, the zero point outside the image, and keeps GROUP blocks of sixteen channels
// of one row's pixels in registers. With VNNI, a step of the innermost loop multiplies and adds four input channels of
// PIXELS pixels. Without, one, in float: the host sees to it that no sum reaches 2^24, so that it is exact.
//
// Options: CIN, COUT, KERNEL (odd), PIXELS, ROWS, GROUP, VNNI, WG_X, WG_Y (both 1: staging is not shared), and those of
// convolution_int8.clh. Work-items: (⌈height / ROWS⌉, ⌈width / PIXELS⌉). Packed biases are without what the zero point
// adds; weights are [group][tap][four input channels][16 · blocks of the group][4] bytes with VNNI, else floats as
// [group][tap][input channel][16 · blocks of the group].

#include "convolution_int8.clh"

#define CHANNELS ((CIN + 3) / 4 * 4)
#define TAPS (KERNEL * KERNEL)
#define PATCH_PIXELS (PIXELS + KERNEL - 1)
#define PATCH_ROWS (ROWS + KERNEL - 1)
#define PATCH_ROW (PATCH_PIXELS * CHANNELS)

#ifdef VNNI
typedef uchar operand;
#define OPERAND4(v) (v)
#define OPERAND16(v) (v)
// Vectors of weights for a tap.
#define STEPS (CHANNELS / 4)
typedef int16 sums;
typedef int scalar;
// Four products of bytes each, numbers' times weights'. Registers only: with operands in memory the compiler spills.
INLINE sums add_products(sums sum, int number, int16 weight) {
    __asm__("vpdpbusd %2, %1, %0" : "+v"(sum) : "v"((int16)(number)), "v"(weight));
    return sum;
}
#define FIRST_SUMS(bias) (bias)
#define LAST_SUMS(sum, bias) (sum)
#else
typedef float operand;
#define OPERAND4(v) convert_float4(v)
#define OPERAND16(v) convert_float16(v)
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
#define STAGE_PART(P)                                                                              \
    if (part == P) {                                                                               \
        int c = 0;                                                                                 \
        for (; c + 16 <= channels; c += 16) vstore16(OPERAND16(NUMBER_16(P, x, y, c)), 0, to + c); \
        for (; c < channels; c += 4) vstore4(OPERAND4(NUMBER_4(P, x, y, c)), 0, to + c);           \
    }
    EACH_PART(STAGE_PART)
}

INLINE void stage(INPUT_PARAMETERS int x, int y, float inverse_scale, int zero_point, local operand* patch) {
    for (int r = 0; r < PATCH_ROWS; ++r) {
        for (int p = 0; p < PATCH_PIXELS; ++p, patch += CHANNELS) {
            if (INSIDE(IN, x + p, y + r)) {
#define STAGE(P) \
    stage_part(INPUT P, PART##P##_CHANNELS, x + p, y + r, inverse_scale, zero_point, patch + PART##P##_FIRST);
                EACH_PART(STAGE)
            } else {
                for (int c = 0; c < CHANNELS; ++c) patch[c] = zero_point;
            }
        }
    }
}

// `blocks` blocks of sixteen channels, from `block` on, of the pixels from (x, y) on whose input is `patch`.
INLINE void convolve_row(const Sizes* sizes, local const operand* patch, global const int* packed,
                         global result_storage* out, int x, int y, int block, int blocks) {
    sums sum[PIXELS][GROUP];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p)
#pragma unroll
        for (int o = 0; o < blocks; ++o) sum[p][o] = FIRST_SUMS(vload16(block + o, BIASES(packed)));
    global const scalar* weights = (global const scalar*)WEIGHTS(packed) + block * 16 * TAPS * STEPS;
    for (int ky = 0; ky < KERNEL; ++ky) {
        for (int kx = 0; kx < KERNEL; ++kx) {
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

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const int* restrict packed_sets, global result_storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local operand patch[PATCH_ROWS * PATCH_ROW] __attribute__((aligned(64)));
    const int x = (int)get_global_id(1) * PIXELS, y = ROW_ITEM(0) * ROWS;
    global const int* packed = packed_sets + packed_offset;
    stage(INPUT x - KERNEL / 2, y - KERNEL / 2, HEAD_INVERSE_SCALE(packed), HEAD_ZERO_POINT(packed), patch);
    const int rows = min(ROWS, OUT_HEIGHT - y);
    int block = 0;
    for (; block + GROUP <= OUT_BLOCKS; block += GROUP)
        for (int r = 0; r < rows; ++r) convolve_row(sizes, patch + r * PATCH_ROW, packed, out, x, y + r, block, GROUP);
    if (OUT_BLOCKS % GROUP)
        for (int r = 0; r < rows; ++r)
            convolve_row(sizes, patch + r * PATCH_ROW, packed, out, x, y + r, block, OUT_BLOCKS % GROUP);
}
