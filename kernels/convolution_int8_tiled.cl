// Convolution in whole numbers for devices with many work-items: a group computes a tile of WG_X · PIXELS by WG_Y
// pixels. It stages the tile's input, CHUNK channels at a time and the zero point outside the image, in local memory as
// planes of four channels' numbers a word, so that neighbouring work-items read neighbouring words; each sums PIXELS
// pixels of sixteen output channels. Weights are the same for all work-items at any time, so that a device may read
// them once for all.
//
// Options: CIN, COUT, KERNEL (odd), PIXELS, CHUNK (a multiple of 4), WG_X, WG_Y, and those of convolution_int8.clh and
// int8_products.clh. Work-items: (⌈width / PIXELS⌉, height). Packed biases are without what the zero point adds;
// weights are [block][four input channels][tap][16][4] bytes.

#include "convolution_int8.clh"
#include "int8_products.clh"

#define QUADS_IN ((CIN + 3) / 4)
#define TAPS (KERNEL * KERNEL)
#define TILE_WIDTH (WG_X * PIXELS)
#define PATCH_WIDTH (TILE_WIDTH + KERNEL - 1)
#define PLANE ((WG_Y + KERNEL - 1) * PATCH_WIDTH)

// Numbers of channels c to c + 3 of a pixel inside the input; those of a part begin at multiples of four.
INLINE uint quad(INPUT_PARAMETERS int x, int y, int c, float inverse_scale, int zero_point) {
#define QUAD(P)                                              \
    if (c < PART##P##_FIRST + PART##P##_CHANNELS) {          \
        const int within = c - PART##P##_FIRST;              \
        return as_uint((uchar4)(NUMBER_4(P, x, y, within))); \
    }
    EACH_PART(QUAD)
    return 0;
}

// The patch whose corner is at (x, y), fours of channels from `first` on.
INLINE void stage(INPUT_PARAMETERS int x, int y, int first, float inverse_scale, int zero_point, local uint* patch) {
    const int item = (int)get_local_id(1) * WG_X + (int)get_local_id(0);
    const uint outside = zero_point * 0x01010101u;
    for (int i = item; i < CHUNK / 4 * PLANE; i += WG_X * WG_Y) {
        const int c = 4 * (first + i / PLANE);
        const int px = x + i % PLANE % PATCH_WIDTH, py = y + i % PLANE / PATCH_WIDTH;
        patch[i] = INSIDE(IN, px, py) && c < CIN ? quad(INPUT px, py, c, inverse_scale, zero_point) : outside;
    }
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const int* restrict packed_sets, global result_storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local uint patch[CHUNK / 4 * PLANE];
    const int lx = get_local_id(0), ly = get_local_id(1);
    const int tile_x = ((int)get_global_id(0) - lx) * PIXELS, tile_y = ROW_ITEM(1) - ly;
    global const int* packed = packed_sets + packed_offset;
    const float inverse_scale = HEAD_INVERSE_SCALE(packed);
    const int zero_point = HEAD_ZERO_POINT(packed);
    global const int* weight = WEIGHTS(packed);
    for (int block = 0; block < OUT_BLOCKS; ++block) {
        int16 sum[PIXELS];
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) sum[p] = vload16(block, BIASES(packed));
        for (int first = 0; first < QUADS_IN; first += CHUNK / 4) {
            barrier(CLK_LOCAL_MEM_FENCE);
            stage(INPUT tile_x - KERNEL / 2, tile_y - KERNEL / 2, first, inverse_scale, zero_point, patch);
            barrier(CLK_LOCAL_MEM_FENCE);
            const int quads = min(CHUNK / 4, QUADS_IN - first);
            for (int c = 0; c < quads; ++c)
                for (int tap = 0; tap < TAPS; ++tap, weight += 16) {
                    const int16 w = vload16(0, weight);
                    local const uint* v = patch + c * PLANE + (ly + tap / KERNEL) * PATCH_WIDTH + lx + tap % KERNEL;
#pragma unroll
                    for (int p = 0; p < PIXELS; ++p) sum[p] = add_products(sum[p], v[p * WG_X], w);
                }
        }
#pragma unroll
        for (int p = 0; p < PIXELS; ++p) {
            const int x = tile_x + lx + p * WG_X, y = tile_y + ly;
            if (INSIDE(OUT, x, y)) store_sums(sum[p], block, packed, out, AT(OUT, x, y, 16 * block));
        }
    }
}
