// trust(D, c, s) of docs/fsr2.md: how far the history around a sample is to be believed, from 0 to 1. In a reset frame
// all vectors are invalid.
//
// Options: RESIDUAL_*, OUT_* (layouts of one storage), MOTION_* (float), SCALE (as the sum of two floats: SCALE_REST),
// STRIP (pixels of a row to a work-item), STORE_HALF.

#define NARROW 3.0f  // deviations of the mean at which half is believed: of 3×3 samples
#define WIDE 5.0f    // of 5×5, where nothing moves
#define ALLOWED 8e-5f
#define APART 0.1f  // render pixels that vectors may differ by, and the share of their length
#define APART_SHARE 0.2f
#define APART_RANGE 0.4f
#define APART_COST 0.8f
#define FAR 1e4f  // beyond all vectors' differences

// Sums over a column of five samples and over the middle three of it, and the range of the middle three's vectors,
// which are no float2: Mesa 22.3's llvmpipe takes a wrong one where a condition chooses between vectors.
typedef struct {
    float4 wide, wide_squares, narrow, narrow_squares;
    float least_x, least_y, most_x, most_y;
} Column;

INLINE Column column_at(const Sizes* sizes, global const storage* residual, global const float* motion, int reset,
                        int x, int y) {
    Column sums = {0, 0, 0, 0, FAR, FAR, -FAR, -FAR};
    const int column = clamp(x, 0, OUT_WIDTH - 1);
#pragma unroll
    for (int j = -2; j <= 2; ++j) {
        const float4 sample = LOAD_CHANNELS(RESIDUAL, residual, column, clamp(y + j, 0, OUT_HEIGHT - 1), 0);
        sums.wide += sample;
        sums.wide_squares += sample * sample;
        if (j < -1 || j > 1) continue;
        sums.narrow += sample;
        sums.narrow_squares += sample * sample;
        const int row = clamp(y + j, 0, OUT_HEIGHT - 1);
        const float vector_x = motion[AT(MOTION, column, row, 0)], vector_y = motion[AT(MOTION, column, row, 1)];
        const int valid = !reset && is_finite(vector_x) && is_finite(vector_y);
        sums.least_x = valid ? fmin(sums.least_x, vector_x) : -FAR;
        sums.least_y = valid ? fmin(sums.least_y, vector_y) : -FAR;
        sums.most_x = valid ? fmax(sums.most_x, vector_x) : FAR;
        sums.most_y = valid ? fmax(sums.most_y, vector_y) : FAR;
    }
    return sums;
}

// The square of the mean's size over that of the deviation that the mean of so many has by chance.
INLINE float chance(float4 sum, float4 squares, float count, float allowed_deviations) {
    const float4 mean = sum / count, variance = fmax(squares / count - mean * mean, 0.0f);
    const float size = mean.x * mean.x + mean.y * mean.y + mean.z * mean.z;
    return size /
           (((variance.x + variance.y + variance.z) / count + ALLOWED) * allowed_deviations * allowed_deviations);
}

INLINE float trust_in(const Sizes* sizes, const Column* c, float2 vector, int reset) {
    const float4 narrow = c[1].narrow + c[2].narrow + c[3].narrow;
    const float4 narrow_squares = c[1].narrow_squares + c[2].narrow_squares + c[3].narrow_squares;
    const float4 wide = c[0].wide + c[1].wide + c[2].wide + c[3].wide + c[4].wide;
    const float4 wide_squares =
        c[0].wide_squares + c[1].wide_squares + c[2].wide_squares + c[3].wide_squares + c[4].wide_squares;
    const int valid = !reset && is_finite(vector.x) && is_finite(vector.y);
    const float length = valid ? sqrt(vector.x * vector.x + vector.y * vector.y) : 0;
    const float still = fmax(1 - 4 * SCALE * length, 0.0f);
    const float doubt = mix(chance(narrow, narrow_squares, 9, NARROW), chance(wide, wide_squares, 25, WIDE), still);
#define SPAN(axis)                                                      \
    (fmax(fmax(c[1].most_##axis, c[2].most_##axis), c[3].most_##axis) - \
     fmin(fmin(c[1].least_##axis, c[2].least_##axis), c[3].least_##axis))
    const float beyond = fmax(SPAN(x), SPAN(y)) - APART - APART_SHARE * length;
    const float apart = valid ? clamp(beyond / APART_RANGE, 0.0f, 1.0f) : 1;
    return (1 - APART_COST * apart) / (1 + doubt * doubt * doubt);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void trust(Sizes given, global const storage* residual,
                                                                       global const float* motion,
                                                                       global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    Column columns[5];
    for (int i = 0; i < 4; ++i) columns[i + 1] = column_at(sizes, residual, motion, frame.reset, first - 2 + i, y);
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
#pragma unroll
        for (int i = 0; i < 4; ++i) columns[i] = columns[i + 1];
        columns[4] = column_at(sizes, residual, motion, frame.reset, x + 2, y);
        const float2 vector = (float2)(motion[AT(MOTION, x, y, 0)], motion[AT(MOTION, x, y, 1)]);
        STORE(trust_in(sizes, columns, vector, frame.reset), out, AT(OUT, x, y, 0));
    }
}
