// 3×3 convolution by Winograd's F(4×4, 3×3), the three steps fused: a work-item takes a strip of TILES tiles of 4×4
// output pixels, transforms their 6×6 input patches into local memory, multiplies each of the 36 points by its matrix
// of weights, and transforms the products back. 2.25 multiplications a pixel and channel pair in place of 9. The
// largest error is about 10⁻⁵ of the largest output; a value that is not finite spreads over its tile.
//
// Options: CIN, COUT, ACTIVATION, layouts IN and OUT, TILES (a multiple of 4), GROUP (blocks of sixteen output channels
// multiplied at once), WG_X, WG_Y (both 1: scratch is not shared). Work-items: (tile rows, strips), which is
// (⌈height / 4⌉, ⌈⌈width / 4⌉ / TILES⌉).
// A set of packed weights takes 16 · ⌈COUT / 16⌉ + 36 · 16 · (CIN · OUT_BLOCKS + OUT_QUAD · (4 · WHOLE + REST)) floats.

// Input channels: WHOLE blocks of sixteen, one to a vector, then the REST, of 16 / REST_LANES tiles to a vector.
#define WHOLE (CIN / 16)
#define REST (CIN % 16)
#define REST_LANES (REST > 8 ? 16 : REST > 4 ? 8 : 4)

// Output channels: OUT_BLOCKS of sixteen, the last perhaps part-filled. One to four left over make a quad, for which a
// vector's lanes are four input channels × four output channels.
#define OUT_QUAD (COUT % 16 > 0 && COUT % 16 <= 4)
#define OUT_BLOCKS (COUT / 16 + (COUT % 16 > 4))
#define BIAS_FLOATS ((COUT + 15) / 16 * 16)
#define QUAD_FLOATS (16 * (4 * WHOLE + REST))
#define PASSES ((OUT_BLOCKS + GROUP - 1) / GROUP + OUT_QUAD)
#define LINE (64 / (int)sizeof(storage))

// Floats of one point: of the patches as [block][tile][16] then [tile][REST_LANES], of the products as
// [block][tile][16]. An odd number of 64-byte lines, so that the 36 points of a tile fall into different cache sets.
#define ODD_LINES(floats) (((floats) + 15) / 16 / 2 * 32 + 16)
#define PATCH_POINT ODD_LINES(TILES*(16 * WHOLE + (REST ? REST_LANES : 0)))

// A single pass's products may take the place of the patches, so that less cache is used.
#define IN_PLACE (PASSES == 1 && CIN >= 16 * OUT_BLOCKS)
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

// LANES channels of 16 / LANES neighbouring tiles at the pixel (x, y) of the first; zero outside the image.
INLINE float16 load16(global const storage* in, int x, int y, int channel, int guarded) {
    if (guarded && !INSIDE(IN, x, y)) return (float16)(0);
    return LOAD16(in, AT(IN, x, y, channel));
}
INLINE float8 load8(global const storage* in, int x, int y, int channel, int guarded) {
    if (guarded && !INSIDE(IN, x, y)) return (float8)(0);
    return LOAD8(in, AT(IN, x, y, channel));
}
INLINE float4 load4(global const storage* in, int x, int y, int channel, int guarded) {
    if (guarded && !INSIDE(IN, x, y)) return (float4)(0);
    return LOAD4(in, AT(IN, x, y, channel));
}
INLINE float16 load_lanes(global const storage* in, int x, int y, int channel, int lanes, int guarded) {
    if (lanes == 4)
        return (float16)(load4(in, x, y, channel, guarded), load4(in, x + 4, y, channel, guarded),
                         load4(in, x + 8, y, channel, guarded), load4(in, x + 12, y, channel, guarded));
    if (lanes == 8) return (float16)(load8(in, x, y, channel, guarded), load8(in, x + 4, y, channel, guarded));
    return load16(in, x, y, channel, guarded);
}

// Transforms the patches of 16 / lanes tiles whose first has its corner at (x, y).
INLINE void transform_patches(global const storage* in, int x, int y, int channel, int lanes, local float* patch,
                              int guarded) {
    float16 d[6][6];
#pragma unroll
    for (int r = 0; r < 6; ++r) {
#pragma unroll
        for (int c = 0; c < 6; ++c) d[r][c] = load_lanes(in, x + c, y + r, channel, lanes, guarded);
        transform_input(&d[r][0], &d[r][1], &d[r][2], &d[r][3], &d[r][4], &d[r][5]);
    }
#pragma unroll
    for (int c = 0; c < 6; ++c) {
        transform_input(&d[0][c], &d[1][c], &d[2][c], &d[3][c], &d[4][c], &d[5][c]);
#pragma unroll
        for (int r = 0; r < 6; ++r) *(local float16*)(patch + (6 * r + c) * PATCH_POINT) = d[r][c];
    }
}

INLINE void transform_strip(global const storage* in, int x, int y, int channel, int lanes, int tiles,
                            local float* patch) {
    const int step = 16 / lanes;
    for (int t = 0; t < tiles; t += step, x += 4 * step, patch += 16) {
        if (x >= 0 && x + 4 * step + 2 <= IN_WIDTH && y >= 0 && y + 6 <= IN_HEIGHT)
            transform_patches(in, x, y, channel, lanes, patch, 0);
        else
            transform_patches(in, x, y, channel, lanes, patch, 1);
    }
}

// One point's product for `blocks` blocks of sixteen output channels, all its sums in registers.
INLINE void multiply(local const float* patch, global const float* weights, local float* product, int blocks) {
    float16 sum[GROUP][TILES];
#pragma unroll
    for (int o = 0; o < blocks; ++o)
#pragma unroll
        for (int t = 0; t < TILES; ++t) sum[o][t] = (float16)(0);
    for (int block = 0; block < WHOLE; ++block, patch += 16 * TILES) {
        for (int c = 0; c < 16; ++c, weights += 16 * blocks)
#pragma unroll
            for (int t = 0; t < TILES; ++t)
#pragma unroll
                for (int o = 0; o < blocks; ++o)
                    sum[o][t] = MAD((float16)(patch[16 * t + c]), vload16(o, weights), sum[o][t]);
    }
    for (int c = 0; c < REST; ++c, weights += 16 * blocks)
#pragma unroll
        for (int t = 0; t < TILES; ++t)
#pragma unroll
            for (int o = 0; o < blocks; ++o)
                sum[o][t] = MAD((float16)(patch[REST_LANES * t + c]), vload16(o, weights), sum[o][t]);
#pragma unroll
    for (int o = 0; o < blocks; ++o)
#pragma unroll
        for (int t = 0; t < TILES; ++t) ((local float16*)product)[o * TILES + t] = sum[o][t];
}

// The same for the quad of output channels left over: lanes are four input channels × four output channels while
// summing, four tiles × four output channels in the product.
INLINE void multiply_quad(local const float* patch, global const float* weights, local float* product) {
    float16 sum[TILES];
#pragma unroll
    for (int t = 0; t < TILES; ++t) sum[t] = (float16)(0);
    for (int block = 0; block < WHOLE; ++block, patch += 16 * TILES, weights += 64) {
#pragma unroll
        for (int t = 0; t < TILES; ++t) {
            const float16 v = vload16(t, patch);
            sum[t] = MAD(v.s000044448888cccc, vload16(0, weights), sum[t]);
            sum[t] = MAD(v.s111155559999dddd, vload16(1, weights), sum[t]);
            sum[t] = MAD(v.s22226666aaaaeeee, vload16(2, weights), sum[t]);
            sum[t] = MAD(v.s33337777bbbbffff, vload16(3, weights), sum[t]);
        }
    }
    for (int c = 0; c < REST; ++c, weights += 16)
#pragma unroll
        for (int t = 0; t < TILES; ++t) sum[t] = MAD((float16)(patch[REST_LANES * t + c]), vload16(0, weights), sum[t]);
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

INLINE void finish_block(local const float* product, global const float* bias, global storage* out, int x, int y,
                         int block) {
    float16 pixel[16];
    transform_products(product, pixel);
    const int whole = x + 4 <= OUT_WIDTH && y + 4 <= OUT_HEIGHT;
    const int channels = COUT % 16 > 4 && block == COUT / 16 ? COUT % 16 : 16;
#pragma unroll
    for (int i = 0; i < 16; ++i)
        if (whole || INSIDE(OUT, x + i % 4, y + i / 4))
            store_channels(ACTIVATE(pixel[i] + vload16(block, bias)), channels, out,
                           AT(OUT, x + i % 4, y + i / 4, 16 * block));
}

// Four tiles' quads, the first at (x, y).
INLINE void finish_quads(local const float* product, global const float* bias, global storage* out, int x, int y) {
    float16 pixel[16];
    transform_products(product, pixel);
#pragma unroll
    for (int i = 0; i < 16; ++i) {
        const float16 v = ACTIVATE(pixel[i] + vload16(OUT_BLOCKS, bias).s0123012301230123);
        const float4 quad[4] = {v.s0123, v.s4567, v.s89ab, v.scdef};
#pragma unroll
        for (int t = 0; t < 4; ++t)
            if (INSIDE(OUT, x + 4 * t + i % 4, y + i / 4))
                store_channels((float16)(quad[t], (float4)(0), (float8)(0)), COUT % 16, out,
                               AT(OUT, x + 4 * t + i % 4, y + i / 4, 16 * OUT_BLOCKS));
    }
}

// Ahead of its use, a share of the memory that comes next: in each of the 36 · PASSES products, some of the four new
// rows of the strip below and some of the pixels that this pass will write.
INLINE void prefetch_share(global const storage* in, global storage* out, int x, int y, int pass, int k, int block,
                           int blocks) {
    const int row_lines = ((4 * TILES + 2) * IN_STRIDE * sizeof(storage) + 63) / 64;
    const int shares = 9 * PASSES, lines = (row_lines + shares - 1) / shares, share = 36 * pass + k;
    global const storage* row = in + AT(IN, x - 1, min(y + 5 + share / shares, IN_HEIGHT - 1), 0);
#pragma unroll
    for (int i = 0; i < lines; ++i) PREFETCH(row + (share % shares * lines + i) * LINE);
    const int pixels = (4 * TILES + 8) / 9;
    global storage* first = out + AT(OUT, x + k % 9 * pixels, y + k / 9, 16 * block);
#pragma unroll
    for (int i = 0; i < pixels; ++i, first += OUT_STRIDE) {
        for (int c = 0; c < 16 * blocks; c += LINE) PREFETCH_TO_WRITE(first + c);
        if (OUT_STRIDE % LINE) PREFETCH_TO_WRITE(first + 16 * blocks - 1);
    }
}

// All 36 products of `blocks` blocks of output channels, then their pixels.
INLINE void run_pass(global const storage* in, local const float* patches, global const float* bias,
                     global const float* weights, local float* products, global storage* out, int x, int y, int tiles,
                     int pass, int blocks) {
    const int block = pass * GROUP;
    for (int k = 0; k < 36; ++k) {
        prefetch_share(in, out, x, y, pass, k, block, blocks);
        multiply(patches + k * PATCH_POINT, weights + 16 * CIN * (36 * block + k * blocks),
                 products + k * PRODUCT_POINT, blocks);
    }
    for (int o = 0; o < blocks; ++o)
        for (int t = 0; t < tiles; ++t)
            finish_block(products + 16 * (TILES * o + t), bias, out, x + 4 * t, y, block + o);
}

INLINE void run_quad_pass(global const storage* in, local const float* patches, global const float* bias,
                          global const float* weights, local float* products, global storage* out, int x, int y,
                          int tiles) {
    weights += 36 * 16 * CIN * OUT_BLOCKS;
    for (int k = 0; k < 36; ++k, weights += QUAD_FLOATS) {
        prefetch_share(in, out, x, y, PASSES - 1, k, OUT_BLOCKS, OUT_BLOCKS == 0);
        multiply_quad(patches + k * PATCH_POINT, weights, products + k * PRODUCT_POINT);
    }
    for (int t = 0; t < tiles; t += 4) finish_quads(products + 4 * t, bias, out, x + 4 * t, y);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(global const storage* restrict in,
                                                                             global const float* restrict packed,
                                                                             global storage* restrict out,
                                                                             uint packed_offset) {
    local float patches[36 * PATCH_POINT] __attribute__((aligned(64)));
#if IN_PLACE
    local float* products = patches;
#else
    local float products[36 * PRODUCT_POINT] __attribute__((aligned(64)));
#endif
    const int first = (int)get_global_id(1) * TILES, tiles = min(TILES, (OUT_WIDTH + 3) / 4 - first);
    const int x = 4 * first, y = 4 * (int)get_global_id(0);

    for (int block = 0; block < WHOLE; ++block)
        transform_strip(in, x - 1, y - 1, 16 * block, 16, tiles, patches + 16 * TILES * block);
    if (REST) transform_strip(in, x - 1, y - 1, 16 * WHOLE, REST_LANES, tiles, patches + 16 * TILES * WHOLE);

    global const float* bias = packed + packed_offset;
    global const float* weights = bias + BIAS_FLOATS;
    for (int pass = 0; pass < OUT_BLOCKS / GROUP; ++pass)
        run_pass(in, patches, bias, weights, products, out, x, y, tiles, pass, GROUP);
    if (OUT_BLOCKS % GROUP)
        run_pass(in, patches, bias, weights, products, out, x, y, tiles, OUT_BLOCKS / GROUP, OUT_BLOCKS % GROUP);
    if (OUT_QUAD) run_quad_pass(in, patches, bias, weights, products, out, x, y, tiles);
}

// Gg for one row or column of a kernel.
INLINE void transform_kernel(float a, float b, float c, float* out, int step) {
    out[0] = a / 4;
    out[step] = -(a + b + c) / 6;
    out[2 * step] = -(a - b + c) / 6;
    out[3 * step] = a / 24 + b / 12 + c / 6;
    out[4 * step] = a / 24 - b / 12 + c / 6;
    out[5 * step] = c;
}

// Work-items: (CIN, 16 · ⌈COUT / 16⌉).
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void pack(global const float* weights, global const float* biases,
                                                                global float* packed, uint packed_offset,
                                                                uint weights_offset, uint biases_offset) {
    const int ci = get_global_id(0), co = get_global_id(1);
    packed += packed_offset;
    weights += weights_offset;
    if (ci == 0) packed[co] = co < COUT ? biases[biases_offset + co] : 0;

    // Where point 0 of this pair goes, and how far it is from point to point.
    int position = BIAS_FLOATS, step;
    const int before = co / 16 / GROUP * GROUP;
    if (co / 16 < OUT_BLOCKS) {
        const int width = 16 * min(GROUP, OUT_BLOCKS - before);
        step = width * CIN;
        position += 36 * 16 * CIN * before + width * ci + co - 16 * before;
    } else {
        step = QUAD_FLOATS;
        position += 36 * 16 * CIN * OUT_BLOCKS;
        if (ci >= 16 * WHOLE)
            position += 16 * (4 * WHOLE + ci % 16) + co % 16;
        else if (co % 16 < 4)
            position += 16 * (ci / 16 * 4 + ci % 4) + ci % 16 / 4 * 4 + co % 16;
        else
            return;
    }

    float rows[18], points[36];
    for (int c = 0; c < 3; ++c) {
        const int i = (co * CIN + ci) * 9 + c;
        if (co < COUT)
            transform_kernel(weights[i], weights[i + 3], weights[i + 6], rows + c, 3);
        else
            transform_kernel(0, 0, 0, rows + c, 3);
    }
    for (int r = 0; r < 6; ++r) transform_kernel(rows[3 * r], rows[3 * r + 1], rows[3 * r + 2], points + 6 * r, 1);
    for (int k = 0; k < 36; ++k) packed[position + k * step] = points[k];
}
