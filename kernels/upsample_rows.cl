// upsample(x, s, J), and with MOTION s · upsample(m, s, J_m), for devices with wide vectors: the weights are the same
// for all pixels of a row that lie at the same place of their tiles, so that four source pixels of four elements each
// are filtered as one vector. Images of up to four channels, the source's pixels four elements apart.
//
// Options: IN_*, OUT_* (layouts), SCALE, SHIFT_X, SHIFT_Y (the jitter, as an expression in `frame`), STRIP (a multiple
// of 4), MOTION (a NaN is then an invalid vector, see upsample_motion.cl), STORE_HALF. A work-item makes one row over
// STRIP source pixels. Work-items: (⌈source width / STRIP⌉, height).

// Pixels x to x + 3 of row y, clamped to the image. Of the last one's elements past its channels, anything.
INLINE float16 four_pixels(const Sizes* sizes, global const storage* in, int x, int y) {
    if (x >= 0 && x + 4 <= IN_WIDTH) return LOAD16(in, AT(IN, x, y, 0));
#define PIXEL(i) LOAD4(in, AT(IN, clamp(x + (i), 0, IN_WIDTH - 1), y, 0))
    return (float16)(PIXEL(0), PIXEL(1), PIXEL(2), PIXEL(3));
}

// Adds what four taps of one weight contribute, and marks where they are invalid and count.
INLINE void add_taps(float16 taps, float weight_x, float weight_y, float16* sum, int16* invalid) {
#ifdef MOTION
    const int16 unusable = (as_int16(taps) & 0x7fffffff) >= 0x7f800000;
    const int16 is_invalid = unusable | unusable.s1032547698badcfe;  // the other component
    if (weight_x > 1e-3f && weight_y > 1e-3f) *invalid |= is_invalid;
    taps = as_float16(as_int16(taps) & ~is_invalid);
#endif
    *sum = MAD((float16)(weight_x * weight_y), taps, *sum);
}

INLINE void store_pixel(const Sizes* sizes, float4 v, global storage* out, int x, int y) {
#if OUT_CHANNELS == 4
    STORE4(v, out, AT(OUT, x, y, 0));
#elif OUT_CHANNELS == 3
    STORE3(v.xyz, out, AT(OUT, x, y, 0));
#else
    STORE(v.x, out, AT(OUT, x, y, 0));
    if (OUT_CHANNELS == 2) STORE(v.y, out, AT(OUT, x, y, 1));
#endif
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void upsample_rows(Sizes given, global const storage* in,
                                                                               global storage* restrict out,
                                                                               Frame frame) {
    TAKE(sizes);
    const int start = (int)get_global_id(0) * STRIP, y = ROW_ITEM(1);
    const Taps ty = upsample_taps(y, SCALE, SHIFT_Y, IN_HEIGHT);
    for (int x = start; x < min(start + STRIP, IN_WIDTH); x += 4) {
#pragma unroll
        for (int place = 0; place < SCALE; ++place) {
            // As upsample_taps has them, whose clamp four_pixels does.
            const float shift = (place + 0.5f) / SCALE - 0.5f - SHIFT_X;
            const int left = whole_part(shift);
            const float right_weight = shift - left, left_weight = 1 - right_weight;
            float16 sum = 0;
            int16 invalid = 0;
            add_taps(four_pixels(sizes, in, x + left, ty.first), left_weight, ty.first_weight, &sum, &invalid);
            add_taps(four_pixels(sizes, in, x + left + 1, ty.first), right_weight, ty.first_weight, &sum, &invalid);
            add_taps(four_pixels(sizes, in, x + left, ty.second), left_weight, ty.second_weight, &sum, &invalid);
            add_taps(four_pixels(sizes, in, x + left + 1, ty.second), right_weight, ty.second_weight, &sum, &invalid);
#ifdef MOTION
            // All bits set are a NaN.
            sum = as_float16(as_int16(sum * SCALE) | invalid);
#endif
            const int to = SCALE * x + place;
            store_pixel(sizes, sum.s0123, out, to, y);
            if (x + 1 < IN_WIDTH) store_pixel(sizes, sum.s4567, out, to + SCALE, y);
            if (x + 2 < IN_WIDTH) store_pixel(sizes, sum.s89ab, out, to + 2 * SCALE, y);
            if (x + 3 < IN_WIDTH) store_pixel(sizes, sum.scdef, out, to + 3 * SCALE, y);
        }
    }
}
