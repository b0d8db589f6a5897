// collect(colour, past, t, M, s, J) of docs/fsr2.md for any real s: a pixel's new history, the weighted mean of what
// the frame's samples around it show and of what was there before, as far as that is believed.
//
// Options: COLOR_*, TRUST_* (render resolution), PAST_*, OUT_* (output resolution; layouts of one storage), MOTION_*
// (output resolution, float), SCALE, SCALE_REST (s as the sum of two floats), STORE_HALF.

#include "sample_lanes.clh"

#define SHARP (3 * SCALE * SCALE)  // samples weigh 2^(-SHARP d²) at a distance of d render pixels
#define SOFT 5.0f                  // and by 2^(-SOFT d²) where there is no history
#define SHARE 0.003f               // of the soft weights with history: for a pixel that no sample is near to
#define DOUBTED_SHARE 0.1f         // more of them without trust, where little else may be near
#define TIGHT 1.0f                 // deviations of the samples that history may be from their mean without trust
#define LOOSE 20.0f                // with all trust
#define EXCESS 0.001f
#define MOST 12.0f        // weight of a history that stands still
#define MOST_MOVING 0.6f  // of one that moves by an output pixel or more

// Defines, for float and float16, what is done to one pixel or to sixteen. Colours are in YCoCg but for what comes from
// the history and what is stored.
// - weigh: what samples before, at and after the nearest one weigh along an axis, `offset` from it.
// - spread: the nine samples' mean and deviation.
// - collected: `sums` are the samples' sums by both kinds of weights; before and result are colour and weight.
#define DEFINE_COLLECT(real)                                                                                          \
    INLINE void weigh_##real(const Sizes* sizes, real offset, real* sharp, real* soft) {                              \
        _Pragma("unroll") for (int i = 0; i < 3; ++i) {                                                               \
            const real distance = (float)(i - 1) - offset, squared = distance * distance;                             \
            const real by_sharp = -SHARP * squared, by_soft = -SOFT * squared;                                        \
            sharp[i] = exp2_##real(GREATER(by_sharp, (real)(-60.0f)));                                                \
            soft[i] = exp2_##real(GREATER(by_soft, (real)(-60.0f)));                                                  \
        }                                                                                                             \
    }                                                                                                                 \
    INLINE void convert_##real(real* rgb) {                                                                           \
        const real red = rgb[0], green = rgb[1], blue = rgb[2];                                                       \
        rgb[0] = 0.25f * (red + blue) + 0.5f * green;                                                                 \
        rgb[1] = 0.5f * (red - blue);                                                                                 \
        rgb[2] = 0.5f * green - 0.25f * (red + blue);                                                                 \
    }                                                                                                                 \
    INLINE void spread_##real(real samples[9][3], real* mean, real* deviation) {                                      \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                               \
            real sum = 0, squares = 0;                                                                                \
            _Pragma("unroll") for (int i = 0; i < 9; ++i) {                                                           \
                sum += samples[i][c];                                                                                 \
                squares += samples[i][c] * samples[i][c];                                                             \
            }                                                                                                         \
            mean[c] = sum * (1 / 9.0f);                                                                               \
            const real variance = squares * (1 / 9.0f) - mean[c] * mean[c];                                           \
            deviation[c] = sqrt(GREATER(variance, (real)(0.0f)));                                                     \
        }                                                                                                             \
    }                                                                                                                 \
    INLINE void collected_##real(real samples[9][3], const real* mean, const real* deviation, const real* sharp_x,    \
                                 const real* soft_x, const real* sharp_y, const real* soft_y, real trust, real speed, \
                                 const real* before, real* result) {                                                  \
        real fresh[3] = {0, 0, 0}, first[3] = {0, 0, 0}, weight = 0, soft_weight = 0;                                 \
        const real part = SHARE + DOUBTED_SHARE * (1 - trust);                                                        \
        _Pragma("unroll") for (int i = 0; i < 9; ++i) {                                                               \
            const real by_soft = soft_x[i % 3] * soft_y[i / 3];                                                       \
            const real by_both = sharp_x[i % 3] * sharp_y[i / 3] + part * by_soft;                                    \
            weight += by_both;                                                                                        \
            soft_weight += by_soft;                                                                                   \
            _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                           \
                fresh[c] = MAD(by_both, samples[i][c], fresh[c]);                                                     \
                first[c] = MAD(by_soft, samples[i][c], first[c]);                                                     \
            }                                                                                                         \
        }                                                                                                             \
        real history[3] = {before[0], before[1], before[2]};                                                          \
        convert_##real(history);                                                                                      \
        const real loose = TIGHT + (LOOSE - TIGHT) * trust;                                                           \
        real confined[3], moved = 0, room = EXCESS;                                                                   \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                               \
            const real reach = loose * deviation[c], raised = GREATER(history[c], mean[c] - reach);                   \
            confined[c] = LESSER(raised, mean[c] + reach);                                                            \
            moved += (confined[c] - history[c]) * (confined[c] - history[c]);                                         \
            room += reach * reach;                                                                                    \
        }                                                                                                             \
        const real most = MOST + (MOST_MOVING - MOST) * LESSER(speed, (real)(1.0f)), believed = trust * before[3];    \
        const real kept = LESSER(believed, most) * room / (room + moved);                                             \
        const real total = kept + weight, share = 1 / total, soft_share = 1 / soft_weight;                            \
        real shown[3];                                                                                                \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                               \
            const real with_history = confined[c] + (fresh[c] - weight * confined[c]) * share;                        \
            shown[c] = before[3] > 0 ? with_history : first[c] * soft_share;                                          \
        }                                                                                                             \
        result[0] = shown[0] + shown[1] - shown[2];                                                                   \
        result[1] = shown[0] + shown[2];                                                                              \
        result[2] = shown[0] - shown[1] - shown[2];                                                                   \
        _Pragma("unroll") for (int c = 0; c < 3; ++c) {                                                               \
            const real raised = GREATER(result[c], (real)(0.0f));                                                     \
            result[c] = LESSER(raised, (real)(1.0f));                                                                 \
        }                                                                                                             \
        result[3] = before[3] > 0 ? LESSER(total, (real)(MOST)) : weight;                                             \
    }

DEFINE_COLLECT(float)

// How far the history moved, in output pixels.
INLINE float speed_at(const Sizes* sizes, global const float* motion, int x, int y) {
    const float motion_x = motion[AT(MOTION, x, y, 0)], motion_y = motion[AT(MOTION, x, y, 1)];
    const float speed = sqrt(motion_x * motion_x + motion_y * motion_y);
    return is_finite(speed) ? speed : 1;
}

INLINE void collect_pixel(const Sizes* sizes, global const storage* color, global const storage* past,
                          global const storage* trust, global const float* motion, global storage* out, Frame frame,
                          int x, int y) {
    const Nearest u = nearest_sample(sizes, x, frame.jitter_x, COLOR_WIDTH);
    const Nearest v = nearest_sample(sizes, y, frame.jitter_y, COLOR_HEIGHT);
    float samples[9][3], mean[3], deviation[3], before[4], result[4];
    float sharp_x[3], soft_x[3], sharp_y[3], soft_y[3];
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const float4 sample = LOAD_CHANNELS(COLOR, color, clamp(u.sample + i % 3 - 1, 0, COLOR_WIDTH - 1),
                                            clamp(v.sample + i / 3 - 1, 0, COLOR_HEIGHT - 1), 0);
        vstore3(to_ycocg(sample).xyz, 0, samples[i]);
    }
    spread_float(samples, mean, deviation);
    weigh_float(sizes, u.offset, sharp_x, soft_x);
    weigh_float(sizes, v.offset, sharp_y, soft_y);
    vstore4(LOAD_CHANNELS(PAST, past, x, y, 0), 0, before);
    collected_float(samples, mean, deviation, sharp_x, soft_x, sharp_y, soft_y,
                    LOAD(trust, AT(TRUST, u.sample, v.sample, 0)), speed_at(sizes, motion, x, y), before, result);
    STORE_CHANNELS(OUT, vload4(0, result), out, x, y, 0);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void collect(Sizes given, global const storage* color,
                                                                         global const storage* past,
                                                                         global const storage* trust,
                                                                         global const float* motion,
                                                                         global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x < OUT_WIDTH && y < OUT_HEIGHT) collect_pixel(sizes, color, past, trust, motion, out, frame, x, y);
}

// For devices that make vectors of what a work-item says is one: all pixels whose nearest samples are LANES × ROWS.
#ifdef MOST_PHASES
DEFINE_COLLECT(float16)

INLINE void load_converted(const Sizes* sizes, global const storage* color, int row, const int elements[3][LANES],
                           float16 samples[3][3]) {
    load_samples(sizes, color, row, elements, samples);
#pragma unroll
    for (int i = 0; i < 3; ++i) convert_float16(samples[i]);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void collect_lanes(
    Sizes given, global const storage* color, global const storage* past, global const storage* trust,
    global const float* motion, global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int first = LANES * get_global_id(0), first_row = ROWS * ROW_ITEM(1);
    const Strip strip = find_strip(sizes, first, frame.jitter_x);
    float16 sharp_x[MOST_PHASES][3], soft_x[MOST_PHASES][3], samples[9][3];
    for (int phase = 0; phase < PHASES; ++phase)
        weigh_float16(sizes, vload16(0, strip.offset[phase]), sharp_x[phase], soft_x[phase]);
    int y = first_pixel(sizes, first_row, frame.jitter_y, COLOR_HEIGHT, OUT_HEIGHT);
    load_converted(sizes, color, first_row - 1, strip.around, samples + 3);
    load_converted(sizes, color, first_row, strip.around, samples + 6);
    for (int row = first_row; row < min(first_row + ROWS, COLOR_HEIGHT); ++row) {
#pragma unroll
        for (int i = 0; i < 6; ++i)
#pragma unroll
            for (int c = 0; c < 3; ++c) samples[i][c] = samples[i + 3][c];
        load_converted(sizes, color, row + 1, strip.around, samples + 6);
        const int end_y = first_pixel(sizes, row + 1, frame.jitter_y, COLOR_HEIGHT, OUT_HEIGHT);
        if (y == end_y) continue;
        prefetch_row(color + AT(COLOR, first, min(row + 2, COLOR_HEIGHT - 1), 0), LANES * COLOR_STRIDE);
        float16 mean[3], deviation[3];
        spread_float16(samples, mean, deviation);
        float trusts[LANES];
        for (int i = 0; i < LANES; ++i) trusts[i] = LOAD(trust, AT(TRUST, min(first + i, COLOR_WIDTH - 1), row, 0));
        for (; y < end_y; ++y) {
            prefetch_row(past + AT(PAST, strip.start[0], min(y + 1, OUT_HEIGHT - 1), 0), LANES * PHASES * PAST_STRIDE);
            const float16 down = nearest_sample(sizes, y, frame.jitter_y, COLOR_HEIGHT).offset;
            float16 sharp_y[3], soft_y[3];
            weigh_float16(sizes, down, sharp_y, soft_y);
            for (int phase = 0; phase < PHASES; ++phase) {
                int elements[LANES];
                float speeds[LANES];
                for (int i = 0; i < LANES; ++i) {
                    const int x = min(strip.start[i] + phase, OUT_WIDTH - 1);
                    elements[i] = PAST_STRIDE * x;
                    speeds[i] = speed_at(sizes, motion, x, y);
                }
                float16 before[4], result[4];
                load_lanes(past + AT(PAST, 0, y, 0), elements, before);
                collected_float16(samples, mean, deviation, sharp_x[phase], soft_x[phase], sharp_y, soft_y,
                                  vload16(0, trusts), vload16(0, speeds), before, result);
                store_pixels(sizes, result, &strip, phase, y, out);
            }
            // At the image's border, samples may have more pixels.
            for (int i = 0; i < LANES; ++i)
                for (int extra = PHASES; extra < strip.count[i]; ++extra)
                    collect_pixel(sizes, color, past, trust, motion, out, frame, strip.start[i] + extra, y);
        }
    }
}
#endif
