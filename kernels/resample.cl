// Filters without a network: HR pixel (X, Y) from render index coordinate (X + 1/2) / s - 1/2 - J, for any real s.
//
// Options: IN_*, OUT_* (layouts), SCALE, SCALE_REST (s as the sum of two floats), STORE_HALF.

typedef struct {
    int whole;
    float fraction;
} Coordinate;

// Subtracting whole · s from x + 1/2 leaves no rounding error in the remainder; so the fraction is as accurate at the
// image's far edge as at its near one.
inline Coordinate source_coordinate(int x, float jitter) {
    const float centre = x + 0.5f;
    const int near = (int)(centre / SCALE);
    const float remainder = fma(-(float)near, SCALE, centre) - near * SCALE_REST;
    const float shift = remainder / SCALE - 0.5f - jitter;
    const int whole = whole_part(shift);
    const Coordinate result = {near + whole, shift - whole};
    return result;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resample_bilinear(global const storage* in,
                                                                                   global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Coordinate u = source_coordinate(x, frame.jitter_x);
    const Coordinate v = source_coordinate(y, frame.jitter_y);
    const Taps tx = clamped_taps(u.whole, u.fraction, IN_WIDTH);
    const Taps ty = clamped_taps(v.whole, v.fraction, IN_HEIGHT);
    for (int c = 0; c < OUT_CHANNELS; c += 4) STORE_CHANNELS(OUT, BILINEAR(IN, in, tx, ty, c), out, x, y, c);
}

// Keys' cubic convolution, a = -1/2: weights of the taps at -1, 0, 1, 2 from the whole coordinate.
inline float4 keys(float t) {
    return (float4)(((-0.5f * t + 1.0f) * t - 0.5f) * t, (1.5f * t - 2.5f) * t * t + 1.0f,
                    ((-1.5f * t + 2.0f) * t + 0.5f) * t, (0.5f * t - 0.5f) * t * t);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resample_bicubic(global const storage* in,
                                                                                  global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Coordinate u = source_coordinate(x, frame.jitter_x);
    const Coordinate v = source_coordinate(y, frame.jitter_y);
    const int4 taps = (int4)(-1, 0, 1, 2);
    const int4 columns = clamp(u.whole + taps, (int4)(0), (int4)(IN_WIDTH - 1));
    const int4 rows = clamp(v.whole + taps, (int4)(0), (int4)(IN_HEIGHT - 1));
    const float4 along_x = keys(u.fraction), along_y = keys(v.fraction);
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
#define ROW(y)                                                                                                     \
    (along_x.s0 * LOAD_CHANNELS(IN, in, columns.s0, y, c) + along_x.s1 * LOAD_CHANNELS(IN, in, columns.s1, y, c) + \
     along_x.s2 * LOAD_CHANNELS(IN, in, columns.s2, y, c) + along_x.s3 * LOAD_CHANNELS(IN, in, columns.s3, y, c))
        const float4 sum = along_y.s0 * ROW(rows.s0) + along_y.s1 * ROW(rows.s1) + along_y.s2 * ROW(rows.s2) +
                           along_y.s3 * ROW(rows.s3);
#undef ROW
        STORE_CHANNELS(OUT, sum, out, x, y, c);
    }
}
