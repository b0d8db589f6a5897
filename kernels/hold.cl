// hold(image; colour, history) of docs/history.md for any real s: colours that neither the frame's samples around a
// pixel nor its history show become the nearest that they do.
//
// Options: IMAGE_*, HISTORY_*, OUT_* (output resolution), COLOR_* (render resolution; layouts), SCALE, SCALE_REST (s as
// the sum of two floats), SHIFT_X, SHIFT_Y (the jitter, as an expression in `frame`), STORE_HALF.

#define LESSER(a, b) ((a) < (b) ? (a) : (b))
#define GREATER(a, b) ((a) > (b) ? (a) : (b))

// The sample that is nearest to HR column or row x: the later one of two that are as near, whatever the rounding.
INLINE int nearest_sample(int x, float jitter, int size) {
    return clamp(source_coordinate(x, SCALE, SCALE_REST, jitter - 0.5f - 1.0f / 4096).whole, 0, size - 1);
}

// NaN becomes the lower end.
INLINE void hold_pixel(global const storage* image, global const storage* history, global storage* out, int x, int y,
                       float4 low, float4 high) {
    const float4 before = LOAD_CHANNELS(HISTORY, history, x, y, 0), value = LOAD_CHANNELS(IMAGE, image, x, y, 0);
    const float4 least = LESSER(before, low), most = GREATER(before, high);
    const float4 raised = GREATER(value, least);
    STORE_CHANNELS(OUT, LESSER(raised, most), out, x, y, 0);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void hold(global const storage* image,
                                                                      global const storage* color,
                                                                      global const storage* history,
                                                                      global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int column = nearest_sample(x, SHIFT_X, COLOR_WIDTH), row = nearest_sample(y, SHIFT_Y, COLOR_HEIGHT);
    float4 low = INFINITY, high = -INFINITY;
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const float4 sample = LOAD_CHANNELS(COLOR, color, clamp(column + i % 3 - 1, 0, COLOR_WIDTH - 1),
                                            clamp(row + i / 3 - 1, 0, COLOR_HEIGHT - 1), 0);
        low = LESSER(sample, low);
        high = GREATER(sample, high);
    }
    hold_pixel(image, history, out, x, y, low, high);
}

// For devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels. Extremes around a
// sample are found once for all pixels that are nearest to it. SPAN is the most samples under a row of the strip.
#ifdef PIXELS
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void hold_strip(global const storage* image,
                                                                            global const storage* color,
                                                                            global const storage* history,
                                                                            global storage* out, Frame frame) {
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * get_global_id(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0), rows = min(ROWS, OUT_HEIGHT - y0);
    const int first = nearest_sample(x0, SHIFT_X, COLOR_WIDTH);
    int place[PIXELS];
    for (int i = 0; i < PIXELS; ++i)
        place[i] = nearest_sample(min(x0 + i, OUT_WIDTH - 1), SHIFT_X, COLOR_WIDTH) - first;
    // Of columns first − 1 … first + SPAN of three rows, and of their squares.
    float4 column_low[SPAN + 2], column_high[SPAN + 2], low[SPAN], high[SPAN];
    int around = -1;  // the row of samples whose extremes these are
    for (int row = 0; row < rows; ++row) {
        const int nearest = nearest_sample(y0 + row, SHIFT_Y, COLOR_HEIGHT);
        if (nearest != around) {
            around = nearest;
            const int above = max(nearest - 1, 0), below = min(nearest + 1, COLOR_HEIGHT - 1);
            for (int i = 0; i < SPAN + 2; ++i) {
                const int column = clamp(first - 1 + i, 0, COLOR_WIDTH - 1);
                PREFETCH(color + AT(COLOR, column, min(nearest + 2, COLOR_HEIGHT - 1), 0));
                const float4 a = LOAD_CHANNELS(COLOR, color, column, above, 0);
                const float4 b = LOAD_CHANNELS(COLOR, color, column, nearest, 0);
                const float4 c = LOAD_CHANNELS(COLOR, color, column, below, 0);
                const float4 lower = LESSER(a, b), upper = GREATER(a, b);
                column_low[i] = LESSER(lower, c);
                column_high[i] = GREATER(upper, c);
            }
            for (int i = 0; i < SPAN; ++i) {
                const float4 lower = LESSER(column_low[i], column_low[i + 1]);
                const float4 upper = GREATER(column_high[i], column_high[i + 1]);
                low[i] = LESSER(lower, column_low[i + 2]);
                high[i] = GREATER(upper, column_high[i + 2]);
            }
        }
        const int next = min(y0 + row + HISTORY_BLOCK, OUT_HEIGHT - 1);
        for (int i = 0; i < pixels; ++i) {
            PREFETCH(image + AT(IMAGE, x0 + i, next, 0));
            PREFETCH(history + AT(HISTORY, x0 + i, next, 0));
            hold_pixel(image, history, out, x0 + i, y0 + row, low[place[i]], high[place[i]]);
        }
    }
}
#endif
