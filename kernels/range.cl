// What `hold` of docs/history.md confines colours to, for every render pixel.
//
// range: the least and the greatest of the 3×3 pixels around, without what is outside the image, three channels each;
// then 1 where the mean of the history over the pixel's tile is outside of them by more than ALLOWED, else 0. A NaN is
// passed over where another pixel has a number.
// Options: COLOR_*, OUT_* (render resolution), HISTORY_* (output resolution; layouts), SCALE, STRIP, ROWS (the pixels
// of a work-item), STORE_HALF.
//
// believed: 1 where the history of at most half of the 5×5 pixels around is outside, else 0.
// Options: IN_*, OUT_* (layouts), STRIP, STORE_HALF.

#define ALLOWED (2 / 255.0f)

#ifdef ROWS
#define WIDEN(low, high, value)      \
    do {                             \
        low = LESSER(value, low);    \
        high = GREATER(value, high); \
    } while (0)

// Of the pixels of the history in a tile, row by row, three channels.
INLINE float4 sum_of_tile(const Sizes* sizes, global const storage* history, int x, int y) {
    float4 sum = 0;
#if HISTORY_BLOCK == SCALE && SCALE > 1
    // All pixels of a channel, then of the next.
    global const storage* red = history + AT(HISTORY, SCALE * x, SCALE * y, 0);
    global const storage* green = red + SCALE * SCALE;
    global const storage* blue = green + SCALE * SCALE;
#pragma unroll
    for (int i = 0; i + 4 <= SCALE * SCALE; i += 4) {
        const float4 r = LOAD4(red, i), g = LOAD4(green, i), b = LOAD4(blue, i);
        sum += (float4)(r.x, g.x, b.x, 0);
        sum += (float4)(r.y, g.y, b.y, 0);
        sum += (float4)(r.z, g.z, b.z, 0);
        sum += (float4)(r.w, g.w, b.w, 0);
    }
    for (int i = SCALE * SCALE / 4 * 4; i < SCALE * SCALE; ++i)
        sum += (float4)(LOAD(red, i), LOAD(green, i), LOAD(blue, i), 0);
#else
#pragma unroll
    for (int i = 0; i < SCALE * SCALE; ++i)
        sum += LOAD_CHANNELS(HISTORY, history, SCALE * x + i % SCALE, SCALE * y + i / SCALE, 0);
#endif
    return sum;
}

// A tile of the history, ahead of its use: rows of a strip follow each other too far apart for processors to see it.
INLINE void prefetch_tile(const Sizes* sizes, global const storage* history, int x, int y) {
#if HISTORY_BLOCK == SCALE
    const int line = 64 / sizeof(storage);
    for (int i = 0; i < 3 * SCALE * SCALE; i += line) PREFETCH(history + AT(HISTORY, SCALE * x, SCALE * y, 0) + i);
#else
    for (int i = 0; i < SCALE; ++i) PREFETCH(history + AT(HISTORY, SCALE * x, SCALE * y + i, 0));
#endif
}

INLINE float is_outside(const Sizes* sizes, global const storage* history, int x, int y, float4 low, float4 high) {
    const float4 mean = sum_of_tile(sizes, history, x, y) * (1.0f / (SCALE * SCALE));
    const int4 outside = mean < low - ALLOWED || mean > high + ALLOWED;
    return outside.x || outside.y || outside.z ? 1 : 0;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void range(Sizes given, global const storage* color,
                                                                       global const storage* history,
                                                                       global storage* restrict out) {
    TAKE(sizes);
    const int x0 = (int)get_global_id(0) * STRIP, y0 = ROW_ITEM(1) * ROWS;
    const int pixels = min(STRIP, OUT_WIDTH - x0), end = min(y0 + ROWS, OUT_HEIGHT);
    if (pixels <= 0 || y0 >= end) return;
    // Of three pixels of a row: of three rows, row y in the place of y % 3.
    float4 low[3][STRIP], high[3][STRIP];
    for (int y = y0 - 1; y <= end; ++y) {
        const int place = (y + 3) % 3, row = clamp(y, 0, COLOR_HEIGHT - 1);
        float4 left = LOAD_CHANNELS(COLOR, color, max(x0 - 1, 0), row, 0);
        float4 here = LOAD_CHANNELS(COLOR, color, x0, row, 0);
        for (int i = 0; i < pixels; ++i) {
            PREFETCH(color + AT(COLOR, x0 + i, min(row + 1, COLOR_HEIGHT - 1), 0));
            prefetch_tile(sizes, history, x0 + i, row);
            const float4 right = LOAD_CHANNELS(COLOR, color, min(x0 + i + 1, COLOR_WIDTH - 1), row, 0);
            float4 least = INFINITY, greatest = -INFINITY;
            WIDEN(least, greatest, left);
            WIDEN(least, greatest, here);
            WIDEN(least, greatest, right);
            low[place][i] = least;
            high[place][i] = greatest;
            left = here;
            here = right;
        }
        if (y <= y0) continue;
        for (int i = 0; i < pixels; ++i) {
            const float4 lower = LESSER(low[0][i], low[1][i]), upper = GREATER(high[0][i], high[1][i]);
            const float4 least = LESSER(low[2][i], lower), greatest = GREATER(high[2][i], upper);
            PREFETCH_TO_WRITE(out + AT(OUT, x0 + i, min(y, OUT_HEIGHT - 1), 0));
            const float outside = is_outside(sizes, history, x0 + i, y - 1, least, greatest);
            STORE_CHANNELS(OUT, (float4)(least.xyz, greatest.x), out, x0 + i, y - 1, 0);
            STORE_CHANNELS(OUT, (float4)(greatest.y, greatest.z, outside, 0), out, x0 + i, y - 1, 4);
        }
    }
}
#else
#define REACH 2
#define OUTSIDE 6  // the channel

// How many of a column's pixels around row y are outside; 0 of a column outside the image.
INLINE float count_in_column(const Sizes* sizes, global const storage* in, int x, int y) {
    float count = 0;
    if (x < 0 || x >= IN_WIDTH) return count;
    for (int row = max(y - REACH, 0); row <= min(y + REACH, IN_HEIGHT - 1); ++row)
        count += LOAD(in, AT(IN, x, row, OUTSIDE));
    return count;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void believed(Sizes given, global const storage* in,
                                                                          global storage* restrict out) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    const int rows = min(y + REACH, IN_HEIGHT - 1) - max(y - REACH, 0) + 1;
    float columns[2 * REACH + 1], count = 0;
    for (int i = 0; i < 2 * REACH; ++i) count += columns[i] = count_in_column(sizes, in, first - REACH + i, y);
    int oldest = 0, newest = 2 * REACH;
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        count += columns[newest] = count_in_column(sizes, in, x + REACH, y);
        const int pixels = rows * (min(x + REACH, IN_WIDTH - 1) - max(x - REACH, 0) + 1);
        STORE(2 * count <= pixels ? 1.0f : 0.0f, out, AT(OUT, x, y, 0));
        count -= columns[oldest];
        newest = oldest;
        oldest = oldest == 2 * REACH ? 0 : oldest + 1;
    }
}
#endif
