// One frame of temporal anti-aliasing and upsampling (pipelines/filters/README.md, "taau"): history is reprojected,
// confined to what the frame's samples around the pixel allow, and blended with them.
//
// A pixel of history holds a colour, the weight of the samples in it, and the variance of those samples around it.
//
// Options: COLOR_*, MOTION_* (render resolution), HISTORY_*, OUT_* (output resolution; layouts), SCALE, SCALE_REST (s
// as the sum of two floats), STORE_HALF (all but motion, which is float).

#define SHARP 8.0f       // samples' weight at a distance of d output pixels is 2^(-SHARP d²), a Gaussian with σ = 0.3
#define SOFT 2.885f      // without history, at d render pixels 2^(-SOFT d²): σ = 0.5
#define LEAST 0.003f     // share of the soft weights with history: for a pixel that no sample is near to
#define DEVIATIONS 1.5f  // how far from the samples' mean history may be, in their standard deviations
#define MOST 12.0f       // weight of history

INLINE float4 to_ycocg(float4 c) {
    return (float4)(0.25f * (c.x + c.z) + 0.5f * c.y, 0.5f * (c.x - c.z), 0.5f * c.y - 0.25f * (c.x + c.z), 0);
}
INLINE float4 to_rgb(float4 c) { return (float4)(c.x + c.y - c.z, c.x + c.z, c.x - c.y - c.z, 0); }

// 2^(-factor d²) of the distances to the nearest sample, at `offset`, and to those before and after it; never less than
// what can be squared.
INLINE float4 falloff(float offset, float spacing, float factor) {
    const float4 distance = (offset + (float4)(-1, 0, 1, 0)) * spacing;
    return exp2_float4(fmax(-factor * distance * distance, -50.0f));
}

// Catmull-Rom around index coordinate (column + s, row + t).
INLINE float4 history_color(global const storage* history, int column, int row, float s, float t) {
    const int4 taps = (int4)(-1, 0, 1, 2);
    const int4 columns = clamp(column + taps, 0, HISTORY_WIDTH - 1), rows = clamp(row + taps, 0, HISTORY_HEIGHT - 1);
#define PIXEL(x, y) LOAD_CHANNELS(HISTORY, history, x, y, 0)
    if (s == 0 && t == 0) return PIXEL(columns.s1, rows.s1);  // what stands still
    const float4 along_x = keys(s), along_y = keys(t);
#define ROW(y)                                                                                                   \
    (along_x.s0 * PIXEL(columns.s0, y) + along_x.s1 * PIXEL(columns.s1, y) + along_x.s2 * PIXEL(columns.s2, y) + \
     along_x.s3 * PIXEL(columns.s3, y))
    return along_y.s0 * ROW(rows.s0) + along_y.s1 * ROW(rows.s1) + along_y.s2 * ROW(rows.s2) +
           along_y.s3 * ROW(rows.s3);
#undef ROW
#undef PIXEL
}

// What the frame's samples around a pixel amount to: the nearest one and its eight neighbours.
typedef struct {
    float4 mean, deviation;  // of all nine, alike
    float4 sharp, soft;      // weighted sums
    float sharp_weight, soft_weight;
} Samples;

INLINE float4 deviation_of(float4 mean, float4 mean_square) { return sqrt(fmax(mean_square - mean * mean, 0.0f)); }

// The pixel's history, blended with its samples.
INLINE void blend(Samples samples, global const float* motion, global const storage* history, global storage* out,
                  Frame frame, int x, int y) {
    // Where the surface was.
    const Coordinate mx = source_coordinate(x, SCALE, SCALE_REST, frame.motion_jitter_x - 0.5f);
    const Coordinate my = source_coordinate(y, SCALE, SCALE_REST, frame.motion_jitter_y - 0.5f);
    const int vector_x = clamp(mx.whole, 0, MOTION_WIDTH - 1), vector_y = clamp(my.whole, 0, MOTION_HEIGHT - 1);
    const float from_x = x + SCALE * motion[AT(MOTION, vector_x, vector_y, 0)];
    const float from_y = y + SCALE * motion[AT(MOTION, vector_x, vector_y, 1)];
    // An invalid vector is not a number, and so not inside.
    const bool known = !frame.reset && from_x >= -0.5f && from_x <= HISTORY_WIDTH - 0.5f && from_y >= -0.5f &&
                       from_y <= HISTORY_HEIGHT - 0.5f;

    float4 result = samples.soft / samples.soft_weight;
    float weight = samples.sharp_weight + LEAST * samples.soft_weight, variance = 0;
    if (known) {
        const int left = whole_part(from_x), top = whole_part(from_y);
        const float s = from_x - left, t = from_y - top;
        const float4 before = to_ycocg(history_color(history, left, top, s, t));
        const Taps tx = clamped_taps(left, s, HISTORY_WIDTH), ty = clamped_taps(top, t, HISTORY_HEIGHT);
        const float4 facts = BILINEAR(HISTORY, history, tx, ty, 3);
        const float4 current = (samples.sharp + LEAST * samples.soft) / weight;

        const float4 reach = fmax(DEVIATIONS * samples.deviation, sqrt(facts.y));
        const float4 confined = clamp(before, samples.mean - reach, samples.mean + reach);
        const float4 change = current - confined, excess = confined - before;
        // History that had to be moved counts for less.
        const float believed = facts.x / (1 + dot(excess.xyz, excess.xyz) / (0.001f + dot(reach.xyz, reach.xyz)));
        const float share = weight / (believed + weight);
        result = confined + share * change;
        variance = (1 - share) * (facts.y + share * dot(change.xyz, change.xyz));
        weight = fmin(believed + weight, MOST);
    }
    const float4 rgb = clamp(to_rgb(result), 0.0f, 1.0f);
    STORE_CHANNELS(OUT, ((float4)(rgb.xyz, weight)), out, x, y, 0);
    STORE(variance, out, AT(OUT, x, y, 4));
}

// The nearest sample along an axis, and how far it is away in render pixels.
typedef struct {
    int sample;
    float offset;
} Nearest;

INLINE Nearest nearest_sample(int x, float jitter) {
    const Coordinate u = source_coordinate(x, SCALE, SCALE_REST, jitter);
    const int second = u.fraction >= 0.5f;
    const Nearest nearest = {u.whole + second, second - u.fraction};
    return nearest;
}

INLINE float4 load_sample(global const storage* color, int x, int y) {
    return to_ycocg(LOAD_CHANNELS(COLOR, color, clamp(x, 0, COLOR_WIDTH - 1), clamp(y, 0, COLOR_HEIGHT - 1), 0));
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void accumulate(global const storage* color,
                                                                            global const float* motion,
                                                                            global const storage* history,
                                                                            global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Nearest u = nearest_sample(x, frame.jitter_x), v = nearest_sample(y, frame.jitter_y);
    float sharp_x[4], sharp_y[4], soft_x[4], soft_y[4];
    vstore4(falloff(u.offset, SCALE, SHARP), 0, sharp_x);
    vstore4(falloff(v.offset, SCALE, SHARP), 0, sharp_y);
    vstore4(falloff(u.offset, 1, SOFT), 0, soft_x);
    vstore4(falloff(v.offset, 1, SOFT), 0, soft_y);
    Samples samples = {0, 0, 0, 0, 0, 0};
    float4 square = 0;
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const float4 sample = load_sample(color, u.sample + i % 3 - 1, v.sample + i / 3 - 1);
        const float sharp_share = sharp_x[i % 3] * sharp_y[i / 3], soft_share = soft_x[i % 3] * soft_y[i / 3];
        samples.mean += sample / 9;
        square += sample * sample / 9;
        samples.sharp += sharp_share * sample;
        samples.soft += soft_share * sample;
        samples.sharp_weight += sharp_share;
        samples.soft_weight += soft_share;
    }
    samples.deviation = deviation_of(samples.mean, square);
    blend(samples, motion, history, out, frame, x, y);
}

// For devices that run a group as one thread: a strip of PIXELS × ROWS pixels. Mean and deviation are found for each
// sample under it, once, and the weighted sums first along y, for all pixels of a row. COLUMNS and LINES are the most
// samples under the strip along each axis, those around the nearest included.
#ifdef PIXELS
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void accumulate_strip(global const storage* color,
                                                                                  global const float* motion,
                                                                                  global const storage* history,
                                                                                  global storage* out, Frame frame) {
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * get_global_id(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0), rows = min(ROWS, OUT_HEIGHT - y0);
    const int first_column = nearest_sample(x0, frame.jitter_x).sample - 1;
    const int first_line = nearest_sample(y0, frame.jitter_y).sample - 1;
    float4 sample[LINES][COLUMNS], mean[LINES][COLUMNS], deviation[LINES][COLUMNS];
    for (int j = 0; j < LINES; ++j)
        for (int i = 0; i < COLUMNS; ++i) sample[j][i] = load_sample(color, first_column + i, first_line + j);
    for (int j = 1; j < LINES - 1; ++j) {
        for (int i = 1; i < COLUMNS - 1; ++i) {
            float4 sum = 0, square = 0;
#pragma unroll
            for (int tap = 0; tap < 9; ++tap) {
                const float4 each = sample[j + tap / 3 - 1][i + tap % 3 - 1];
                sum += each;
                square += each * each;
            }
            mean[j][i] = sum / 9;
            deviation[j][i] = deviation_of(mean[j][i], square / 9);
        }
    }
    int place[PIXELS];
    float4 sharp_x[PIXELS], soft_x[PIXELS];
    for (int i = 0; i < pixels; ++i) {
        const Nearest u = nearest_sample(x0 + i, frame.jitter_x);
        place[i] = u.sample - first_column;
        sharp_x[i] = falloff(u.offset, SCALE, SHARP);
        soft_x[i] = falloff(u.offset, 1, SOFT);
    }
    for (int row = 0; row < rows; ++row) {
        const Nearest v = nearest_sample(y0 + row, frame.jitter_y);
        const int line = v.sample - first_line;
        const float4 sharp_y = falloff(v.offset, SCALE, SHARP), soft_y = falloff(v.offset, 1, SOFT);
        float4 sharp[COLUMNS], soft[COLUMNS];
        for (int i = 0; i < COLUMNS; ++i) {
            sharp[i] = sharp_y.x * sample[line - 1][i] + sharp_y.y * sample[line][i] + sharp_y.z * sample[line + 1][i];
            soft[i] = soft_y.x * sample[line - 1][i] + soft_y.y * sample[line][i] + soft_y.z * sample[line + 1][i];
        }
        for (int i = 0; i < pixels; ++i) {
            const int at = place[i];
            const float4 sharp_share = sharp_x[i], soft_share = soft_x[i];
            Samples samples;
            samples.mean = mean[line][at];
            samples.deviation = deviation[line][at];
            samples.sharp = sharp_share.x * sharp[at - 1] + sharp_share.y * sharp[at] + sharp_share.z * sharp[at + 1];
            samples.soft = soft_share.x * soft[at - 1] + soft_share.y * soft[at] + soft_share.z * soft[at + 1];
            samples.sharp_weight =
                (sharp_share.x + sharp_share.y + sharp_share.z) * (sharp_y.x + sharp_y.y + sharp_y.z);
            samples.soft_weight = (soft_share.x + soft_share.y + soft_share.z) * (soft_y.x + soft_y.y + soft_y.z);
            blend(samples, motion, history, out, frame, x0 + i, y0 + row);
        }
    }
}
#endif
