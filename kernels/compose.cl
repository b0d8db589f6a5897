// compose(colour, past, p, s, J) of docs/clarus.md for any real s: a pixel's new history, the weighted mean of what the
// frame's samples around it show and of what was there before.
//
// Options: COLOR_*, PARAMETERS_* (render resolution), PAST_*, OUT_* (output resolution; layouts), SCALE, SCALE_REST (s
// as the sum of two floats), SHIFT_X, SHIFT_Y (the jitter, as an expression in `frame`), STORE_HALF.

#include "sample_lanes.clh"

#define LOG2_E 1.44269504f
#define ROOT_OF_LOG2_E 1.20112241f
#define LEAST_NORM 1e-3f
#define MOST 64.0f
// A sample's share of what is at a distance of d render pixels is 2^(-NEARNESS d²): σ is 0.45 output pixels.
#define NEARNESS (SCALE * SCALE * LOG2_E / (2 * 0.45f * 0.45f))

// Defines, for float and float16, what is done to one pixel or to sixteen.
// - prepare: what all of a sample's pixels need of its parameters, in their place. Of a, b and e it makes three numbers
//   of which r is a sum of squares, without cancellation, in powers of 2 rather than of e; of l what goes with that r.
//   Then both terms of `fresh`, and sigmoids.
// - extremes: of the nine samples around, [sample][channel].
// - composed: (x, y) from the sample; `before` and `result` are colour and weight.
#define DEFINE_COMPOSE(real)                                                                               \
    INLINE real confined_##real(real v, real low, real high) {                                             \
        const real raised = GREATER(v, low);                                                               \
        return LESSER(raised, high);                                                                       \
    }                                                                                                      \
    /* 2^v within powers that floats have. */                                                              \
    INLINE real power_##real(real v, float low, float high) {                                              \
        return exp2_##real(confined_##real(v, (real)(low), (real)(high)));                                 \
    }                                                                                                      \
    INLINE real sigmoid_##real(real v) { return 1 / (1 + power_##real(-LOG2_E * v, -120, 120)); }          \
    INLINE void prepare_##real(real* p) {                                                                  \
        const real along_x = confined_##real(p[0], (real)(-6.0f), (real)(6.0f));                           \
        const real along_y = confined_##real(p[1], (real)(-6.0f), (real)(6.0f));                           \
        const real tilt = 0.95f - 1.9f / (1 + power_##real(2 * LOG2_E * p[2], -120, 120)); /* 0.95 tanh */ \
        const real root_x = ROOT_OF_LOG2_E * exp2_##real(0.5f * along_x);                                  \
        const real root_y = ROOT_OF_LOG2_E * exp2_##real(0.5f * along_y);                                  \
        p[0] = root_x;                                                                                     \
        p[1] = (1 - tilt * tilt) * root_y * root_y;                                                        \
        p[2] = tilt * root_y;                                                                              \
        p[3] = (0.5f / LOG2_E) * sigmoid_##real(p[3]);                                                     \
        p[4] = power_##real(p[4], -6, 4);                                                                  \
        p[5] = power_##real(p[5], -8, 4);                                                                  \
        p[6] = sigmoid_##real(p[6]);                                                                       \
        p[7] = sigmoid_##real(p[7]);                                                                       \
    }                                                                                                      \
    INLINE void extremes_##real(real samples[9][3], real* low, real* high) {                               \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                    \
            low[c] = high[c] = samples[0][c];                                                              \
            _Pragma("unroll") for (int i = 1; i < 9; ++i) {                                                \
                low[c] = LESSER(samples[i][c], low[c]);                                                    \
                high[c] = GREATER(samples[i][c], high[c]);                                                 \
            }                                                                                              \
        }                                                                                                  \
    }                                                                                                      \
    INLINE void composed_##real(const Sizes* sizes, const real* p, real samples[9][3], const real* low,    \
                                const real* high, real x, real y, const real* before, real* result) {      \
        real total[3] = {0, 0, 0}, norm = 0;                                                               \
        _Pragma("unroll") for (int i = 0; i < 9; ++i) {                                                    \
            const real fx = (float)(i % 3 - 1) - x, fy = (float)(i / 3 - 1) - y;                           \
            const real along = p[0] * fx + p[2] * fy, r = along * along + p[1] * fy * fy;                  \
            const real weight = exp2_##real(GREATER(-r, (real)(-120.0f))) * (1 - p[3] * r);                \
            norm += weight;                                                                                \
            _Pragma("unroll") for (int c = 0; c < 3; ++c) total[c] = MAD(weight, samples[i][c], total[c]); \
        }                                                                                                  \
        const real share_of_norm = 1 / GREATER(norm, (real)(LEAST_NORM));                                  \
        const real nearness = power_##real(-NEARNESS * (x * x + y * y), -120, 0);                          \
        const real fresh = p[4] * nearness + p[5], kept = p[6] * before[3], weight = kept + fresh;         \
        const real share = 1 / weight;                                                                     \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                    \
            const real free = total[c] * share_of_norm + p[8 + c] + x * p[11 + c] + y * p[14 + c];         \
            const real estimate = confined_##real(free, low[c], high[c]);                                  \
            const real held = confined_##real(before[c], low[c], high[c]);                                 \
            result[c] = (kept * (held + p[7] * (before[c] - held)) + fresh * estimate) * share;            \
        }                                                                                                  \
        result[3] = LESSER(weight, (real)(MOST));                                                          \
    }

DEFINE_COMPOSE(float)

INLINE void compose_pixel(const Sizes* sizes, global const storage* color, global const storage* past,
                          global const storage* parameters, global storage* out, Frame frame, int x, int y) {
    const Nearest u = nearest_sample(sizes, x, SHIFT_X, COLOR_WIDTH),
                  v = nearest_sample(sizes, y, SHIFT_Y, COLOR_HEIGHT);
    float p[20], samples[9][3], low[3], high[3], before[4], result[4];
    for (int c = 0; c < 17; ++c) p[c] = LOAD(parameters, AT(PARAMETERS, u.sample, v.sample, c));
    prepare_float(p);
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const float4 sample = LOAD_CHANNELS(COLOR, color, clamp(u.sample + i % 3 - 1, 0, COLOR_WIDTH - 1),
                                            clamp(v.sample + i / 3 - 1, 0, COLOR_HEIGHT - 1), 0);
        samples[i][0] = sample.x;
        samples[i][1] = sample.y;
        samples[i][2] = sample.z;
    }
    extremes_float(samples, low, high);
    vstore4(LOAD_CHANNELS(PAST, past, x, y, 0), 0, before);
    composed_float(sizes, p, samples, low, high, u.offset, v.offset, before, result);
    STORE_CHANNELS(OUT, vload4(0, result), out, x, y, 0);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void compose(Sizes given, global const storage* color,
                                                                         global const storage* past,
                                                                         global const storage* parameters,
                                                                         global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x < OUT_WIDTH && y < OUT_HEIGHT) compose_pixel(sizes, color, past, parameters, out, frame, x, y);
}

// For devices that make vectors of what a work-item says is one: all pixels whose nearest samples are LANES × ROWS.
// What their samples have in common is found once; then vectors are of pixels that are the first ones of their samples,
// the second ones, and so on to PHASES.
#ifdef MOST_PHASES
DEFINE_COMPOSE(float16)

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void compose_lanes(Sizes given, global const storage* color,
                                                                               global const storage* past,
                                                                               global const storage* parameters,
                                                                               global storage* restrict out,
                                                                               Frame frame) {
    TAKE(sizes);
    const int first = LANES * get_global_id(0), first_row = ROWS * ROW_ITEM(1);
    const Strip strip = find_strip(sizes, first, SHIFT_X);
    int predicted[LANES];
    for (int i = 0; i < LANES; ++i) predicted[i] = PARAMETERS_STRIDE * min(first + i, COLOR_WIDTH - 1);
    int y = first_pixel(sizes, first_row, SHIFT_Y, COLOR_HEIGHT, OUT_HEIGHT);
    float16 samples[9][3];
    load_samples(sizes, color, first_row - 1, strip.around, samples + 3);
    load_samples(sizes, color, first_row, strip.around, samples + 6);
    for (int row = first_row; row < min(first_row + ROWS, COLOR_HEIGHT); ++row) {
#pragma unroll
        for (int i = 0; i < 6; ++i)
#pragma unroll
            for (int c = 0; c < 3; ++c) samples[i][c] = samples[i + 3][c];
        load_samples(sizes, color, row + 1, strip.around, samples + 6);
        const int end_y = first_pixel(sizes, row + 1, SHIFT_Y, COLOR_HEIGHT, OUT_HEIGHT);
        if (y == end_y) continue;
        prefetch_row(color + AT(COLOR, first, min(row + 2, COLOR_HEIGHT - 1), 0), LANES * COLOR_STRIDE);
        prefetch_row(parameters + AT(PARAMETERS, first, min(row + 1, COLOR_HEIGHT - 1), 0), LANES * PARAMETERS_STRIDE);
        float16 p[20], low[3], high[3];
#pragma unroll
        for (int c = 0; c < 20; c += 4) load_lanes(parameters + AT(PARAMETERS, 0, row, c), predicted, p + c);
        prepare_float16(p);
        extremes_float16(samples, low, high);
        for (; y < end_y; ++y) {
            prefetch_row(past + AT(PAST, strip.start[0], min(y + 1, OUT_HEIGHT - 1), 0), LANES * PHASES * PAST_STRIDE);
            const float16 down = nearest_sample(sizes, y, SHIFT_Y, COLOR_HEIGHT).offset;
            for (int phase = 0; phase < PHASES; ++phase) {
                int elements[LANES];
                for (int i = 0; i < LANES; ++i) elements[i] = PAST_STRIDE * min(strip.start[i] + phase, OUT_WIDTH - 1);
                float16 before[4], result[4];
                load_lanes(past + AT(PAST, 0, y, 0), elements, before);
                composed_float16(sizes, p, samples, low, high, vload16(0, strip.offset[phase]), down, before, result);
                store_pixels(sizes, result, &strip, phase, y, out);
            }
            // At the image's border, samples may have more pixels.
            for (int i = 0; i < LANES; ++i)
                for (int extra = PHASES; extra < strip.count[i]; ++extra)
                    compose_pixel(sizes, color, past, parameters, out, frame, strip.start[i] + extra, y);
        }
    }
}
#endif
