// One frame of temporal anti-aliasing and upsampling (pipelines/filters/README.md, "taau"): history is reprojected,
// confined to what the frame's samples around the pixel allow, and blended with them.
//
// A pixel of history holds a colour, the weight of the samples in it, and the variance of those samples around it.
//
// Options: COLOR_*, MOTION_* (render resolution), HISTORY_*, OUT_* (output resolution; layouts), SCALE, SCALE_REST (s
// as the sum of two floats), STORE_HALF (all but motion, which is float).

#define SHARP 4.51f      // samples' weight at a distance of d output pixels is 2^(-SHARP d²), a Gaussian with σ = 0.4
#define SOFT 2.885f      // without history, at d render pixels 2^(-SOFT d²): σ = 0.5
#define LEAST 0.04f      // share of the soft weights with history: for a pixel that no sample is near to
#define DEVIATIONS 1.0f  // how far from the samples' mean history may be, in their standard deviations
#define MOST 24.0f       // weight of history

INLINE float4 to_ycocg(float4 c) {
    return (float4)(0.25f * (c.x + c.z) + 0.5f * c.y, 0.5f * (c.x - c.z), 0.5f * c.y - 0.25f * (c.x + c.z), 0);
}
INLINE float4 to_rgb(float4 c) { return (float4)(c.x + c.y - c.z, c.x + c.z, c.x - c.y - c.z, 0); }

// 2^(-factor d²) of the distances to the nearest sample, at `offset`, and to those before and after it.
INLINE float4 falloff(float offset, float spacing, float factor) {
    const float4 distance = (offset + (float4)(-1, 0, 1, 0)) * spacing;
    return exp2_float4(fmax(-factor * distance * distance, -126.0f));
}

// Catmull-Rom.
INLINE float4 history_color(global const storage* history, int column, int row, float4 along_x, float4 along_y) {
    const int4 taps = (int4)(-1, 0, 1, 2);
    const int4 columns = clamp(column + taps, 0, HISTORY_WIDTH - 1), rows = clamp(row + taps, 0, HISTORY_HEIGHT - 1);
#define PIXEL(x, y) LOAD_CHANNELS(HISTORY, history, x, y, 0)
#define ROW(y)                                                                                                   \
    (along_x.s0 * PIXEL(columns.s0, y) + along_x.s1 * PIXEL(columns.s1, y) + along_x.s2 * PIXEL(columns.s2, y) + \
     along_x.s3 * PIXEL(columns.s3, y))
    return along_y.s0 * ROW(rows.s0) + along_y.s1 * ROW(rows.s1) + along_y.s2 * ROW(rows.s2) +
           along_y.s3 * ROW(rows.s3);
#undef ROW
#undef PIXEL
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void accumulate(global const storage* color,
                                                                            global const float* motion,
                                                                            global const storage* history,
                                                                            global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;

    // The frame's samples: the nearest and those around it.
    const Coordinate u = source_coordinate(x, SCALE, SCALE_REST, frame.jitter_x);
    const Coordinate v = source_coordinate(y, SCALE, SCALE_REST, frame.jitter_y);
    const int column = u.whole + (u.fraction >= 0.5f), row = v.whole + (v.fraction >= 0.5f);
    const float offset_x = (u.fraction >= 0.5f) - u.fraction, offset_y = (v.fraction >= 0.5f) - v.fraction;
    float sharp_x[4], sharp_y[4], soft_x[4], soft_y[4];
    vstore4(falloff(offset_x, SCALE, SHARP), 0, sharp_x);
    vstore4(falloff(offset_y, SCALE, SHARP), 0, sharp_y);
    vstore4(falloff(offset_x, 1, SOFT), 0, soft_x);
    vstore4(falloff(offset_y, 1, SOFT), 0, soft_y);
    float4 mean = 0, square = 0, sharp = 0, soft = 0;
    float sharp_weight = 0, soft_weight = 0;
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const int sample_x = clamp(column + i % 3 - 1, 0, COLOR_WIDTH - 1);
        const int sample_y = clamp(row + i / 3 - 1, 0, COLOR_HEIGHT - 1);
        const float4 sample = to_ycocg(LOAD_CHANNELS(COLOR, color, sample_x, sample_y, 0));
        const float sharp_share = sharp_x[i % 3] * sharp_y[i / 3], soft_share = soft_x[i % 3] * soft_y[i / 3];
        mean += sample / 9;
        square += sample * sample / 9;
        sharp += sharp_share * sample;
        soft += soft_share * sample;
        sharp_weight += sharp_share;
        soft_weight += soft_share;
    }

    // Where the surface was.
    const Coordinate mx = source_coordinate(x, SCALE, SCALE_REST, frame.motion_jitter_x - 0.5f);
    const Coordinate my = source_coordinate(y, SCALE, SCALE_REST, frame.motion_jitter_y - 0.5f);
    const int vector_x = clamp(mx.whole, 0, MOTION_WIDTH - 1), vector_y = clamp(my.whole, 0, MOTION_HEIGHT - 1);
    const float from_x = x + SCALE * motion[AT(MOTION, vector_x, vector_y, 0)];
    const float from_y = y + SCALE * motion[AT(MOTION, vector_x, vector_y, 1)];
    // An invalid vector is not a number, and so not inside.
    const bool known = !frame.reset && from_x >= -0.5f && from_x <= HISTORY_WIDTH - 0.5f && from_y >= -0.5f &&
                       from_y <= HISTORY_HEIGHT - 0.5f;

    float4 result = soft / soft_weight;
    float weight = sharp_weight + LEAST * soft_weight, variance = 0;
    if (known) {
        const int left = whole_part(from_x), top = whole_part(from_y);
        const float s = from_x - left, t = from_y - top;
        const float4 before = to_ycocg(history_color(history, left, top, keys(s), keys(t)));
        const Taps tx = clamped_taps(left, s, HISTORY_WIDTH), ty = clamped_taps(top, t, HISTORY_HEIGHT);
        const float4 facts = BILINEAR(HISTORY, history, tx, ty, 3);
        const float4 current = (sharp + LEAST * soft) / weight;

        const float4 deviation = sqrt(fmax(square - mean * mean, 0.0f));
        const float4 reach = fmax(DEVIATIONS * deviation, sqrt(facts.y));
        const float4 confined = clamp(before, mean - reach, mean + reach);
        const float4 change = current - confined, excess = confined - before;
        // History that had to be changed counts for less.
        const float believed = facts.x / (1 + dot(excess, excess) / (0.001f + dot(reach, reach)));
        const float share = weight / (believed + weight);
        result = confined + share * change;
        variance = (1 - share) * (facts.y + share * dot(change, change));
        weight = fmin(believed + weight, MOST);
    }
    const float4 rgb = clamp(to_rgb(result), 0.0f, 1.0f);
    STORE_CHANNELS(OUT, ((float4)(rgb.xyz, weight)), out, x, y, 0);
    STORE(variance, out, AT(OUT, x, y, 4));
}
