// compose(colour, past, p, s, J) of docs/clarus.md for any real s: a pixel's new history, the weighted mean of what the
// frame's samples around it show and of what was there before.
//
// Options: COLOR_*, PARAMETERS_* (render resolution), PAST_*, OUT_* (output resolution; layouts), SCALE, SCALE_REST (s
// as the sum of two floats), SHIFT_X, SHIFT_Y (the jitter, as an expression in `frame`), STORE_HALF.

#define LOG2_E 1.44269504f
#define ROOT_OF_LOG2_E 1.20112241f
#define LEAST_NORM 1e-3f
#define MOST 64.0f
// A sample's share of what is at a distance of d render pixels is 2^(-NEARNESS d²): σ is 0.45 output pixels.
#define NEARNESS (SCALE * SCALE * LOG2_E / (2 * 0.45f * 0.45f))

#define LESSER(a, b) ((a) < (b) ? (a) : (b))
#define GREATER(a, b) ((a) > (b) ? (a) : (b))

// The nearest sample along an axis, the later one of two that are as near whatever the rounding, and how far beyond it
// the pixel is, in render pixels.
typedef struct {
    int sample;
    float offset;
} Nearest;

INLINE Nearest nearest_sample(int x, float jitter, int size) {
    const Coordinate u = source_coordinate(x, SCALE, SCALE_REST, jitter);
    const int sample = clamp(u.whole + (u.fraction >= 0.5f - 1.0f / 4096), 0, size - 1);
    const Nearest nearest = {sample, (u.whole - sample) + u.fraction};
    return nearest;
}

// Defines, for float and float16, what is done to one pixel or to sixteen.
// - prepare: what all of a sample's pixels need of its parameters, in their place. Of a, b and e it makes three numbers
//   of which r is a sum of squares, without cancellation, in powers of 2 rather than of e; of l what goes with that r.
//   Then both terms of `fresh`, and sigmoids.
// - extremes: of the nine samples around, [sample][channel].
// - composed: (x, y) from the sample; `before` and `result` are colour and weight.
#define DEFINE_COMPOSE(real)                                                                                          \
    INLINE real confined_##real(real v, real low, real high) {                                                        \
        const real raised = GREATER(v, low);                                                                          \
        return LESSER(raised, high);                                                                                  \
    }                                                                                                                 \
    /* 2^v within powers that floats have. */                                                                         \
    INLINE real power_##real(real v, float low, float high) {                                                         \
        return exp2_##real(confined_##real(v, (real)(low), (real)(high)));                                            \
    }                                                                                                                 \
    INLINE real sigmoid_##real(real v) { return 1 / (1 + power_##real(-LOG2_E * v, -120, 120)); }                     \
    INLINE void prepare_##real(real* p) {                                                                             \
        const real along_x = confined_##real(p[0], (real)(-6.0f), (real)(6.0f));                                      \
        const real along_y = confined_##real(p[1], (real)(-6.0f), (real)(6.0f));                                      \
        const real tilt = 0.95f - 1.9f / (1 + power_##real(2 * LOG2_E * p[2], -120, 120)); /* 0.95 tanh */            \
        const real root_x = ROOT_OF_LOG2_E * exp2_##real(0.5f * along_x);                                             \
        const real root_y = ROOT_OF_LOG2_E * exp2_##real(0.5f * along_y);                                             \
        p[0] = root_x;                                                                                                \
        p[1] = (1 - tilt * tilt) * root_y * root_y;                                                                   \
        p[2] = tilt * root_y;                                                                                         \
        p[3] = (0.5f / LOG2_E) * sigmoid_##real(p[3]);                                                                \
        p[4] = power_##real(p[4], -6, 4);                                                                             \
        p[5] = power_##real(p[5], -8, 4);                                                                             \
        p[6] = sigmoid_##real(p[6]);                                                                                  \
        p[7] = sigmoid_##real(p[7]);                                                                                  \
    }                                                                                                                 \
    INLINE void extremes_##real(real samples[9][3], real* low, real* high) {                                          \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                               \
            low[c] = high[c] = samples[0][c];                                                                         \
            _Pragma("unroll") for (int i = 1; i < 9; ++i) {                                                           \
                low[c] = LESSER(samples[i][c], low[c]);                                                               \
                high[c] = GREATER(samples[i][c], high[c]);                                                            \
            }                                                                                                         \
        }                                                                                                             \
    }                                                                                                                 \
    INLINE void composed_##real(const real* p, real samples[9][3], const real* low, const real* high, real x, real y, \
                                const real* before, real* result) {                                                   \
        real total[3] = {0, 0, 0}, norm = 0;                                                                          \
        _Pragma("unroll") for (int i = 0; i < 9; ++i) {                                                               \
            const real fx = (float)(i % 3 - 1) - x, fy = (float)(i / 3 - 1) - y;                                      \
            const real along = p[0] * fx + p[2] * fy, r = along * along + p[1] * fy * fy;                             \
            const real weight = exp2_##real(GREATER(-r, (real)(-120.0f))) * (1 - p[3] * r);                           \
            norm += weight;                                                                                           \
            _Pragma("unroll") for (int c = 0; c < 3; ++c) total[c] = MAD(weight, samples[i][c], total[c]);            \
        }                                                                                                             \
        const real share_of_norm = 1 / GREATER(norm, (real)(LEAST_NORM));                                             \
        const real nearness = power_##real(-NEARNESS * (x * x + y * y), -120, 0);                                     \
        const real fresh = p[4] * nearness + p[5], kept = p[6] * before[3], weight = kept + fresh;                    \
        const real share = 1 / weight;                                                                                \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                               \
            const real free = total[c] * share_of_norm + p[8 + c] + x * p[11 + c] + y * p[14 + c];                    \
            const real estimate = confined_##real(free, low[c], high[c]);                                             \
            const real held = confined_##real(before[c], low[c], high[c]);                                            \
            result[c] = (kept * (held + p[7] * (before[c] - held)) + fresh * estimate) * share;                       \
        }                                                                                                             \
        result[3] = LESSER(weight, (real)(MOST));                                                                     \
    }

DEFINE_COMPOSE(float)

INLINE void compose_pixel(global const storage* color, global const storage* past, global const storage* parameters,
                          global storage* out, Frame frame, int x, int y) {
    const Nearest u = nearest_sample(x, SHIFT_X, COLOR_WIDTH), v = nearest_sample(y, SHIFT_Y, COLOR_HEIGHT);
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
    composed_float(p, samples, low, high, u.offset, v.offset, before, result);
    STORE_CHANNELS(OUT, vload4(0, result), out, x, y, 0);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void compose(global const storage* color,
                                                                         global const storage* past,
                                                                         global const storage* parameters,
                                                                         global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x < OUT_WIDTH && y < OUT_HEIGHT) compose_pixel(color, past, parameters, out, frame, x, y);
}

// For devices that make vectors of what a work-item says is one: all pixels whose nearest samples are LANES × ROWS.
// What their samples have in common is found once; then vectors are of pixels that are the first ones of their samples,
// the second ones, and so on to PHASES, the most that a sample inside the image has along an axis.
#ifdef PHASES
#define LANES 16

DEFINE_COMPOSE(float16)

// The first of the pixels along an axis whose nearest sample is this or a later one.
INLINE int first_pixel(int sample, float jitter, int samples, int pixels) {
    if (sample <= 0) return 0;
    if (sample >= samples) return pixels;
    int x = (int)clamp((sample + jitter) * SCALE, 0.0f, (float)pixels);
    while (x > 0 && nearest_sample(x - 1, jitter, samples).sample >= sample) --x;
    while (x < pixels && nearest_sample(x, jitter, samples).sample < sample) ++x;
    return x;
}

// Four vectors of four pixels each, the first of pixels 0, 4, 8 and 12, the second of 1, 5, 9 and 13, …, become four of
// one channel each, and the other way round.
INLINE float16 first_halves(float16 a, float16 b) {
    return (float16)(a.s0, b.s0, a.s1, b.s1, a.s4, b.s4, a.s5, b.s5, a.s8, b.s8, a.s9, b.s9, a.sc, b.sc, a.sd, b.sd);
}
INLINE float16 second_halves(float16 a, float16 b) {
    return (float16)(a.s2, b.s2, a.s3, b.s3, a.s6, b.s6, a.s7, b.s7, a.sa, b.sa, a.sb, b.sb, a.se, b.se, a.sf, b.sf);
}
INLINE void transpose(float16* v) {
    const float16 a = first_halves(v[0], v[2]), b = first_halves(v[1], v[3]);
    const float16 c = second_halves(v[0], v[2]), d = second_halves(v[1], v[3]);
    v[0] = first_halves(a, b);
    v[1] = second_halves(a, b);
    v[2] = first_halves(c, d);
    v[3] = second_halves(c, d);
}

// Four channels, a vector each, of sixteen pixels that begin so many elements beyond p; those that an image lacks are
// anything.
INLINE void load_lanes(global const storage* p, const int* elements, float16* lanes) {
#pragma unroll
    for (int i = 0; i < 4; ++i)
        lanes[i] = (float16)(LOAD4(p, elements[i]), LOAD4(p, elements[i + 4]), LOAD4(p, elements[i + 8]),
                             LOAD4(p, elements[i + 12]));
    transpose(lanes);
}

// Rows follow each other too far apart for processors to see that one will be read after another.
INLINE void prefetch_row(global const storage* p, int elements) {
    const int line = 64 / sizeof(storage);
    for (int i = 0; i < elements; i += line) PREFETCH(p + i);
}

// The samples of a row, and of the columns before and after.
INLINE void load_samples(global const storage* color, int row, int elements[3][LANES], float16 samples[3][3]) {
    global const storage* p = color + AT(COLOR, 0, clamp(row, 0, COLOR_HEIGHT - 1), 0);
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        float16 lanes[4];
        load_lanes(p, elements[i], lanes);
#pragma unroll
        for (int c = 0; c < 3; ++c) samples[i][c] = lanes[c];
    }
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void compose_lanes(global const storage* color,
                                                                               global const storage* past,
                                                                               global const storage* parameters,
                                                                               global storage* out, Frame frame) {
    const int first = LANES * get_global_id(0), first_row = ROWS * get_global_id(1);
    const int begin = first_pixel(first, SHIFT_X, COLOR_WIDTH, OUT_WIDTH);
    const int end = first_pixel(first + LANES, SHIFT_X, COLOR_WIDTH, OUT_WIDTH);
    // Of each sample: its first pixel, how many it has, and where they are from it; and its elements.
    int start[LANES], count[LANES], around[3][LANES], predicted[LANES];
    float offset[PHASES][LANES];
    for (int i = 0; i < LANES; ++i) {
        start[i] = min(begin, OUT_WIDTH - 1);
        count[i] = 0;
        for (int phase = 0; phase < PHASES; ++phase) offset[phase][i] = 0;
        for (int j = 0; j < 3; ++j) around[j][i] = COLOR_STRIDE * clamp(first + i + j - 1, 0, COLOR_WIDTH - 1);
        predicted[i] = PARAMETERS_STRIDE * min(first + i, COLOR_WIDTH - 1);
    }
    for (int x = begin; x < end; ++x) {
        const Nearest u = nearest_sample(x, SHIFT_X, COLOR_WIDTH);
        const int i = u.sample - first;
        if (count[i] == 0) start[i] = x;
        if (count[i] < PHASES) offset[count[i]][i] = u.offset;
        ++count[i];
    }
    int y = first_pixel(first_row, SHIFT_Y, COLOR_HEIGHT, OUT_HEIGHT);
    float16 samples[9][3];
    load_samples(color, first_row - 1, around, samples + 3);
    load_samples(color, first_row, around, samples + 6);
    for (int row = first_row; row < min(first_row + ROWS, COLOR_HEIGHT); ++row) {
#pragma unroll
        for (int i = 0; i < 6; ++i)
#pragma unroll
            for (int c = 0; c < 3; ++c) samples[i][c] = samples[i + 3][c];
        load_samples(color, row + 1, around, samples + 6);
        const int end_y = first_pixel(row + 1, SHIFT_Y, COLOR_HEIGHT, OUT_HEIGHT);
        if (y == end_y) continue;
        prefetch_row(color + AT(COLOR, first, min(row + 2, COLOR_HEIGHT - 1), 0), LANES * COLOR_STRIDE);
        prefetch_row(parameters + AT(PARAMETERS, first, min(row + 1, COLOR_HEIGHT - 1), 0), LANES * PARAMETERS_STRIDE);
        float16 p[20], low[3], high[3];
#pragma unroll
        for (int c = 0; c < 20; c += 4) load_lanes(parameters + AT(PARAMETERS, 0, row, c), predicted, p + c);
        prepare_float16(p);
        extremes_float16(samples, low, high);
        for (; y < end_y; ++y) {
            prefetch_row(past + AT(PAST, begin, min(y + 1, OUT_HEIGHT - 1), 0), LANES * PHASES * PAST_STRIDE);
            const float16 down = nearest_sample(y, SHIFT_Y, COLOR_HEIGHT).offset;
            for (int phase = 0; phase < PHASES; ++phase) {
                int elements[LANES];
                for (int i = 0; i < LANES; ++i) elements[i] = PAST_STRIDE * min(start[i] + phase, OUT_WIDTH - 1);
                float16 before[4], result[4];
                load_lanes(past + AT(PAST, 0, y, 0), elements, before);
                composed_float16(p, samples, low, high, vload16(0, offset[phase]), down, before, result);
                transpose(result);
                float pixels[4 * LANES];
#pragma unroll
                for (int i = 0; i < 4; ++i) vstore16(result[i], i, pixels);
                global storage* made = out + AT(OUT, phase, y, 0);
#pragma unroll
                for (int i = 0; i < LANES; ++i)
                    if (phase < count[i]) STORE4(vload4(i % 4 * 4 + i / 4, pixels), made, OUT_STRIDE * start[i]);
            }
            // At the image's border, samples may have more pixels.
            for (int i = 0; i < LANES; ++i)
                for (int extra = PHASES; extra < count[i]; ++extra)
                    compose_pixel(color, past, parameters, out, frame, start[i] + extra, y);
        }
    }
}
#endif
