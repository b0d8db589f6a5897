// warp_sharply(history, M) of docs/fsr2.md; upsample(colour, s, J) of weight 0, for any real s, where M is invalid
// and all over a reset frame.
//
// Options: IMAGE_* (the history: colour and a weight), MOTION_*, OUT_* (output resolution), COLOR_* (render resolution;
// layouts), STRIP (pixels of a row to a work-item), SCALE, SCALE_REST (s as the sum of two floats), STORE_HALF (all but
// motion, which is float).

// The last of four lanes, the weight's, is filtered by other factors than colour.
INLINE float4 factors(float color, float weight) { return (float4)(color, color, color, weight); }

// Between columns `column` and the next, s from 0 to 1, and rows likewise. Of four weights along an axis the outer two
// are 0 for the weight's lane, and where both axes' are outer ones there is no tap.
INLINE float4 filtered(const Sizes* sizes, global const storage* image, int column, int row, float s, float t) {
    const float4 along_x = keys(s), along_y = keys(t);
    const float4 x0 = factors(along_x.s0, 0), x1 = factors(along_x.s1, 1 - s);
    const float4 x2 = factors(along_x.s2, s), x3 = factors(along_x.s3, 0);
    const float4 y0 = factors(along_y.s0, 0), y1 = factors(along_y.s1, 1 - t);
    const float4 y2 = factors(along_y.s2, t), y3 = factors(along_y.s3, 0);
    float4 sum;
#if IMAGE_BLOCK == 1 && IMAGE_STRIDE == 4
    if (column >= 1 && column + 2 < IMAGE_WIDTH && row >= 1 && row + 2 < IMAGE_HEIGHT) {
        global const storage* corner = image + AT(IMAGE, column - 1, row - 1, 0);
        const float16 between = (float16)(y1, y1, y1, y1) * LOAD16(corner, IMAGE_ROW) +
                                (float16)(y2, y2, y2, y2) * LOAD16(corner, 2 * IMAGE_ROW);
        const float8 outer = (float8)(y0, y0) * LOAD8(corner, 4) + (float8)(y3, y3) * LOAD8(corner, 3 * IMAGE_ROW + 4);
        sum = x0 * between.s0123 + x1 * (between.s4567 + outer.s0123) + x2 * (between.s89ab + outer.s4567) +
              x3 * between.scdef;
    } else
#endif
    {
        const int4 taps = (int4)(-1, 0, 1, 2);
        const int4 columns = clamp(column + taps, (int4)(0), (int4)(IMAGE_WIDTH - 1));
        const int4 rows = clamp(row + taps, (int4)(0), (int4)(IMAGE_HEIGHT - 1));
#define PIXEL(x, y) LOAD_CHANNELS(IMAGE, image, columns.s##x, rows.s##y, 0)
        sum = y0 * (x1 * PIXEL(1, 0) + x2 * PIXEL(2, 0)) + y3 * (x1 * PIXEL(1, 3) + x2 * PIXEL(2, 3)) +
              y1 * (x0 * PIXEL(0, 1) + x1 * PIXEL(1, 1) + x2 * PIXEL(2, 1) + x3 * PIXEL(3, 1)) +
              y2 * (x0 * PIXEL(0, 2) + x1 * PIXEL(1, 2) + x2 * PIXEL(2, 2) + x3 * PIXEL(3, 2));
#undef PIXEL
    }
    // All sixteen weights of colour add up to 1.
    const float corners = (along_x.s0 + along_x.s3) * (along_y.s0 + along_y.s3);
    const float4 color = sum / (1 - corners);
    const float4 held = color > 0 ? (color < 1 ? color : 1) : 0;
    return (float4)(held.xyz, sum.w);
}

INLINE Taps fallback_taps(const Sizes* sizes, int x, float jitter, int size) {
    const Coordinate u = source_coordinate(x, SCALE, SCALE_REST, jitter);
    return clamped_taps(u.whole, u.fraction, size);
}

INLINE float4 warped(const Sizes* sizes, global const storage* image, global const storage* color, Frame frame, int x,
                     int y, float motion_x, float motion_y) {
    if (frame.reset || !is_finite(motion_x) || !is_finite(motion_y)) {
        const Taps tx = fallback_taps(sizes, x, frame.jitter_x, COLOR_WIDTH);
        const Taps ty = fallback_taps(sizes, y, frame.jitter_y, COLOR_HEIGHT);
        return (float4)(BILINEAR(COLOR, color, tx, ty, 0).xyz, 0);
    }
    // Cut to twice the image, beyond which nothing changes, so that the sums fit an int.
    const float dx = clamp(motion_x, -2.0f * IMAGE_WIDTH, 2.0f * IMAGE_WIDTH);
    const float dy = clamp(motion_y, -2.0f * IMAGE_HEIGHT, 2.0f * IMAGE_HEIGHT);
    const int whole_x = whole_part(dx), whole_y = whole_part(dy);
    return filtered(sizes, image, x + whole_x, y + whole_y, dx - whole_x, dy - whole_y);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void warp_sharply(Sizes given, global const storage* image,
                                                                              global const float* motion,
                                                                              global const storage* color,
                                                                              global storage* restrict out,
                                                                              Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x)
        STORE_CHANNELS(
            OUT, warped(sizes, image, color, frame, x, y, motion[AT(MOTION, x, y, 0)], motion[AT(MOTION, x, y, 1)]),
            out, x, y, 0);
}

// For devices that make vectors of what a work-item says is one: weights of sixteen pixels at once, so that for each of
// them only its taps are left. Wants a history whose pixels are four elements one after another.
#ifdef PIXELS
#define LANES 16
#define WEIGHTS 12  // four along each axis, and four of the bilinear filter

// floor(v), where it fits an int.
INLINE int16 whole_parts(float16 v) {
    const int16 toward_zero = convert_int16(v);
    return toward_zero + (v < convert_float16(toward_zero));  // a comparison that holds is -1
}

// keys() of sixteen pixels.
INLINE void keys_lanes(float16 t, float16* weights) {
    weights[0] = ((-0.5f * t + 1) * t - 0.5f) * t;
    weights[1] = (1.5f * t - 2.5f) * t * t + 1;
    weights[2] = ((-1.5f * t + 2) * t + 0.5f) * t;
    weights[3] = (0.5f * t - 0.5f) * t * t;
}

INLINE int16 are_finite(float16 v) { return (as_int16(v) & 0x7f800000) != 0x7f800000; }

// The pixel whose taps' first row and column begin at p, by weights that are LANES apart.
INLINE float4 filtered_inside(const Sizes* sizes, global const storage* p, const float* weights) {
#define WEIGHT(i) weights[(i)*LANES]
#define TAP(x, y) LOAD4(p, (y)*IMAGE_ROW + 4 * (x))
    const float4 above = WEIGHT(1) * TAP(1, 0) + WEIGHT(2) * TAP(2, 0);
    const float4 upper = WEIGHT(0) * TAP(0, 1) + WEIGHT(1) * TAP(1, 1) + WEIGHT(2) * TAP(2, 1) + WEIGHT(3) * TAP(3, 1);
    const float4 lower = WEIGHT(0) * TAP(0, 2) + WEIGHT(1) * TAP(1, 2) + WEIGHT(2) * TAP(2, 2) + WEIGHT(3) * TAP(3, 2);
    const float4 below = WEIGHT(1) * TAP(1, 3) + WEIGHT(2) * TAP(2, 3);
    const float4 sum = WEIGHT(4) * above + WEIGHT(5) * upper + WEIGHT(6) * lower + WEIGHT(7) * below;
#undef TAP
#define TAP(x, y) LOAD(p, (y)*IMAGE_ROW + 4 * (x) + 3)
    const float weight =
        WEIGHT(8) * TAP(1, 1) + WEIGHT(9) * TAP(2, 1) + WEIGHT(10) * TAP(1, 2) + WEIGHT(11) * TAP(2, 2);
#undef TAP
#undef WEIGHT
    const float4 raised = GREATER(sum, (float4)(0));
    return (float4)(LESSER(raised, (float4)(1)).xyz, weight);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void warp_sharply_lanes(
    Sizes given, global const storage* image, global const float* motion, global const storage* color,
    global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = PIXELS * get_global_id(0), end = min(first + PIXELS, OUT_WIDTH);
    const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    for (int x = first; x < end; x += LANES) {
        float motion_x[LANES], motion_y[LANES], weights[WEIGHTS * LANES];
        int elements[LANES], inside[LANES];
        for (int i = 0; i < LANES; ++i) {
            motion_x[i] = motion[AT(MOTION, min(x + i, OUT_WIDTH - 1), y, 0)];
            motion_y[i] = motion[AT(MOTION, min(x + i, OUT_WIDTH - 1), y, 1)];
        }
        const float16 dx = vload16(0, motion_x), dy = vload16(0, motion_y);
        // Beyond twice the image nothing changes, and what is not finite is not inside.
        const float16 held_x = GREATER(dx, (float16)(-2.0f * IMAGE_WIDTH)),
                      held_y = GREATER(dy, (float16)(-2.0f * IMAGE_HEIGHT));
        const float16 near_x = LESSER(held_x, (float16)(2.0f * IMAGE_WIDTH)),
                      near_y = LESSER(held_y, (float16)(2.0f * IMAGE_HEIGHT));
        const int16 whole_x = whole_parts(near_x), whole_y = whole_parts(near_y);
        const int16 column = whole_x + x + lane, row = whole_y + y;
        const int16 has_taps = column >= 1 & column < IMAGE_WIDTH - 2 & row >= 1 & row < IMAGE_HEIGHT - 2;
        vstore16(has_taps & are_finite(dx) & are_finite(dy) & (frame.reset ? 0 : -1), 0, inside);
        vstore16((row - 1) * IMAGE_ROW + (column - 1) * IMAGE_STRIDE, 0, elements);
        const float16 s = near_x - convert_float16(whole_x), t = near_y - convert_float16(whole_y);
        float16 along_x[4], along_y[4];
        keys_lanes(s, along_x);
        keys_lanes(t, along_y);
        // All sixteen weights of colour add up to 1, and the twelve that there are to be made to.
        const float16 share = 1 / (1 - (along_x[0] + along_x[3]) * (along_y[0] + along_y[3]));
#pragma unroll
        for (int i = 0; i < 4; ++i) {
            vstore16(along_x[i], i, weights);
            vstore16(share * along_y[i], 4 + i, weights);
        }
        vstore16((1 - s) * (1 - t), 8, weights);
        vstore16(s * (1 - t), 9, weights);
        vstore16((1 - s) * t, 10, weights);
        vstore16(s * t, 11, weights);
        for (int i = 0; i < min(LANES, end - x); ++i) {
            const float4 pixel = inside[i]
                                     ? filtered_inside(sizes, image + AT(IMAGE, 0, 0, 0) + elements[i], weights + i)
                                     : warped(sizes, image, color, frame, x + i, y, motion_x[i], motion_y[i]);
            STORE_CHANNELS(OUT, pixel, out, x + i, y, 0);
        }
    }
}
#endif
