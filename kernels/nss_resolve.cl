// NSS, step 5 (docs/nss.md): the output as radiance. The guide is float, all else of one storage.
//
// Options: COLOR_* (radiance), GUIDE_*, KERNELS_*, TEMPORAL_*, HISTORY_*, OUT_* (layouts), STORE_HALF; SAMPLES_X,
// CELLS_X, SAMPLES_Y, CELLS_Y (so many samples lie in so many output pixels, in lowest terms), SCALE_X, SCALE_Y
// (rounded), INVERSE_X, INVERSE_Y (of those, rounded), WEIGHED (samples that a kernel weighs at most); for
// strips LANES.

#include "nss.clh"

#define WINDOW 6
#define WINDOW_FIRST (-2)

// Offsets (row + 2) and (column + 2) of a kernel's taps, the nearest first, of equals column by column.
constant char kTapRows[36] = {2, 2, 1, 3, 2, 1, 3, 1, 3, 2, 0, 4, 2, 1, 3, 0, 4, 0,
                              4, 1, 3, 0, 4, 0, 4, 5, 2, 5, 5, 1, 3, 5, 5, 0, 4, 5};
constant char kTapColumns[36] = {2, 1, 2, 2, 3, 1, 1, 3, 3, 0, 2, 2, 4, 0, 0, 1, 1, 3,
                                 3, 4, 4, 0, 0, 4, 4, 2, 5, 1, 3, 5, 5, 0, 4, 5, 5, 5};

// A pixel along an axis: number `within` of the `cells` pixels of a period.
typedef struct {
    int period, within;
} Place;
INLINE Place place_of(int cell, int cells) {
    const int period = cell >= 0 ? cell / cells : -((cells - 1 - cell) / cells);
    const Place place = {period, cell - period * cells};
    return place;
}
INLINE Place next_place(Place place, int cells) {
    const bool ends = place.within == cells - 1;
    const Place next = {place.period + ends, ends ? 0 : place.within + 1};
    return next;
}

// The LR pixel whose sample lies in an HR pixel of an axis; `none` where there is no such pixel. The same in every
// period, whatever is rounded.
#define NO_SAMPLE (-(1 << 30))
INLINE int sample_in(Place place, float jitter, int samples, float scale) {
    const int first = whole_part(place.within / scale - 0.5f - jitter);
    for (int i = max(first, 0); i <= min(first + 1, samples - 1); ++i)
        if (whole_part((i + jitter + 0.5f) * scale) == place.within) return place.period * samples + i;
    return NO_SAMPLE;
}

// A sample that an HR pixel weighs: its LR pixel, which may be beyond the image, and the kernel's channel.
typedef struct {
    int column, row, channel;
} Tap;
#define OWN_CHANNEL (-WINDOW_FIRST * WINDOW - WINDOW_FIRST)

// Those of HR pixel (x, y), and how many.
INLINE int select_taps(const Sizes* sizes, int x, int y, Frame frame, Tap* taps) {
    int columns[WINDOW], rows[WINDOW];
    Place across = place_of(x + WINDOW_FIRST, CELLS_X), down = place_of(y + WINDOW_FIRST, CELLS_Y);
#pragma unroll
    for (int i = 0; i < WINDOW; ++i) {
        columns[i] = sample_in(across, frame.jitter_x, SAMPLES_X, SCALE_X);
        rows[i] = sample_in(down, frame.jitter_y, SAMPLES_Y, SCALE_Y);
        across = next_place(across, CELLS_X);
        down = next_place(down, CELLS_Y);
    }
    int count = 0;
    for (int i = 0; i < WINDOW * WINDOW && count < WEIGHED; ++i) {
        const int column = columns[kTapColumns[i]], row = rows[kTapRows[i]];
        if (column == NO_SAMPLE || row == NO_SAMPLE) continue;
        const Tap tap = {column, row, kTapColumns[i] * WINDOW + kTapRows[i]};
        taps[count++] = tap;
    }
    return count;
}

INLINE float4 load_color(const Sizes* sizes, global const storage* color, int x, int y) {
    const float4 c = LOAD_CHANNELS(COLOR, color, x, y, 0);
    return (float4)(c.xyz, 0);
}

// Weights along an axis: before the whole coordinate, of the two pixels from it on together and of the second's share
// of those, and after.
typedef struct {
    float before, along, share, after;
} Cubic;
INLINE Cubic cubic_at(float f) {
    const float squared = f * f, cubed = squared * f;
    const float w0 = squared - 0.5f * (cubed + f), w1 = 1.5f * cubed - 2.5f * squared + 1,
                w3 = 0.5f * (cubed - squared);
    const float w2 = 1 - w0 - w1 - w3;
    const Cubic cubic = {w0, w1 + w2, w2 / (w1 + w2), w3};
    return cubic;
}

INLINE float4 filtered_history(const Sizes* sizes, global const storage* history, float from_x, float from_y) {
    const int column = whole_part(from_x), row = whole_part(from_y);
    const Cubic across = cubic_at(from_x - column), down = cubic_at(from_y - row);
    const int4 taps = (int4)(-1, 0, 1, 2);
    const int4 columns = clamp(column + taps, (int4)(0), (int4)(HISTORY_WIDTH - 1)),
               rows = clamp(row + taps, (int4)(0), (int4)(HISTORY_HEIGHT - 1));
#define PIXEL(x, y) LOAD_CHANNELS(HISTORY, history, x, y, 0)
    const float4 top = mix(PIXEL(columns.s1, rows.s0), PIXEL(columns.s2, rows.s0), across.share);
    const float4 bottom = mix(PIXEL(columns.s1, rows.s3), PIXEL(columns.s2, rows.s3), across.share);
    const float4 left = mix(PIXEL(columns.s0, rows.s1), PIXEL(columns.s0, rows.s2), down.share);
    const float4 right = mix(PIXEL(columns.s3, rows.s1), PIXEL(columns.s3, rows.s2), down.share);
    const float4 middle = mix(mix(PIXEL(columns.s1, rows.s1), PIXEL(columns.s2, rows.s1), across.share),
                              mix(PIXEL(columns.s1, rows.s2), PIXEL(columns.s2, rows.s2), across.share), down.share);
#undef PIXEL
    const float wt = across.along * down.before, wb = across.along * down.after, wl = across.before * down.along,
                wr = across.after * down.along, wm = across.along * down.along;
    const float4 sum = wt * top + wl * left + wm * middle + wr * right + wb * bottom;
    const float4 result = sum / (wt + wl + wm + wr + wb);
    if (result.x >= 0 && result.y >= 0 && result.z >= 0) return result;
    const float4 least = min(min(min(top, bottom), min(left, right)), middle);
    const float4 most = max(max(max(top, bottom), max(left, right)), middle);
    return clamp(result, least, most);
}

// What is left to do of pixel (x, y) when its samples' mean and mean square are known; its taps are `shift` LR columns
// to the right of those given.
INLINE void finish(const Sizes* sizes, global const storage* color, global const float* guide,
                   global const storage* temporal, global const storage* history, global storage* out, int x, int y,
                   float4 mean, float4 square, const Tap* taps, int count, int shift) {
    const Taps tx = taps_at((x + 0.5f) * ((float)COLOR_WIDTH / OUT_WIDTH) - 0.5f, TEMPORAL_WIDTH);
    const Taps ty = taps_at((y + 0.5f) * ((float)COLOR_HEIGHT / OUT_HEIGHT) - 0.5f, TEMPORAL_HEIGHT);
    const float4 parameters = BILINEAR(TEMPORAL, temporal, tx, ty, 0);
    const float toward = parameters.x * parameters.x, away = (1 - parameters.x) * (1 - parameters.x);
    const float theta = toward / max(toward + away, 1e-6f), alpha = 0.05f + 0.35f * parameters.y;

    const int under_x = min((int)(x * INVERSE_X), COLOR_WIDTH - 1),
              under_y = min((int)(y * INVERSE_Y), COLOR_HEIGHT - 1);
    const float2 vector = (float2)(guide[AT(GUIDE, under_x, under_y, 0)], guide[AT(GUIDE, under_x, under_y, 1)]);
    float4 toned = karis(mean);
    if (is_valid(vector)) {
        const float2 moved = still(vector * (float2)(SCALE_X, SCALE_Y));
        const float from_x = x - moved.x, from_y = y - moved.y;
        const bool onscreen =
            from_x >= -0.5f && from_x <= OUT_WIDTH - 0.5f && from_y >= -0.5f && from_y <= OUT_HEIGHT - 0.5f;
        const float4 warped = min(filtered_history(sizes, history, from_x, from_y), 65504.0f);
        const float4 spread = 2 * parameters.z * sqrt(max(fabs(square - mean * mean), LEAST));
        const float4 held = min(max(warped, mean - spread), mean + spread);
        toned = karis(mix(held, warped, onscreen ? theta : 0.0f));
        if (count < WEIGHED) {
            const int column = (int)((2 * (long)x + 1) * COLOR_WIDTH / (2 * OUT_WIDTH)),
                      row = (int)((2 * (long)y + 1) * COLOR_HEIGHT / (2 * OUT_HEIGHT));
            toned = mix(toned, karis(load_color(sizes, color, column, row)), alpha);
        } else if (taps[0].channel == OWN_CHANNEL) {
            toned = mix(toned, karis(load_color(sizes, color, taps[0].column + shift, taps[0].row)), alpha);
        }
    }
    toned = clamp(toned, 0.0f, BRIGHTEST);
    const float4 result = toned / (1 - max(toned.x, max(toned.y, toned.z)));
    STORE(result.x, out, AT(OUT, x, y, 0));
    STORE(result.y, out, AT(OUT, x, y, 1));
    STORE(result.z, out, AT(OUT, x, y, 2));
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resolve(
    Sizes given, global const storage* color, global const float* guide, global const storage* kernels,
    global const storage* temporal, global const storage* history, global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    Tap taps[WEIGHED];
    const int count = select_taps(sizes, x, y, frame, taps);
    float4 mean = 0, square = 0;
    float total = 0;
    for (int tap = 0; tap < count; ++tap) {
        const int i = clamp(taps[tap].column, 0, COLOR_WIDTH - 1), j = clamp(taps[tap].row, 0, COLOR_HEIGHT - 1);
        const float4 sample = load_color(sizes, color, i, j);
        const float weight = max(LOAD(kernels, AT(KERNELS, i / 4, j / 4, taps[tap].channel)), LEAST);
        mean += weight * sample;
        square += weight * sample * sample;
        total += weight;
    }
    const float share = 1 / max(total, LEAST);
    finish(sizes, color, guide, temporal, history, out, x, y, share * mean, share * square, taps, count, 0);
}

// For devices that make vectors of loops: a work-item makes LANES pixels of a row that lie a period apart, and so have
// the same taps. Work-items: those of the periods' first pixels, then of their second ones, and so on, for every LANES
// periods.
#ifdef LANES
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resolve_strip(
    Sizes given, global const storage* color, global const float* guide, global const storage* kernels,
    global const storage* temporal, global const storage* history, global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int item = get_global_id(0), y = ROW_ITEM(1);
    const int first = item / CELLS_X * (LANES * CELLS_X) + item % CELLS_X;
    if (first >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    Tap taps[WEIGHED];
    const int count = select_taps(sizes, first, y, frame, taps);
    float mean[3][LANES] = {{0}}, square[3][LANES] = {{0}}, total[LANES] = {0};
    for (int tap = 0; tap < count; ++tap) {
        const int j = clamp(taps[tap].row, 0, COLOR_HEIGHT - 1);
#pragma unroll
        for (int lane = 0; lane < LANES; ++lane) {
            const int i = clamp(taps[tap].column + lane * SAMPLES_X, 0, COLOR_WIDTH - 1);
            const float weight = max(LOAD(kernels, AT(KERNELS, i / 4, j / 4, taps[tap].channel)), LEAST);
            total[lane] += weight;
            for (int c = 0; c < 3; ++c) {
                const float sample = LOAD(color, AT(COLOR, i, j, c));
                mean[c][lane] += weight * sample;
                square[c][lane] += weight * sample * sample;
            }
        }
    }
    for (int lane = 0; lane < LANES && first + lane * CELLS_X < OUT_WIDTH; ++lane) {
        const float share = 1 / max(total[lane], LEAST);
        finish(sizes, color, guide, temporal, history, out, first + lane * CELLS_X, y,
               share * (float4)(mean[0][lane], mean[1][lane], mean[2][lane], 0),
               share * (float4)(square[0][lane], square[1][lane], square[2][lane], 0), taps, count, lane * SAMPLES_X);
    }
}
#endif
