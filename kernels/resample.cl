// Separable filters without a network: HR pixel (X, Y) from render index coordinate (X + 1/2) / s - 1/2 - J, for any
// real s above 0.
//
// Options: IN_*, OUT_* (layouts), SCALE, SCALE_REST (s as the sum of two floats), SHIFT_X, SHIFT_Y (the jitter, as an
// expression in `frame`), CLAMPED (to [0, 1]; 0 or 1), TAPS (along each axis: 1 nearest, 2 bilinear, 4 Keys' bicubic, 6
// Lanczos-3), STORE_HALF.

#define MADE(v) (CLAMPED ? clamp((v), 0.0f, 1.0f) : (v))
#define FIRST_TAP (1 - (TAPS + 1) / 2)  // counted from the whole part of the coordinate

// sinc(t) of |t| <= 1, sin(pi t) / (pi t) as a series in (pi t)².
inline float8 sinc(float8 squared) {
    float8 sum = MAD(squared, (float8)(1 / 355687428096000.0f), (float8)(-1 / 1307674368000.0f));
    sum = MAD(sum, squared, (float8)(1 / 6227020800.0f));
    sum = MAD(sum, squared, (float8)(-1 / 39916800.0f));
    sum = MAD(sum, squared, (float8)(1 / 362880.0f));
    sum = MAD(sum, squared, (float8)(-1 / 5040.0f));
    sum = MAD(sum, squared, (float8)(1 / 120.0f));
    sum = MAD(sum, squared, (float8)(-1 / 6.0f));
    return MAD(sum, squared, (float8)(1.0f));
}

// The taps' weights around a coordinate whose fraction is t; they sum to 1. Those past the last tap are 0.
inline float8 tap_weights(float t) {
#if TAPS == 1
    return (float8)(1, 0, 0, 0, 0, 0, 0, 0);
#elif TAPS == 2
    return (float8)(1 - t, t, 0, 0, 0, 0, 0, 0);
#elif TAPS == 4
    return (float8)(keys(t), 0, 0, 0, 0);
#else
    // sinc(x) sinc(x / 3), and sin 3a = sin a (3 - 4 sin² a) gives the first of the second.
    const float8 third = (t - (float8)(-2, -1, 0, 1, 2, 3, 0, 0)) * (M_PI_F / 3);
    const float8 squared = third * third, wide = sinc(squared), wide_squared = wide * wide;
    const float8 weights = wide_squared * (1 - 4.0f / 3 * squared * wide_squared) * (float8)(1, 1, 1, 1, 1, 1, 0, 0);
    const float4 sums = weights.lo + weights.hi;
    return weights / (sums.x + sums.y + sums.z + sums.w);
#endif
}

INLINE Coordinate coordinate(const Sizes* sizes, int x, float jitter) {
#if TAPS == 1
    // Rounded: the middle between two pixels is the second's, whatever rounding errors make of it.
    jitter -= 0.501f;
#endif
    return source_coordinate(x, SCALE, SCALE_REST, jitter);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resample(Sizes given, global const storage* in,
                                                                          global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Coordinate u = coordinate(sizes, x, SHIFT_X), v = coordinate(sizes, y, SHIFT_Y);
    float along_x[8], along_y[8];
    vstore8(tap_weights(u.fraction), 0, along_x);
    vstore8(tap_weights(v.fraction), 0, along_y);
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
        float4 sum = 0;
#pragma unroll
        for (int j = 0; j < TAPS; ++j) {
            const int row = clamp(v.whole + FIRST_TAP + j, 0, IN_HEIGHT - 1);
            float4 line = 0;
#pragma unroll
            for (int i = 0; i < TAPS; ++i) {
                const int column = clamp(u.whole + FIRST_TAP + i, 0, IN_WIDTH - 1);
                line += along_x[i] * LOAD_CHANNELS(IN, in, column, row, c);
            }
            sum += along_y[j] * line;
        }
        STORE_CHANNELS(OUT, MADE(sum), out, x, y, c);
    }
}

// For devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels, each row filtered
// along y first, whole vectors of source pixels at a time. The weights along x serve all rows. Wants one channel,
// three or four, and source pixels of four elements; SPAN source pixels, up to MOST_SPAN, are under a row of the strip
// and its taps.
#ifdef PIXELS

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resample_strip(Sizes given, global const storage* in,
                                                                                global storage* restrict out,
                                                                                Frame frame) {
    TAKE(sizes);
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * ROW_ITEM(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0), rows = min(ROWS, OUT_HEIGHT - y0);
    const int first_column = coordinate(sizes, x0, SHIFT_X).whole + FIRST_TAP;
    int place[PIXELS];
    float along_x[PIXELS][8];
    for (int i = 0; i < PIXELS; ++i) {
        const Coordinate u = coordinate(sizes, x0 + i, SHIFT_X);
        place[i] = u.whole + FIRST_TAP - first_column;
        vstore8(tap_weights(u.fraction), 0, along_x[i]);
    }
    const int vectors = (SPAN + 3) / 4;
    const bool inside = first_column >= 0 && first_column + 4 * vectors <= IN_WIDTH;
    for (int row = 0; row < rows; ++row) {
        const Coordinate v = coordinate(sizes, y0 + row, SHIFT_Y);
        float along_y[8];
        vstore8(tap_weights(v.fraction), 0, along_y);
        int lines[TAPS];
#pragma unroll
        for (int j = 0; j < TAPS; ++j) lines[j] = AT(IN, 0, clamp(v.whole + FIRST_TAP + j, 0, IN_HEIGHT - 1), 0);
        float16 filtered[(MOST_SPAN + 3) / 4];
        for (int i = 0; i < vectors; ++i) {
            const int column = first_column + 4 * i;
            float16 sum = 0;
            if (inside) {
#pragma unroll
                for (int j = 0; j < TAPS; ++j) sum += along_y[j] * LOAD16(in, lines[j] + IN_STRIDE * column);
            } else {
                const int4 at = IN_STRIDE * clamp(column + (int4)(0, 1, 2, 3), (int4)(0), (int4)(IN_WIDTH - 1));
#pragma unroll
                for (int j = 0; j < TAPS; ++j)
                    sum += along_y[j] * (float16)(LOAD4(in, lines[j] + at.s0), LOAD4(in, lines[j] + at.s1),
                                                  LOAD4(in, lines[j] + at.s2), LOAD4(in, lines[j] + at.s3));
            }
            filtered[i] = sum;
        }
        const float4* source = (const float4*)filtered;
        for (int i = 0; i < pixels; ++i) {
            float4 sum = along_x[i][0] * source[place[i]];
#pragma unroll
            for (int tap = 1; tap < TAPS; ++tap) sum = MAD(along_x[i][tap], source[place[i] + tap], sum);
            const float4 made = MADE(sum);
            if (OUT_CHANNELS == 4 || OUT_BLOCK > 1)
                STORE_CHANNELS(OUT, made, out, x0 + i, y0 + row, 0);
            else
                STORE_ONE_OR_THREE(OUT, made, out, x0 + i, y0 + row);
        }
    }
}
#endif
