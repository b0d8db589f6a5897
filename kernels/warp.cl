// warp(I, M, border, fallback), and a reset frame is all fallback.
//
// Options: IMAGE_*, MOTION_*, OUT_* (layouts), STRIP (pixels of a row to a work-item), PIXELS_A_VECTOR (along each
// axis), BORDER_ZERO (else clamp), STORE_HALF (all but motion, which is float). Where there is a fallback other than 0:
// FALLBACK_* (layout), FALLBACK_SCALE (1: it has the image's size; else it is upsampled). Where the image is
// zero-upsampled: SAMPLES (the scale), SAMPLE (sample or previous_sample: whose).

#ifdef FALLBACK_SCALE
#define FALLBACK_ARGUMENT , global const storage* fallback
#define FALLBACK_PASSED , fallback
#else
#define FALLBACK_ARGUMENT
#define FALLBACK_PASSED
#endif

// x + motion along an axis of `size` pixels. The vector is cut to twice the image, beyond which nothing changes, so
// that it fits an int.
inline Taps warp_taps(int x, float motion, int size) {
    const float limited = clamp(motion, -2.0f * size, 2.0f * size);
    const int whole = whole_part(limited), first = x + whole;
    Taps taps = clamped_taps(first, limited - whole, size);
#ifdef BORDER_ZERO
    if (taps.first != first) taps.first_weight = 0;
    if (taps.second != first + 1) taps.second_weight = 0;
#endif
    return taps;
}

#ifdef SAMPLES
// Whether a tap along axis x or y is where samples are.
#define ON_SAMPLE(tap, axis) ((tap) % SAMPLES == JOIN(frame.SAMPLE, _##axis))

// Of two neighbouring columns one at most holds samples, and of two rows: there is one to read, or none. (At the border
// both taps may be the same.)
INLINE void warp_samples(const Sizes* sizes, global const storage* image, global storage* out, Frame frame, int x,
                         int y, Taps tx, Taps ty) {
    const int left = ON_SAMPLE(tx.first, x), right = ON_SAMPLE(tx.second, x);
    const int above = ON_SAMPLE(ty.first, y), below = ON_SAMPLE(ty.second, y);
    if (!(left | right) || !(above | below)) {
        for (int c = 0; c < OUT_CHANNELS; c += 4) STORE_CHANNELS(OUT, (float4)(0), out, x, y, c);
        return;
    }
    const float weight = ((left ? tx.first_weight : 0) + (right ? tx.second_weight : 0)) *
                         ((above ? ty.first_weight : 0) + (below ? ty.second_weight : 0));
    const int column = (left ? tx.first : tx.second) / SAMPLES, row = (above ? ty.first : ty.second) / SAMPLES;
    for (int c = 0; c < OUT_CHANNELS; c += 4)
        STORE_CHANNELS(OUT, weight * LOAD_CHANNELS(IMAGE, image, column, row, c), out, x, y, c);
}
#endif

// Pixels one after another and all four taps inside the image, as nearly everywhere: nothing is clamped, channels are
// wide vectors. Whether that is so.
#if !defined(SAMPLES) && IMAGE_BLOCK == 1 && OUT_BLOCK == 1
INLINE int warp_inside(const Sizes* sizes, global const storage* image, global storage* out, int x, int y,
                       float motion_x, float motion_y) {
    // While they are floats: they may be too large for an int.
    if (!(fabs(motion_x) < IMAGE_WIDTH && fabs(motion_y) < IMAGE_HEIGHT)) return 0;
    const int whole_x = whole_part(motion_x), whole_y = whole_part(motion_y);
    if ((uint)(x + whole_x) >= IMAGE_WIDTH - 1 || (uint)(y + whole_y) >= IMAGE_HEIGHT - 1) return 0;
    const float right = motion_x - whole_x, below = motion_y - whole_y, left = 1 - right, above = 1 - below;
    image += AT(IMAGE, x + whole_x, y + whole_y, 0);
#define FILTERED(LOAD_, c)                                                               \
    (left * above * LOAD_(image, c) + right * above * LOAD_(image, (c) + IMAGE_STRIDE) + \
     left * below * LOAD_(image, (c) + IMAGE_ROW) + right * below * LOAD_(image, (c) + IMAGE_ROW + IMAGE_STRIDE))
#if OUT_CHANNELS <= 4
    STORE_CHANNELS(OUT, FILTERED(LOAD4, 0), out, x, y, 0);
#else
    for (int c = 0; c < OUT_CHANNELS; c += 16)
        store_channels(FILTERED(LOAD16, c), min(16, OUT_CHANNELS - c), out, AT(OUT, x, y, c));
#endif
#undef FILTERED
    return 1;
}
#else
#define warp_inside(sizes, image, out, x, y, motion_x, motion_y) 0
#endif

INLINE void warp_pixel(const Sizes* sizes, global const storage* image, global storage* out, Frame frame, int x, int y,
                       float motion_x, float motion_y FALLBACK_ARGUMENT) {
    if (frame.reset || !is_finite(motion_x) || !is_finite(motion_y)) {
#ifndef FALLBACK_SCALE
        for (int c = 0; c < OUT_CHANNELS; c += 4) STORE_CHANNELS(OUT, (float4)(0), out, x, y, c);
        return;
    }
#else
#if FALLBACK_SCALE == 1
#define FALLBACK_VALUE(c) LOAD_CHANNELS(FALLBACK, fallback, x, y, c)
#else
        const Taps tx = upsample_taps(x, FALLBACK_SCALE, frame.jitter_x, FALLBACK_WIDTH);
        const Taps ty = upsample_taps(y, FALLBACK_SCALE, frame.jitter_y, FALLBACK_HEIGHT);
#define FALLBACK_VALUE(c) BILINEAR(FALLBACK, fallback, tx, ty, c)
#endif
        const int4 channel = (int4)(0, 1, 2, 3);
        for (int c = 0; c < OUT_CHANNELS; c += 4) {
            const float4 value = c < FALLBACK_CHANNELS ? FALLBACK_VALUE(c) : (float4)(0);
            STORE_CHANNELS(OUT, c + channel < FALLBACK_CHANNELS ? value : 0, out, x, y, c);
        }
        return;
    }
#endif
    if (warp_inside(sizes, image, out, x, y, motion_x, motion_y)) return;
    const Taps tx = warp_taps(x, motion_x, IMAGE_WIDTH);
    const Taps ty = warp_taps(y, motion_y, IMAGE_HEIGHT);
#ifdef SAMPLES
    warp_samples(sizes, image, out, frame, x, y, tx, ty);
#else
    for (int c = 0; c < OUT_CHANNELS; c += 4) STORE_CHANNELS(OUT, BILINEAR(IMAGE, image, tx, ty, c), out, x, y, c);
#endif
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void warp_plain(Sizes given, global const storage* image,
                                                                            global const float* motion,
                                                                            global storage* restrict out,
                                                                            Frame frame FALLBACK_ARGUMENT) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        const int block_x = x / PIXELS_A_VECTOR, block_y = y / PIXELS_A_VECTOR;
        warp_pixel(sizes, image, out, frame, x, y, motion[AT(MOTION, block_x, block_y, 0)],
                   motion[AT(MOTION, block_x, block_y, 1)] FALLBACK_PASSED);
    }
}

// One work-item warps an 8×8 block of one motion vector: the weights are the same all over it, so that rows are
// filtered as vectors of four pixels of four channels, and each source row is filtered along x once. Wants
// PIXELS_A_VECTOR 8 and an image of four channels whose pixels follow each other without a gap.
#if PIXELS_A_VECTOR == 8 && OUT_CHANNELS == 4 && IMAGE_BLOCK == 1 && IMAGE_STRIDE == 4

// Rows of the block that are filtered before they are stored: a cell's.
#if OUT_BLOCK == 2 || OUT_BLOCK == 4
#define ROWS OUT_BLOCK
#else
#define ROWS 1
#endif

inline void store_rows(const Sizes* sizes, const float16* rows, global storage* out, int x, int y) {
#if OUT_BLOCK == 1 && OUT_STRIDE == 4
    STORE16(rows[0], out, AT(OUT, x, y, 0));
#elif OUT_BLOCK == 2
    // Four pixels of two rows are two cells of 2×2.
    const float16 a = rows[0], b = rows[1];
    STORE16((float16)(a.s04, b.s04, a.s15, b.s15, a.s26, b.s26, a.s37, b.s37), out, AT(OUT, x, y, 0));
    STORE16((float16)(a.s8c, b.s8c, a.s9d, b.s9d, a.sae, b.sae, a.sbf, b.sbf), out, AT(OUT, x + 2, y, 0));
#elif OUT_BLOCK == 4
    const float16 a = rows[0], b = rows[1], c = rows[2], d = rows[3];
    STORE16((float16)(a.s048c, b.s048c, c.s048c, d.s048c), out, AT(OUT, x, y, 0));
    STORE16((float16)(a.s159d, b.s159d, c.s159d, d.s159d), out, AT(OUT, x, y, 1));
    STORE16((float16)(a.s26ae, b.s26ae, c.s26ae, d.s26ae), out, AT(OUT, x, y, 2));
    STORE16((float16)(a.s37bf, b.s37bf, c.s37bf, d.s37bf), out, AT(OUT, x, y, 3));
#else
    float pixels[16];
    vstore16(rows[0], 0, pixels);
#pragma unroll
    for (int i = 0; i < 4; ++i) {
        global storage* pixel = out + AT(OUT, x + i, y, 0);
        STORE(pixels[4 * i], pixel, 0);
        STORE(pixels[4 * i + 1], pixel, OUT_BLOCK * OUT_BLOCK);
        STORE(pixels[4 * i + 2], pixel, 2 * OUT_BLOCK * OUT_BLOCK);
        STORE(pixels[4 * i + 3], pixel, 3 * OUT_BLOCK * OUT_BLOCK);
    }
#endif
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void warp_block(Sizes given, global const storage* image,
                                                                            global const float* motion,
                                                                            global storage* restrict out,
                                                                            Frame frame FALLBACK_ARGUMENT) {
    TAKE(sizes);
    const int block_x = get_global_id(0), block_y = ROW_ITEM(1);
    if (block_x >= MOTION_WIDTH || block_y >= MOTION_HEIGHT) return;
    const float motion_x = motion[AT(MOTION, block_x, block_y, 0)];
    const float motion_y = motion[AT(MOTION, block_x, block_y, 1)];
    const int x0 = 8 * block_x, y0 = 8 * block_y;
    // The nine columns and rows that are read, while they are floats: they may be far outside, or not numbers.
    const float left = x0 + floor(motion_x), top = y0 + floor(motion_y);
    const bool inside = left >= 0 && left + 8 < IMAGE_WIDTH && top >= 0 && top + 8 < IMAGE_HEIGHT;
    if (frame.reset || !inside || x0 + 8 > OUT_WIDTH || y0 + 8 > OUT_HEIGHT) {
        for (int y = y0; y < min(y0 + 8, OUT_HEIGHT); ++y)
            for (int x = x0; x < min(x0 + 8, OUT_WIDTH); ++x)
                warp_pixel(sizes, image, out, frame, x, y, motion_x, motion_y FALLBACK_PASSED);
        return;
    }
    const float weight_x = motion_x - floor(motion_x), weight_y = motion_y - floor(motion_y);
    global const storage* source = image + AT(IMAGE, (int)left, (int)top, 0);
#define ALONG_X(i) mix(LOAD16(source, i), LOAD16(source, (i) + 4), (float16)(weight_x))
    float16 above_left = ALONG_X(0), above_right = ALONG_X(16);
#pragma unroll
    for (int y = 0; y < 8; y += ROWS) {
        float16 rows_left[ROWS], rows_right[ROWS];
#pragma unroll
        for (int row = 0; row < ROWS; ++row) {
            source += IMAGE_ROW;
            const float16 below_left = ALONG_X(0), below_right = ALONG_X(16);
            rows_left[row] = mix(above_left, below_left, (float16)(weight_y));
            rows_right[row] = mix(above_right, below_right, (float16)(weight_y));
            above_left = below_left;
            above_right = below_right;
        }
        store_rows(sizes, rows_left, out, x0, y0 + y);
        store_rows(sizes, rows_right, out, x0 + 4, y0 + y);
    }
#undef ALONG_X
}
#endif
