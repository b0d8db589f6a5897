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

#define LESSER(a, b) ((a) < (b) ? (a) : (b))
#define GREATER(a, b) ((a) > (b) ? (a) : (b))

// Defines blend_float (blend_float16), the confinement of history and its blend with the samples around the pixel, in
// YCoCg: their mean and deviation, weighted sums and those weights. `known` is the weight of history, negative where
// there is none. The result is what is stored of a pixel.
#define DEFINE_BLEND(real)                                                                                          \
    INLINE void blend_##real(const real* mean, const real* deviation, const real* sharp, const real* soft,          \
                             real sharp_weight, real soft_weight, const real* before, real known, real varied,      \
                             real* result) {                                                                        \
        const real weight = sharp_weight + LEAST * soft_weight, share_of_sum = 1 / weight, spread = sqrt(varied);   \
        real confined[3], change[3], moved = 0, reached = 0, changed = 0;                                           \
        for (int c = 0; c < 3; ++c) {                                                                               \
            const real reach = GREATER(DEVIATIONS * deviation[c], spread);                                          \
            const real raised = GREATER(before[c], mean[c] - reach);                                                \
            confined[c] = LESSER(raised, mean[c] + reach);                                                          \
            change[c] = (sharp[c] + LEAST * soft[c]) * share_of_sum - confined[c];                                  \
            moved += (confined[c] - before[c]) * (confined[c] - before[c]);                                         \
            reached += reach * reach;                                                                               \
            changed += change[c] * change[c];                                                                       \
        }                                                                                                           \
        /* History that had to be moved counts for less. */                                                         \
        const real believed = known * (0.001f + reached) / (0.001f + reached + moved);                              \
        const real share = weight / (believed + weight), soft_share = 1 / soft_weight;                              \
        real ycocg[3];                                                                                              \
        for (int c = 0; c < 3; ++c) ycocg[c] = known >= 0 ? confined[c] + share * change[c] : soft[c] * soft_share; \
        result[0] = ycocg[0] + ycocg[1] - ycocg[2];                                                                 \
        result[1] = ycocg[0] + ycocg[2];                                                                            \
        result[2] = ycocg[0] - ycocg[1] - ycocg[2];                                                                 \
        for (int c = 0; c < 3; ++c) {                                                                               \
            result[c] = result[c] > 0 ? result[c] : (real)(0);                                                      \
            result[c] = result[c] < 1 ? result[c] : (real)(1);                                                      \
        }                                                                                                           \
        const real sum = believed + weight, most = sum < MOST ? sum : (real)(MOST);                                 \
        result[3] = known >= 0 ? most : weight;                                                                     \
        result[4] = known >= 0 ? (1 - share) * (varied + share * changed) : (real)(0);                              \
    }

// 2^(-factor d²) of the distances to the nearest sample, at `offset`, and to those before and after it; never less than
// what can be squared.
INLINE float4 falloff(float offset, float spacing, float factor) {
    const float4 distance = (offset + (float4)(-1, 0, 1, 0)) * spacing;
    return exp2_float4(fmax(-factor * distance * distance, -50.0f));
}

typedef struct {
    float4 color;  // in YCoCg
    float weight;  // negative where there is no history
    float variance;
} History;

// Of pixel (x, y), along the motion vector of render column `vector_x` and its row: Catmull-Rom for the colour.
INLINE History find_history(global const float* motion, global const storage* history, Frame frame, int x, int y,
                            int vector_x, int vector_y) {
    const float from_x = x + SCALE * motion[AT(MOTION, vector_x, vector_y, 0)];
    const float from_y = y + SCALE * motion[AT(MOTION, vector_x, vector_y, 1)];
    // An invalid vector is not a number, and so not inside.
    const bool known = !frame.reset && from_x >= -0.5f && from_x <= HISTORY_WIDTH - 0.5f && from_y >= -0.5f &&
                       from_y <= HISTORY_HEIGHT - 0.5f;
    History found = {0, -1, 0};
    if (!known) return found;
    const int column = whole_part(from_x), row = whole_part(from_y);
    const float s = from_x - column, t = from_y - row;
    const int4 taps = (int4)(-1, 0, 1, 2);
    const int4 columns = clamp(column + taps, (int4)(0), (int4)(HISTORY_WIDTH - 1)),
               rows = clamp(row + taps, (int4)(0), (int4)(HISTORY_HEIGHT - 1));
#define PIXEL(x, y) LOAD_CHANNELS(HISTORY, history, x, y, 0)
    float4 color, facts;
    if (s == 0 && t == 0) {  // what stands still
        color = PIXEL(columns.s1, rows.s1);
        facts = LOAD_CHANNELS(HISTORY, history, columns.s1, rows.s1, 3);
    } else {
        const float4 along_x = keys(s), along_y = keys(t);
#define ROW(y)                                                                                                   \
    (along_x.s0 * PIXEL(columns.s0, y) + along_x.s1 * PIXEL(columns.s1, y) + along_x.s2 * PIXEL(columns.s2, y) + \
     along_x.s3 * PIXEL(columns.s3, y))
        color = along_y.s0 * ROW(rows.s0) + along_y.s1 * ROW(rows.s1) + along_y.s2 * ROW(rows.s2) +
                along_y.s3 * ROW(rows.s3);
        const Taps tx = clamped_taps(column, s, HISTORY_WIDTH), ty = clamped_taps(row, t, HISTORY_HEIGHT);
        facts = BILINEAR(HISTORY, history, tx, ty, 3);
    }
#undef ROW
#undef PIXEL
    found.color = to_ycocg(color);
    found.weight = facts.x;
    found.variance = facts.y;
    return found;
}

// The render pixel under an HR pixel's centre, along an axis of `size`.
INLINE int vector_under(int x, float motion_jitter, int size) {
    return clamp(source_coordinate(x, SCALE, SCALE_REST, motion_jitter - 0.5f).whole, 0, size - 1);
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

INLINE float4 deviation_of(float4 mean, float4 mean_square) { return sqrt(fmax(mean_square - mean * mean, 0.0f)); }

// Puts the components of a colour into three arrays.
#define SPREAD(array, i, color)         \
    do {                                \
        const float4 spread_ = (color); \
        array[0][i] = spread_.x;        \
        array[1][i] = spread_.y;        \
        array[2][i] = spread_.z;        \
    } while (0)

DEFINE_BLEND(float)

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
    float4 mean = 0, square = 0, sharp = 0, soft = 0;
    float sharp_weight = 0, soft_weight = 0;
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const float4 sample = load_sample(color, u.sample + i % 3 - 1, v.sample + i / 3 - 1);
        const float sharp_share = sharp_x[i % 3] * sharp_y[i / 3], soft_share = soft_x[i % 3] * soft_y[i / 3];
        mean += sample / 9;
        square += sample * sample / 9;
        sharp += sharp_share * sample;
        soft += soft_share * sample;
        sharp_weight += sharp_share;
        soft_weight += soft_share;
    }
    const History known =
        find_history(motion, history, frame, x, y, vector_under(x, frame.motion_jitter_x, MOTION_WIDTH),
                     vector_under(y, frame.motion_jitter_y, MOTION_HEIGHT));
    float means[3], deviations[3], sharps[3], softs[3], before[3], result[5];
    vstore3(mean.xyz, 0, means);
    vstore3(deviation_of(mean, square).xyz, 0, deviations);
    vstore3(sharp.xyz, 0, sharps);
    vstore3(soft.xyz, 0, softs);
    vstore3(known.color.xyz, 0, before);
    blend_float(means, deviations, sharps, softs, sharp_weight, soft_weight, before, known.weight, known.variance,
                result);
    for (int c = 0; c < OUT_CHANNELS; ++c) STORE(result[c], out, AT(OUT, x, y, c));
}

// For devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels. Mean and deviation
// are found for each sample under it, once, and the weighted sums first along y, for all pixels of a row; what is left
// is done for sixteen pixels at once. COLUMNS and LINES are the most samples under the strip along each axis, those
// around the nearest included. Wants results that are not in blocks.
#ifdef PIXELS
DEFINE_BLEND(float16)

#define LOAD_LANES(lanes, array, i)                                        \
    do {                                                                   \
        for (int c = 0; c < 3; ++c) lanes[c] = vload16(0, array[c] + (i)); \
    } while (0)

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
    int place[PIXELS], vector_x[PIXELS];
    float4 sharp_x[PIXELS], soft_x[PIXELS];
    for (int i = 0; i < PIXELS; ++i) {
        const Nearest u = nearest_sample(x0 + i, frame.jitter_x);
        place[i] = u.sample - first_column;
        sharp_x[i] = falloff(u.offset, SCALE, SHARP);
        soft_x[i] = falloff(u.offset, 1, SOFT);
        vector_x[i] = vector_under(x0 + i, frame.motion_jitter_x, MOTION_WIDTH);
    }
    for (int row = 0; row < rows; ++row) {
        const int y = y0 + row, vector_y = vector_under(y, frame.motion_jitter_y, MOTION_HEIGHT);
        const Nearest v = nearest_sample(y, frame.jitter_y);
        const int line = v.sample - first_line;
        const float4 sharp_y = falloff(v.offset, SCALE, SHARP), soft_y = falloff(v.offset, 1, SOFT);
        const float sharp_sum = sharp_y.x + sharp_y.y + sharp_y.z, soft_sum = soft_y.x + soft_y.y + soft_y.z;
        float4 sharp[COLUMNS], soft[COLUMNS];
        for (int i = 0; i < COLUMNS; ++i) {
            sharp[i] = sharp_y.x * sample[line - 1][i] + sharp_y.y * sample[line][i] + sharp_y.z * sample[line + 1][i];
            soft[i] = soft_y.x * sample[line - 1][i] + soft_y.y * sample[line][i] + soft_y.z * sample[line + 1][i];
        }
        float means[3][PIXELS], deviations[3][PIXELS], sharps[3][PIXELS], softs[3][PIXELS], before[3][PIXELS];
        float sharp_weights[PIXELS], soft_weights[PIXELS], known[PIXELS], varied[PIXELS], results[5][PIXELS];
        for (int i = 0; i < PIXELS; ++i) {
            const int at = place[i];
            const float4 sharp_share = sharp_x[i], soft_share = soft_x[i];
            SPREAD(means, i, mean[line][at]);
            SPREAD(deviations, i, deviation[line][at]);
            SPREAD(sharps, i,
                   sharp_share.x * sharp[at - 1] + sharp_share.y * sharp[at] + sharp_share.z * sharp[at + 1]);
            SPREAD(softs, i, soft_share.x * soft[at - 1] + soft_share.y * soft[at] + soft_share.z * soft[at + 1]);
            sharp_weights[i] = (sharp_share.x + sharp_share.y + sharp_share.z) * sharp_sum;
            soft_weights[i] = (soft_share.x + soft_share.y + soft_share.z) * soft_sum;
            const History found = find_history(motion, history, frame, x0 + i, y, vector_x[i], vector_y);
            SPREAD(before, i, found.color);
            known[i] = found.weight;
            varied[i] = found.variance;
        }
        for (int i = 0; i < PIXELS; i += 16) {
            float16 mean16[3], deviation16[3], sharp16[3], soft16[3], before16[3], result16[5];
            LOAD_LANES(mean16, means, i);
            LOAD_LANES(deviation16, deviations, i);
            LOAD_LANES(sharp16, sharps, i);
            LOAD_LANES(soft16, softs, i);
            LOAD_LANES(before16, before, i);
            blend_float16(mean16, deviation16, sharp16, soft16, vload16(0, sharp_weights + i),
                          vload16(0, soft_weights + i), before16, vload16(0, known + i), vload16(0, varied + i),
                          result16);
            for (int c = 0; c < 5; ++c) vstore16(result16[c], 0, results[c] + i);
        }
        for (int i = 0; i < pixels; ++i) {
            const int at = AT(OUT, x0 + i, y, 0);
            STORE4((float4)(results[0][i], results[1][i], results[2][i], results[3][i]), out, at);
            STORE(results[4][i], out, at + 4);
        }
    }
}
#endif
