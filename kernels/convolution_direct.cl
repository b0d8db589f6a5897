// Convolution in register tiles, for devices with wide vectors: a work-item stages the input of ROWS rows of PIXELS
// output pixels, zero outside the image, and keeps GROUP blocks of sixteen channels of one row's pixels in registers. A
// step of the innermost loop is GROUP loads of weights, PIXELS broadcasts of an input, PIXELS · GROUP multiply–adds.
//
// Options: CIN, COUT, KERNEL (odd), ACTIVATION, the input (convolution_input.clh), layout OUT, PIXELS, ROWS, GROUP,
// WG_X, WG_Y (both 1: staging is not shared). Work-items: (⌈height / ROWS⌉, ⌈width / PIXELS⌉). A set of packed weights
// takes 16 · ⌈COUT / 16⌉ · (1 + KERNEL² · CIN) floats: biases, then [group][tap][input channel][16 · blocks of the
// group].

#include "convolution_input.clh"

#define OUT_BLOCKS ((COUT + 15) / 16)
#define CHANNELS ((CIN + 3) / 4 * 4)
#define TAPS (KERNEL * KERNEL)
#define PATCH_PIXELS (PIXELS + KERNEL - 1)
#define PATCH_ROWS (ROWS + KERNEL - 1)
#define PATCH_ROW (PATCH_PIXELS * CHANNELS)
#define LINE (64 / (int)sizeof(storage))

// A part's channels of the input pixel (x, y), if it is `inside`.
INLINE void stage_part(INPUT_PARAMETERS int part, int channels, int x, int y, int inside, local float* to) {
    int c = 0;
    for (; c + 16 <= channels; c += 16) {
        const float16 v = inside ? read16(INPUT part, x, y, c, 1) : (float16)(0);
        vstore16(v, 0, to + c);
    }
    for (; c < channels; c += 4) {
        const float4 v = inside ? read4(INPUT part, x, y, c, 1) : (float4)(0);
        vstore4(v, 0, to + c);
    }
}

INLINE void stage(INPUT_PARAMETERS int x, int y, local float* patch) {
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
INLINE void convolve_row(INPUT_PARAMETERS local const float* patch, global const float* bias,
                         global const float* weights, global storage* out, int x, int y, int block, int blocks) {
    float16 sum[PIXELS][GROUP];
#pragma unroll
    for (int p = 0; p < PIXELS; ++p)
#pragma unroll
        for (int o = 0; o < blocks; ++o) sum[p][o] = vload16(block + o, bias);
    for (int ky = 0; ky < KERNEL; ++ky) {
        for (int kx = 0; kx < KERNEL; ++kx) {
            prefetch_share(INPUT out, x, y, KERNEL * ky + kx, block, blocks);
            local const float* tap = patch + ky * PATCH_ROW + kx * CHANNELS;
            for (int c = 0; c < CIN; ++c, weights += 16 * blocks)
#pragma unroll
                for (int p = 0; p < PIXELS; ++p)
#pragma unroll
                    for (int o = 0; o < blocks; ++o)
                        sum[p][o] = MAD((float16)(tap[p * CHANNELS + c]), vload16(o, weights), sum[p][o]);
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

INLINE void convolve(INPUT_PARAMETERS local const float* patch, global const float* bias, global const float* weights,
                     global storage* out, int x, int y, int block, int blocks) {
    for (int r = 0; r < min(ROWS, OUT_HEIGHT - y); ++r)
        convolve_row(INPUT patch + r * PATCH_ROW, bias, weights + block * 16 * TAPS * CIN, out, x, y + r, block,
                     blocks);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const float* restrict packed, global storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local float patch[PATCH_ROWS * PATCH_ROW] __attribute__((aligned(64)));
    const int x = (int)get_global_id(1) * PIXELS, y = ROW_ITEM(0) * ROWS;
    global const float* bias = packed + packed_offset;
    global const float* weights = bias + 16 * OUT_BLOCKS;
    stage(INPUT x - KERNEL / 2, y - KERNEL / 2, patch);
    int block = 0;
    for (; block + GROUP <= OUT_BLOCKS; block += GROUP) convolve(INPUT patch, bias, weights, out, x, y, block, GROUP);
    if (OUT_BLOCKS % GROUP) convolve(INPUT patch, bias, weights, out, x, y, block, OUT_BLOCKS % GROUP);
}
