// Convolution for devices with many work-items: a group computes a tile of WG_X · PIXELS by WG_Y pixels. It stages the
// tile's input, CHUNK channels at a time and zero outside the image, in local memory as planes, so that neighbouring
// work-items read neighbouring words; each sums PIXELS pixels of sixteen output channels. Weights are the same for all
// work-items at any time, so that a device may read them once for all. Of a zero-upsampled part, most of which is
// empty, every pixel takes the taps that fall on a sample: the part's share is the convolution of each phase of the
// pixels over the samples alone.
//
// Options: CIN, COUT, KERNEL (odd), ACTIVATION, the input (convolution_input.clh), layout OUT, PIXELS, CHUNK (a
// multiple of 4), WG_X, WG_Y; HALF for products and a chunk's sums in half, which STORE_HALF and the device must have.
// Sums over chunks are in float: 72 terms lose little in half, 576 would lose a digit. Work-items: (⌈width / PIXELS⌉,
// height). A set of packed weights takes the room of 16 · ⌈COUT / 16⌉ · (1 + KERNEL² · CIN) floats: biases, then
// operands as [block][input channel][tap][16].

#include "convolution_input.clh"

#define OUT_BLOCKS ((COUT + 15) / 16)
#define TILE_WIDTH (WG_X * PIXELS)
#define TAPS (KERNEL * KERNEL)
#define PATCH_WIDTH (TILE_WIDTH + KERNEL - 1)
#define PLANE ((WG_Y + KERNEL - 1) * PATCH_WIDTH)

#ifdef HALF
#pragma OPENCL EXTENSION cl_khr_fp16 : enable
typedef half operand;
typedef half4 operand4;
typedef half16 operand16;
#define OPERAND4(v) convert_half4(v)
#define SUM16(v) convert_float16(v)
#else
typedef float operand;
typedef float4 operand4;
typedef float16 operand16;
#define OPERAND4(v) (v)
#define SUM16(v) (v)
#endif

// Channels c to c + 3 of the input; those of a part begin at multiples of four.
INLINE float4 quad(INPUT_PARAMETERS int x, int y, int c) {
#define QUAD(P) \
    if (c < PART##P##_FIRST + PART##P##_CHANNELS) return read4(INPUT P, x, y, c - PART##P##_FIRST, 1);
    EACH_PART(QUAD)
    return 0.0f;
}

// The patch whose corner is at (x, y), channels from `first` on.
INLINE void stage(INPUT_PARAMETERS int x, int y, int first, local operand* patch) {
    const int item = (int)get_local_id(1) * WG_X + (int)get_local_id(0);
    for (int i = item; i < CHUNK / 4 * PLANE; i += WG_X * WG_Y) {
        const int c = 4 * (i / PLANE), px = x + i % PLANE % PATCH_WIDTH, py = y + i % PLANE / PATCH_WIDTH;
        const operand4 v =
            INSIDE(IN, px, py) && first + c < DENSE_CIN ? OPERAND4(quad(INPUT px, py, first + c)) : (operand4)(0);
        local operand* to = patch + c * PLANE + i % PLANE;
        to[0] = v.s0;
        to[PLANE] = v.s1;
        to[2 * PLANE] = v.s2;
        to[3 * PLANE] = v.s3;
    }
}

// Adds what `channels` channels of the patch contribute; `pixel` is the corner of the work-item's first pixel's taps.
INLINE void add_chunk(local const operand* pixel, int channels, global const operand* weight, operand16* sum) {
    for (int c = 0; c < channels; ++c)
        for (int tap = 0; tap < TAPS; ++tap, weight += 16) {
            const operand16 w = vload16(0, weight);
            local const operand* v = pixel + c * PLANE + tap / KERNEL * PATCH_WIDTH + tap % KERNEL;
#pragma unroll
            for (int p = 0; p < PIXELS; ++p) sum[p] = MAD((operand16)(v[p * WG_X]), w, sum[p]);
        }
}

#define ON_SAMPLE(part, x, y) IS_SAMPLE(part, x, y)  // of a part whose number is a macro

// What the samples around pixel (x, y) give to sixteen output channels.
INLINE float16 samples_share(INPUT_PARAMETERS int x, int y, global const operand* weights) {
    float16 sum = 0.0f;
#if DENSE_CIN < CIN
    for (int tap = 0; tap < TAPS; ++tap, weights += 16) {
        const int px = x + tap % KERNEL - KERNEL / 2, py = y + tap / KERNEL - KERNEL / 2, clamped = 1;
        if (!INSIDE(IN, px, py) || !ON_SAMPLE(SAMPLES_PART, px, py)) continue;
        for (int c = 0; c < CIN - DENSE_CIN; ++c)
            sum = MAD((float16)(read1(INPUT SAMPLES_PART, px, py, c, 1)), SUM16(vload16(TAPS * c, weights)), sum);
    }
#endif
    return sum;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const float* restrict packed, global storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local operand patch[CHUNK * PLANE];
    const int lx = get_local_id(0), ly = get_local_id(1);
    const int tile_x = ((int)get_global_id(0) - lx) * PIXELS, tile_y = ROW_ITEM(1) - ly;
    global const float* bias = packed + packed_offset;
    global const operand* weights = (global const operand*)(bias + 16 * OUT_BLOCKS);
    for (int block = 0; block < OUT_BLOCKS; ++block, weights += 16 * TAPS * CIN) {
        float16 sum[PIXELS];
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) sum[p] = vload16(block, bias);
        for (int first = 0; first < DENSE_CIN; first += CHUNK) {
            const int channels = min(CHUNK, DENSE_CIN - first);
            global const operand* weight = weights + 16 * TAPS * first;
            barrier(CLK_LOCAL_MEM_FENCE);
            stage(INPUT tile_x - KERNEL / 2, tile_y - KERNEL / 2, first, patch);
            barrier(CLK_LOCAL_MEM_FENCE);
#ifdef HALF
            half16 part[PIXELS];
#pragma unroll
            for (int p = 0; p < PIXELS; ++p) part[p] = 0;
            add_chunk(patch + ly * PATCH_WIDTH + lx, channels, weight, part);
#pragma unroll
            for (int p = 0; p < PIXELS; ++p) sum[p] += convert_float16(part[p]);
#else
            add_chunk(patch + ly * PATCH_WIDTH + lx, channels, weight, sum);
#endif
        }
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) {
            const int x = tile_x + lx + p * WG_X, y = tile_y + ly;
            if (!INSIDE(OUT, x, y)) continue;
            sum[p] += samples_share(INPUT x, y, weights + 16 * TAPS * DENSE_CIN);
            store_channels(ACTIVATE(sum[p]), min(16, COUT - 16 * block), out, AT(OUT, x, y, 16 * block));
        }
    }
}
