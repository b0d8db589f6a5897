// The least and the greatest of the 3×3 pixels around each, without what is outside the image: of three channels of
// colour the least three, then the greatest. A NaN is passed over where another pixel has a number.
//
// Options: IN_*, OUT_* (layouts), STRIP, ROWS (the pixels of a work-item), STORE_HALF.

#define LESSER(a, b) ((a) < (b) ? (a) : (b))
#define GREATER(a, b) ((a) > (b) ? (a) : (b))

#define WIDEN(low, high, value)      \
    do {                             \
        low = LESSER(value, low);    \
        high = GREATER(value, high); \
    } while (0)

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void extremes(global const storage* in,
                                                                          global storage* out) {
    const int x0 = (int)get_global_id(0) * STRIP, y0 = (int)get_global_id(1) * ROWS;
    const int pixels = min(STRIP, OUT_WIDTH - x0), end = min(y0 + ROWS, OUT_HEIGHT);
    if (pixels <= 0 || y0 >= end) return;
    // Of three pixels of a row: of three rows, row y in the place of y % 3.
    float4 low[3][STRIP], high[3][STRIP];
    for (int y = y0 - 1; y <= end; ++y) {
        const int place = (y + 3) % 3, row = clamp(y, 0, IN_HEIGHT - 1);
        float4 left = LOAD_CHANNELS(IN, in, max(x0 - 1, 0), row, 0), here = LOAD_CHANNELS(IN, in, x0, row, 0);
        for (int i = 0; i < pixels; ++i) {
            PREFETCH(in + AT(IN, min(x0 + i, IN_WIDTH - 1), min(row + 1, IN_HEIGHT - 1), 0));
            const float4 right = LOAD_CHANNELS(IN, in, min(x0 + i + 1, IN_WIDTH - 1), row, 0);
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
            STORE(least.x, out, AT(OUT, x0 + i, y - 1, 0));
            STORE(least.y, out, AT(OUT, x0 + i, y - 1, 1));
            STORE(least.z, out, AT(OUT, x0 + i, y - 1, 2));
            STORE(greatest.x, out, AT(OUT, x0 + i, y - 1, 3));
            STORE(greatest.y, out, AT(OUT, x0 + i, y - 1, 4));
            STORE(greatest.z, out, AT(OUT, x0 + i, y - 1, 5));
        }
    }
}
