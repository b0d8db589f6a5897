// Convolution in register tiles, for devices with wide vectors: a work-item stages the input of ROWS rows of PIXELS
// output pixels, zero outside the image, and keeps GROUP blocks of sixteen channels of one row's pixels in registers. A
// step of the innermost loop is GROUP loads of weights, PIXELS broadcasts of an input, PIXELS · GROUP multiply–adds.
//
// With BF16, inputs and weights are rounded to bfloat16, and a step is of two input channels, whose products are summed
// in float by x86's vdpbf16ps.
//
// Options: CIN, COUT, KERNEL (odd), ACTIVATION, the input (convolution_input.clh), layout OUT, PIXELS, ROWS, GROUP,
// BF16, WG_X, WG_Y (both 1: staging is not shared). Work-items: (⌈height / ROWS⌉, ⌈width / PIXELS⌉). A set of packed
// weights takes 16 · ⌈COUT / 16⌉ · (1 + KERNEL² · STEPS) floats: biases, then [group][tap][step][16 · blocks of the
// group], with BF16 pairs of weights.

#include "convolution_input.clh"

#define OUT_BLOCKS ((COUT + 15) / 16)
#define CHANNELS ((CIN + 3) / 4 * 4)
#define TAPS (KERNEL * KERNEL)
#define PATCH_PIXELS (PIXELS + KERNEL - 1)
#define PATCH_ROWS (ROWS + KERNEL - 1)
#define PATCH_ROW (PATCH_PIXELS * CHANNELS)
#define LINE (64 / (int)sizeof(storage))

#ifdef BF16
typedef ushort operand;
typedef uint step_operands;
typedef ushort16 __attribute__((aligned(8))) ushort16_in_fours;  // PoCL's vstore16 stores one after another
#define STEPS ((CIN + 1) / 2)
#define STEP_WEIGHTS(block, weights) vload16(block, (global const uint*)(weights))
// Rounded half to even. Registers only: with operands in memory the compiler spills.
INLINE ushort16 rounded16(float16 v) {
    ushort16 result;
    __asm__("vcvtneps2bf16 %1, %0" : "=v"(result) : "v"(v));
    return result;
}
INLINE ushort4 rounded4(float4 v) {
    ushort8 result;
    __asm__("vcvtneps2bf16 %1, %0" : "=v"(result) : "v"(v));
    return result.lo;
}
// Channels past the last meet weights of 0, and are to be no NaN.
INLINE void stage4(float4 v, int channels, local operand* to) {
    const int4 lanes = (int4)(0, 1, 2, 3);
    *(local ushort4*)to = rounded4(channels < 4 ? select((float4)(0), v, lanes < channels) : v);
}
INLINE void stage16(float16 v, local operand* to) { *(local ushort16_in_fours*)to = rounded16(v); }
INLINE float16 add_products(uint inputs, uint16 weights, float16 sum) {
    __asm__("vdpbf16ps %2, %1, %0" : "+v"(sum) : "v"((uint16)(inputs)), "v"(weights));
    return sum;
}
#else
typedef float operand;
typedef float step_operands;
#define STEPS CIN
#define STEP_WEIGHTS(block, weights) vload16(block, weights)
INLINE void stage4(float4 v, int channels, local operand* to) { vstore4(v, 0, to); }
INLINE void stage16(float16 v, local operand* to) { vstore16(v, 0, to); }
INLINE float16 add_products(float input, float16 weights, float16 sum) { return MAD((float16)(input), weights, sum); }
#endif
#define PIXEL_STEP (CHANNELS * (int)sizeof(operand) / 4)

// A part's channels of the input pixel (x, y), if it is `inside`.
INLINE void stage_part(INPUT_PARAMETERS int part, int channels, int x, int y, int inside, local operand* to) {
    int c = 0;
    for (; c + 16 <= channels; c += 16) stage16(inside ? read16(INPUT part, x, y, c, 1) : (float16)(0), to + c);
    for (; c < channels; c += 4) stage4(inside ? read4(INPUT part, x, y, c, 1) : (float4)(0), channels - c, to + c);
}

INLINE void stage(INPUT_PARAMETERS int x, int y, local operand* patch) {
    for (int r = 0; r < PATCH_ROWS; ++r) {
        for (int p = 0; p < PATCH_PIXELS; ++p, patch += CHANNELS) {
            const int inside = INSIDE(IN, x + p, y + r);
#define STAGE(P) stage_part(INPUT P, PART##P##_CHANNELS, x + p, y + r, inside, patch + PART##P##_FIRST);
            EACH_PART(STAGE)
        }
    }
}

// Ahead of its use, with each tap a share of what comes next: the pixels of the next row that will be written, and once
// for all blocks, a new row of the strip below.
INLINE void prefetch_share(INPUT_PARAMETERS global storage* out, int x, int y, int tap, int block, int blocks) {
    if (block == 0) prefetch_input(INPUT x - KERNEL / 2, y + ROWS + KERNEL / 2, PATCH_PIXELS, tap, TAPS);
    const int pixels = (PIXELS + TAPS - 1) / TAPS;
    global storage* first = out + AT(OUT, x + tap * pixels, y + 1, 16 * block);
#pragma unroll
    for (int p = 0; p < pixels; ++p)
        for (int c = 0; c < 16 * blocks; c += LINE) PREFETCH_TO_WRITE(first + p * OUT_STRIDE + c);
}

// `blocks` blocks of sixteen channels, from `block` on, of the pixels from (x, y) on whose input is `patch`.
INLINE void convolve_row(INPUT_PARAMETERS local const operand* patch, global const float* bias,
                         global const float* weights, global storage* out, int x, int y, int block, int blocks) {
    float16 sum[PIXELS][GROUP];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p)
#pragma unroll
        for (int o = 0; o < blocks; ++o) sum[p][o] = vload16(block + o, bias);
    for (int ky = 0; ky < KERNEL; ++ky) {
        for (int kx = 0; kx < KERNEL; ++kx) {
            prefetch_share(INPUT out, x, y, KERNEL * ky + kx, block, blocks);
            local const step_operands* tap = (local const step_operands*)(patch + ky * PATCH_ROW + kx * CHANNELS);
            for (int c = 0; c < STEPS; ++c, weights += 16 * blocks)
#pragma unroll
                for (int p = 0; p < PIXELS; ++p)
#pragma unroll
                    for (int o = 0; o < blocks; ++o)
                        sum[p][o] = add_products(tap[p * PIXEL_STEP + c], STEP_WEIGHTS(o, weights), sum[p][o]);
        }
    }
#pragma unroll
    for (int p = 0; p < PIXELS; ++p)
        if (x + p < OUT_WIDTH)
#pragma unroll
            for (int o = 0; o < blocks; ++o)
                store_channels(ACTIVATE(sum[p][o]), COUT % 16 && block + o == COUT / 16 ? COUT % 16 : 16, out,
                               AT(OUT, x + p, y, 16 * (block + o)));
}

INLINE void convolve(INPUT_PARAMETERS local const operand* patch, global const float* bias, global const float* weights,
                     global storage* out, int x, int y, int block, int blocks) {
    for (int r = 0; r < min(ROWS, OUT_HEIGHT - y); ++r)
        convolve_row(INPUT patch + r * PATCH_ROW, bias, weights + block * 16 * TAPS * STEPS, out, x, y + r, block,
                     blocks);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const float* restrict packed, global storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local operand patch[PATCH_ROWS * PATCH_ROW] __attribute__((aligned(64)));
    const int x = (int)get_global_id(1) * PIXELS, y = ROW_ITEM(0) * ROWS;
    global const float* bias = packed + packed_offset;
    global const float* weights = bias + 16 * OUT_BLOCKS;
    stage(INPUT x - KERNEL / 2, y - KERNEL / 2, patch);
    int block = 0;
    for (; block + GROUP <= OUT_BLOCKS; block += GROUP) convolve(INPUT patch, bias, weights, out, x, y, block, GROUP);
    if (OUT_BLOCKS % GROUP) convolve(INPUT patch, bias, weights, out, x, y, block, OUT_BLOCKS % GROUP);
}
