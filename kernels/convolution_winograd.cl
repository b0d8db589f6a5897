// 3×3 convolution by Winograd's F(4×4, 3×3), the three steps fused: a work-item takes a strip of TILES tiles of 4×4
// output pixels, transforms their 6×6 input patches into local memory, multiplies each of the 36 points by its matrix
// of weights, and transforms the products back. 2.25 multiplications a pixel and channel pair in place of 9. The
// largest error is about 10⁻⁵ of the largest output; a value that is not finite spreads over its tile.
//
// Options: CIN, COUT, ACTIVATION, the input (convolution_input.clh), layout OUT, TILES (a multiple of 4), GROUP (blocks
// of sixteen output channels multiplied at once), WG_X, WG_Y (both 1: scratch is not shared). Work-items: (tile rows,
// strips), which is (⌈height / 4⌉, ⌈⌈width / 4⌉ / TILES⌉).
// A set of packed weights takes 16 · ⌈COUT / 16⌉ + 36 · (16 · CIN · OUT_BLOCKS + OUT_QUAD · QUAD_FLOATS) floats.

#include "convolution_input.clh"

// A part's channels: BLOCKS of sixteen, one to a vector, then the REST, of 16 / REST_LANES tiles to a vector.
#define BLOCKS(channels) ((channels) / 16)
#define REST(channels) ((channels) % 16)
#define REST_LANES(channels) (REST(channels) > 8 ? 16 : REST(channels) > 4 ? 8 : 4)

// Output channels: OUT_BLOCKS of sixteen, the last perhaps part-filled. One to four left over make a quad, for which a
// vector's lanes are four input channels × four output channels: a part's weights take QUAD_VECTORS.
#define OUT_QUAD (COUT % 16 > 0 && COUT % 16 <= 4)
#define OUT_BLOCKS (COUT / 16 + (COUT % 16 > 4))
#define BIAS_FLOATS ((COUT + 15) / 16 * 16)
#define QUAD_VECTORS(channels) (4 * BLOCKS(channels) + REST(channels))
#define PLUS_QUAD_VECTORS(P) +QUAD_VECTORS(PART##P##_CHANNELS)
#define QUAD_FLOATS (16 * (0 EACH_PART(PLUS_QUAD_VECTORS)))
#define PASSES ((OUT_BLOCKS + GROUP - 1) / GROUP + OUT_QUAD)
#define LINE (64 / (int)sizeof(storage))

// Floats of one point: of the patches, for each part, as [block][tile][16] then [tile][REST_LANES], of the products as
// [block][tile][16]. An odd number of 64-byte lines, so that the 36 points of a tile fall into different cache sets.
#define ODD_LINES(floats) (((floats) + 15) / 16 / 2 * 32 + 16)
#define PATCH_POINT ODD_LINES(TILES* LANES)

// A single pass's products may take the place of the patches, so that less cache is used.
#define IN_PLACE (PASSES == 1 && LANES >= 16 * OUT_BLOCKS)
#define PRODUCT_POINT (IN_PLACE ? PATCH_POINT : ODD_LINES(TILES * 16 * GROUP))

// Bᵀd for one row or column of a patch.
INLINE void transform_input(float16* a, float16* b, float16* c, float16* d, float16* e, float16* f) {
    const float16 even = *e - *c, odd = *d - *b;
    const float16 even4 = MAD((float16)(-4), *c, *e), odd4 = MAD((float16)(-4), *b, *d);
    *a = MAD((float16)(4), *a - *c, even);
    *f = MAD((float16)(-4), odd, *f - *d);
    *b = even4 + odd4;
    *c = even4 - odd4;
    *d = MAD((float16)(2), odd, even);
    *e = MAD((float16)(-2), odd, even);
}

// Aᵀm for one row or column of a tile's products.
INLINE void transform_output(float16 a, float16 b, float16 c, float16 d, float16 e, float16 f, float16* out, int step) {
    const float16 sum1 = b + c, difference1 = b - c, sum2 = d + e, difference2 = d - e;
    out[0] = a + sum1 + sum2;
    out[step] = MAD((float16)(2), difference2, difference1);
    out[2 * step] = MAD((float16)(4), sum2, sum1);
    out[3 * step] = MAD((float16)(8), difference2, difference1) + f;
}

// `lanes` channels of a part, of 16 / lanes neighbouring tiles, at the pixel (x, y) of the first; zero outside the
// image. What is not `guarded` is within what all parts have.
INLINE float16 lanes16(INPUT_PARAMETERS int part, int x, int y, int channel, int guarded) {
    if (guarded && !INSIDE(IN, x, y)) return (float16)(0);
    return read16(INPUT part, x, y, channel, guarded);
}
INLINE float8 lanes8(INPUT_PARAMETERS int part, int x, int y, int channel, int guarded) {
    if (guarded && !INSIDE(IN, x, y)) return (float8)(0);
    return read8(INPUT part, x, y, channel, guarded);
}
INLINE float4 lanes4(INPUT_PARAMETERS int part, int x, int y, int channel, int guarded) {
    if (guarded && !INSIDE(IN, x, y)) return (float4)(0);
    return read4(INPUT part, x, y, channel, guarded);
}
INLINE float16 load_lanes(INPUT_PARAMETERS int part, int x, int y, int channel, int lanes, int guarded) {
    if (lanes == 4)
        return (float16)(lanes4(INPUT part, x, y, channel, guarded), lanes4(INPUT part, x + 4, y, channel, guarded),
                         lanes4(INPUT part, x + 8, y, channel, guarded),
                         lanes4(INPUT part, x + 12, y, channel, guarded));
    if (lanes == 8)
        return (float16)(lanes8(INPUT part, x, y, channel, guarded), lanes8(INPUT part, x + 4, y, channel, guarded));
    return lanes16(INPUT part, x, y, channel, guarded);
}

// At the image's border, of any part and number of lanes: few patches are there, and 36 copies of this in each of them
// took a second to compile.
OUTLINE float16 load_lanes_at_border(INPUT_PARAMETERS int part, int x, int y, int channel, int lanes) {
    return load_lanes(INPUT part, x, y, channel, lanes, 1);
}

// The 6×6 patch whose corner is at (x, y), of 16 / lanes tiles.
INLINE void load_patch(INPUT_PARAMETERS int part, int x, int y, int channel, int lanes, int guarded, float16 d[6][6]) {
#pragma unroll
    for (int r = 0; r < 6; ++r)
#pragma unroll
        for (int c = 0; c < 6; ++c)
            d[r][c] = guarded ? load_lanes_at_border(INPUT part, x + c, y + r, channel, lanes)
                              : load_lanes(INPUT part, x + c, y + r, channel, lanes, 0);
}

// The same inside an image that is upsampled: x and y are odd, and the patch comes from 4×4 pixels, three quarters of
// one and one of its neighbour.
INLINE void load_upsampled_patch(INPUT_PARAMETERS int part, int x, int y, int channel, float16 d[6][6]) {
    float16 wide[4][6];
#pragma unroll
    for (int r = 0; r < 4; ++r) {
        float16 s[4];
#pragma unroll
        for (int c = 0; c < 4; ++c) s[c] = stored16(INPUT part, x / 2 + c, y / 2 + r, channel);
#pragma unroll
        for (int c = 0; c < 6; ++c) {
            const float16 near = s[(c + 1) / 2], far = s[c % 2 ? (c - 1) / 2 : c / 2 + 1];
            wide[r][c] = MAD((float16)(FAR_WEIGHT), far - near, near);
        }
    }
#pragma unroll
    for (int c = 0; c < 6; ++c)
#pragma unroll
        for (int r = 0; r < 6; ++r) {
            const float16 near = wide[(r + 1) / 2][c], far = wide[r % 2 ? (r - 1) / 2 : r / 2 + 1][c];
            d[r][c] = MAD((float16)(FAR_WEIGHT), far - near, near);
        }
}

// Transforms the patches of 16 / lanes tiles whose first has its corner at (x, y).
INLINE void transform_patches(INPUT_PARAMETERS int part, int x, int y, int channel, int lanes, local float* patch,
                              int guarded) {
    float16 d[6][6];
    if (is_upsampled(part) && lanes == 16 && !guarded)
        load_upsampled_patch(INPUT part, x, y, channel, d);
    else
        load_patch(INPUT part, x, y, channel, lanes, guarded, d);
#pragma unroll
    for (int r = 0; r < 6; ++r) transform_input(&d[r][0], &d[r][1], &d[r][2], &d[r][3], &d[r][4], &d[r][5]);
#pragma unroll
    for (int c = 0; c < 6; ++c) {
        transform_input(&d[0][c], &d[1][c], &d[2][c], &d[3][c], &d[4][c], &d[5][c]);
#pragma unroll
        for (int r = 0; r < 6; ++r) *(local float16*)(patch + (6 * r + c) * PATCH_POINT) = d[r][c];
    }
}

// The same, compiled once each: for every part and number of lanes inside the image, and at its border, where few
// patches are, for all of them. Copies within the kernel would take several times as long to compile.
#define DEFINE_TRANSFORM(P)                                                                           \
    OUTLINE void transform_whole##P(INPUT_PARAMETERS int x, int y, int channel, local float* patch) { \
        transform_patches(INPUT P, x, y, channel, 16, patch, 0);                                      \
    }                                                                                                 \
    OUTLINE void transform_rest##P(INPUT_PARAMETERS int x, int y, int channel, local float* patch) {  \
        transform_patches(INPUT P, x, y, channel, REST_LANES(PART##P##_CHANNELS), patch, 0);          \
    }
EACH_PART(DEFINE_TRANSFORM)
OUTLINE void transform_at_border(INPUT_PARAMETERS int part, int x, int y, int channel, int lanes, local float* patch) {
    transform_patches(INPUT part, x, y, channel, lanes, patch, 1);
}

INLINE void transform_inside(INPUT_PARAMETERS int part, int x, int y, int channel, int is_rest, local float* patch) {
#define TRANSFORM_CASE(P)                                                    \
    if (part == P && is_rest) transform_rest##P(INPUT x, y, channel, patch); \
    if (part == P && !is_rest) transform_whole##P(INPUT x, y, channel, patch);
    EACH_PART(TRANSFORM_CASE)
}

INLINE void transform_strip(INPUT_PARAMETERS int part, int x, int y, int channel, int lanes, int is_rest, int tiles,
                            local float* patch) {
    const int step = 16 / lanes;
    for (int t = 0; t < tiles; t += step, x += 4 * step, patch += 16) {
        if (x >= 0 && x + 4 * step + 2 <= COMMON_WIDTH && y >= 0 && y + 6 <= COMMON_HEIGHT)
            transform_inside(INPUT part, x, y, channel, is_rest, patch);
        else
            transform_at_border(INPUT part, x, y, channel, lanes, patch);
    }
}

INLINE void transform_part(INPUT_PARAMETERS int part, int channels, int x, int y, int tiles, local float* patches) {
    for (int block = 0; block < BLOCKS(channels); ++block, patches += 16 * TILES)
        transform_strip(INPUT part, x, y, 16 * block, 16, 0, tiles, patches);
    if (REST(channels))
        transform_strip(INPUT part, x, y, 16 * BLOCKS(channels), REST_LANES(channels), 1, tiles, patches);
}

// Adds a part's share to one point's product for `blocks` blocks of sixteen output channels, all its sums in registers.
INLINE void add_part(local const float* patch, global const float* weights, int channels, float16 sum[GROUP][TILES],
                     int blocks) {
    for (int block = 0; block < BLOCKS(channels); ++block, patch += 16 * TILES) {
        for (int c = 0; c < 16; ++c, weights += 16 * blocks)
#pragma unroll
            for (int t = 0; t < TILES; ++t)
#pragma unroll
                for (int o = 0; o < blocks; ++o)
                    sum[o][t] = MAD((float16)(patch[16 * t + c]), vload16(o, weights), sum[o][t]);
    }
    for (int c = 0; c < REST(channels); ++c, weights += 16 * blocks)
#pragma unroll
        for (int t = 0; t < TILES; ++t)
#pragma unroll
            for (int o = 0; o < blocks; ++o)
                sum[o][t] = MAD((float16)(patch[REST_LANES(channels) * t + c]), vload16(o, weights), sum[o][t]);
}

INLINE void multiply(local const float* patch, global const float* weights, local float* product, int blocks) {
    float16 sum[GROUP][TILES];
#pragma unroll
    for (int o = 0; o < blocks; ++o)
#pragma unroll
        for (int t = 0; t < TILES; ++t) sum[o][t] = (float16)(0);
#define ADD(P) \
    add_part(patch + TILES * PART##P##_LANE, weights + 16 * blocks * PART##P##_FIRST, PART##P##_CHANNELS, sum, blocks);
    EACH_PART(ADD)
#pragma unroll
    for (int o = 0; o < blocks; ++o)
#pragma unroll
        for (int t = 0; t < TILES; ++t) ((local float16*)product)[o * TILES + t] = sum[o][t];
}

// The same for the quad of output channels left over: lanes are four input channels × four output channels while
// summing, four tiles × four output channels in the product.
INLINE global const float* add_part_to_quad(local const float* patch, global const float* weights, int channels,
                                            float16 sum[TILES]) {
    for (int block = 0; block < BLOCKS(channels); ++block, patch += 16 * TILES, weights += 64) {
#pragma unroll
        for (int t = 0; t < TILES; ++t) {
            const float16 v = vload16(t, patch);
            sum[t] = MAD(v.s000044448888cccc, vload16(0, weights), sum[t]);
            sum[t] = MAD(v.s111155559999dddd, vload16(1, weights), sum[t]);
            sum[t] = MAD(v.s22226666aaaaeeee, vload16(2, weights), sum[t]);
            sum[t] = MAD(v.s33337777bbbbffff, vload16(3, weights), sum[t]);
        }
    }
    for (int c = 0; c < REST(channels); ++c, weights += 16)
#pragma unroll
        for (int t = 0; t < TILES; ++t)
            sum[t] = MAD((float16)(patch[REST_LANES(channels) * t + c]), vload16(0, weights), sum[t]);
    return weights;
}

INLINE void multiply_quad(local const float* patch, global const float* weights, local float* product) {
    float16 sum[TILES];
#pragma unroll
    for (int t = 0; t < TILES; ++t) sum[t] = (float16)(0);
#define ADD_TO_QUAD(P) weights = add_part_to_quad(patch + TILES * PART##P##_LANE, weights, PART##P##_CHANNELS, sum);
    EACH_PART(ADD_TO_QUAD)
#pragma unroll
    for (int t = 0; t < TILES; t += 4) {
        const float16 ab = (float16)(sum[t].lo, sum[t + 1].lo) + (float16)(sum[t].hi, sum[t + 1].hi);
        const float16 cd = (float16)(sum[t + 2].lo, sum[t + 3].lo) + (float16)(sum[t + 2].hi, sum[t + 3].hi);
        ((local float16*)product)[t / 4] =
            (float16)(ab.s0123, ab.s89ab, cd.s0123, cd.s89ab) + (float16)(ab.s4567, ab.scdef, cd.s4567, cd.scdef);
    }
}

// A tile's 36 products to its 4×4 pixels.
INLINE void transform_products(local const float* product, float16 pixel[16]) {
    float16 m[24];
#pragma unroll
    for (int c = 0; c < 6; ++c) {
        local const float* column = product + c * PRODUCT_POINT;
        transform_output(vload16(0, column), vload16(0, column + 6 * PRODUCT_POINT),
                         vload16(0, column + 12 * PRODUCT_POINT), vload16(0, column + 18 * PRODUCT_POINT),
                         vload16(0, column + 24 * PRODUCT_POINT), vload16(0, column + 30 * PRODUCT_POINT), m + c, 6);
    }
#pragma unroll
    for (int r = 0; r < 4; ++r)
        transform_output(m[6 * r], m[6 * r + 1], m[6 * r + 2], m[6 * r + 3], m[6 * r + 4], m[6 * r + 5], pixel + 4 * r,
                         1);
}

OUTLINE void finish_block(const Sizes* sizes, local const float* product, global const float* bias, global storage* out,
                          int x, int y, int block) {
    float16 pixel[16];
    transform_products(product, pixel);
    const int channels = COUT % 16 > 4 && block == COUT / 16 ? COUT % 16 : 16;
    const int columns = min(4, OUT_WIDTH - x), rows = min(4, OUT_HEIGHT - y);
    const float16 biases = vload16(block, bias);
#pragma unroll
    for (int r = 0; r < 4; ++r) {
        if (r >= rows) break;
        global storage* row = out + AT(OUT, x, y + r, 16 * block);
#pragma unroll
        for (int c = 0; c < 4; ++c)
            if (c < columns) store_channels(ACTIVATE(pixel[4 * r + c] + biases), channels, row, c * OUT_STRIDE);
    }
}

// Four tiles' quads, the first at (x, y).
OUTLINE void finish_quads(const Sizes* sizes, local const float* product, global const float* bias, global storage* out,
                          int x, int y) {
    float16 pixel[16];
    transform_products(product, pixel);
    const int columns = min(16, OUT_WIDTH - x), rows = min(4, OUT_HEIGHT - y);
    const float16 biases = vload16(OUT_BLOCKS, bias).s0123012301230123;
#pragma unroll
    for (int r = 0; r < 4; ++r) {
        if (r >= rows) break;
        global storage* row = out + AT(OUT, x, y + r, 16 * OUT_BLOCKS);
#pragma unroll
        for (int c = 0; c < 4; ++c) {
            const float16 v = ACTIVATE(pixel[4 * r + c] + biases);
            const float4 quad[4] = {v.s0123, v.s4567, v.s89ab, v.scdef};
#pragma unroll
            for (int t = 0; t < 4; ++t)
                if (4 * t + c < columns)
                    store_channels((float16)(quad[t], (float4)(0), (float8)(0)), COUT % 16, row,
                                   (4 * t + c) * OUT_STRIDE);
        }
    }
}

// Ahead of its use, a share of the memory that comes next: in each of the 36 · PASSES products, some of the four new
// rows of the strip below and some of the pixels that this pass will write.
// `below` are the rows of the parts that are asked for at present.
INLINE void prefetch_share(INPUT_PARAMETERS global storage* out, global const storage** below, int x, int y, int pass,
                           int k, int block, int blocks) {
    const int shares = 9 * PASSES, share = 36 * pass + k;
    // Of an image that is pooled, twice as many rows of twice as many pixels. Upsampled ones and samples are small
    // enough to be in a cache.
#define PREFETCH_BELOW(P)                                                                              \
    if (READING(P) <= READING_POOLED) {                                                                \
        const int pool = READING(P) == READING_POOLED ? 2 : 1;                                         \
        const int row_lines = (pool * (4 * TILES + 2) * PART##P##_STRIDE * sizeof(storage) + 63) / 64; \
        const int row_shares = shares / pool, lines = (row_lines + row_shares - 1) / row_shares;       \
        if (k == 0 || share % row_shares == 0) {                                                       \
            const int row = min(pool * (y + 5) + share / row_shares, PART##P##_HEIGHT - 1);            \
            below[P] = in##P + AT(PART##P, pool * (x - 1), row, 0);                                    \
        }                                                                                              \
        for (int i = 0; i < lines; ++i) PREFETCH(below[P] + (share % row_shares * lines + i) * LINE);  \
    }
    EACH_PART(PREFETCH_BELOW)
    const int pixels = (4 * TILES + 8) / 9;
    global storage* first = out + AT(OUT, x + k % 9 * pixels, y + k / 9, 16 * block);
#pragma unroll
    for (int i = 0; i < pixels; ++i, first += OUT_STRIDE) {
        for (int c = 0; c < 16 * blocks; c += LINE) PREFETCH_TO_WRITE(first + c);
        if (OUT_STRIDE % LINE) PREFETCH_TO_WRITE(first + 16 * blocks - 1);
    }
}

// All 36 products of `blocks` blocks of output channels, then their pixels.
INLINE void run_pass(INPUT_PARAMETERS local const float* patches, global const float* bias, global const float* weights,
                     local float* products, global storage* out, int x, int y, int tiles, int pass, int blocks) {
    const int block = pass * GROUP;
    global const storage* below[PARTS];
    for (int k = 0; k < 36; ++k) {
        prefetch_share(INPUT out, below, x, y, pass, k, block, blocks);
        multiply(patches + k * PATCH_POINT, weights + 16 * CIN * (36 * block + k * blocks),
                 products + k * PRODUCT_POINT, blocks);
    }
    for (int o = 0; o < blocks; ++o)
        for (int t = 0; t < tiles; ++t)
            finish_block(sizes, products + 16 * (TILES * o + t), bias, out, x + 4 * t, y, block + o);
}

INLINE void run_quad_pass(INPUT_PARAMETERS local const float* patches, global const float* bias,
                          global const float* weights, local float* products, global storage* out, int x, int y,
                          int tiles) {
    weights += 36 * 16 * CIN * OUT_BLOCKS;
    global const storage* below[PARTS];
    for (int k = 0; k < 36; ++k, weights += QUAD_FLOATS) {
        prefetch_share(INPUT out, below, x, y, PASSES - 1, k, OUT_BLOCKS, OUT_BLOCKS == 0);
        multiply_quad(patches + k * PATCH_POINT, weights, products + k * PRODUCT_POINT);
    }
    for (int t = 0; t < tiles; t += 4) finish_quads(sizes, products + 4 * t, bias, out, x + 4 * t, y);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const float* restrict packed, global storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    local float patches[36 * PATCH_POINT] __attribute__((aligned(64)));
#if IN_PLACE
    local float* products = patches;
#else
    local float products[36 * PRODUCT_POINT] __attribute__((aligned(64)));
#endif
    const int first = (int)get_global_id(1) * TILES, tiles = min(TILES, (OUT_WIDTH + 3) / 4 - first);
    const int x = 4 * first, y = 4 * ROW_ITEM(0);

#define TRANSFORM(P) transform_part(INPUT P, PART##P##_CHANNELS, x - 1, y - 1, tiles, patches + TILES * PART##P##_LANE);
    EACH_PART(TRANSFORM)

    global const float* bias = packed + packed_offset;
    global const float* weights = bias + BIAS_FLOATS;
    for (int pass = 0; pass < OUT_BLOCKS / GROUP; ++pass)
        run_pass(INPUT patches, bias, weights, products, out, x, y, tiles, pass, GROUP);
    if (OUT_BLOCKS % GROUP)
        run_pass(INPUT patches, bias, weights, products, out, x, y, tiles, OUT_BLOCKS / GROUP, OUT_BLOCKS % GROUP);
    if (OUT_QUAD) run_quad_pass(INPUT patches, bias, weights, products, out, x, y, tiles);
}
