// An image at another size, for any real ratio along each axis: first along y, then along x. Source pixels are taken as
// they would be shown: in [0, 1], and 0 where they are not numbers.
//   An axis that is enlarged: Keys' bicubic, held between the two pixels around, so that edges do not ring.
//   Any other: the mean of what a pixel covers, held between the least and the greatest of that, so that rounding
//   errors change no flat.
// Positions are fractions of whole numbers, the sizes: they and the weights are exact wherever a pixel lies, and
// another size compiles nothing.
//
// Options: IN_*, OUT_* (layouts), ENLARGES_X, ENLARGES_Y (0 or 1), MOST_TAPS (along an axis, one more than the greatest
// ratio), STORE_HALF.

#define SHOWN(v) LESSER(GREATER((v), 0), 1)
#define HELD(v, low, high) LESSER(GREATER((v), (low)), (high))
#define HOLDS(enlarges, tap) (!(enlarges) || (tap) == 1 || (tap) == 2)

// The source pixels of one pixel along an axis.
typedef struct {
    int first, count;
    float weights[MOST_TAPS];
} Window;

// Of pixel x of `to`; the source has `from`. Sides are up to 2^15. Not a result: Oclgrind does not read what its
// compiler makes of a struct that an inlined function returns.
INLINE void find_window(Window* window, int x, int from, int to, int enlarges) {
    if (enlarges) {
        float fraction;
        window->first = resized_coordinate(x, from, to, &fraction) - 1;
        vstore4(keys(fraction), 0, window->weights);
        window->count = 4;
    } else {
        window->first = x * from / to;
        const int begin = x * from - window->first * to, end = begin + from;  // in units of 1 / to
        window->count = (end - 1) / to + 1;
#pragma unroll
        for (int i = 0; i < MOST_TAPS; ++i)
            window->weights[i] = (float)(min((i + 1) * to, end) - max(i * to, begin)) / from;
    }
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void fit(Sizes given, global const storage* in,
                                                                     global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    Window columns, rows;
    find_window(&columns, x, IN_WIDTH, OUT_WIDTH, ENLARGES_X);
    find_window(&rows, y, IN_HEIGHT, OUT_HEIGHT, ENLARGES_Y);
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
        float4 sum = 0, least = 1, greatest = 0;
        for (int i = 0; i < columns.count; ++i) {
            const int column = clamp(columns.first + i, 0, IN_WIDTH - 1);
            float4 along_y = 0, low = 1, high = 0;
            for (int j = 0; j < rows.count; ++j) {
                const int row = clamp(rows.first + j, 0, IN_HEIGHT - 1);
                const float4 loaded = LOAD_CHANNELS(IN, in, column, row, c), v = SHOWN(loaded);
                along_y = MAD((float4)rows.weights[j], v, along_y);
                if (HOLDS(ENLARGES_Y, j)) low = LESSER(v, low), high = GREATER(v, high);
            }
            const float4 held = HELD(along_y, low, high);
            sum = MAD((float4)columns.weights[i], held, sum);
            if (HOLDS(ENLARGES_X, i)) least = LESSER(held, least), greatest = GREATER(held, greatest);
        }
        STORE_CHANNELS(OUT, HELD(sum, least, greatest), out, x, y, c);
    }
}

// For devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels, of each row all
// source columns along y first, four at a time. The windows along x serve all rows. Wants one channel or three, and
// source pixels of four elements.
#ifdef PIXELS
#define SPAN \
    (ENLARGES_X ? PIXELS + 4 : (MOST_TAPS - 1) * PIXELS + 1)  // the most source pixels under a row and its taps
#define VECTORS ((SPAN + 3) / 4)
#define ADD_LINE(j, loaded)                                                      \
    do {                                                                         \
        const float16 line = (loaded), v = SHOWN(line);                          \
        along_y = MAD((float16)lines.weights[j], v, along_y);                    \
        if (HOLDS(ENLARGES_Y, j)) low = LESSER(v, low), high = GREATER(v, high); \
    } while (0)

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void fit_strip(Sizes given, global const storage* in,
                                                                           global storage* restrict out) {
    TAKE(sizes);
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * ROW_ITEM(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0), rows = min(ROWS, OUT_HEIGHT - y0);
    Window columns[PIXELS];
    for (int i = 0; i < pixels; ++i) find_window(&columns[i], x0 + i, IN_WIDTH, OUT_WIDTH, ENLARGES_X);
    const int first_column = columns[0].first;
    const int vectors = (columns[pixels - 1].first + columns[pixels - 1].count - first_column + 3) / 4;
    const bool inside = first_column >= 0 && first_column + 4 * vectors <= IN_WIDTH;
    for (int row = 0; row < rows; ++row) {
        Window lines;
        find_window(&lines, y0 + row, IN_HEIGHT, OUT_HEIGHT, ENLARGES_Y);
        const int line_count = ENLARGES_Y ? 4 : lines.count;
        int places[MOST_TAPS];
        for (int j = 0; j < line_count; ++j) places[j] = AT(IN, 0, clamp(lines.first + j, 0, IN_HEIGHT - 1), 0);
        float16 filtered[VECTORS];
        for (int i = 0; i < vectors; ++i) {
            const int column = first_column + 4 * i;
            float16 along_y = 0, low = 1, high = 0;
            if (inside) {
#pragma unroll
                for (int j = 0; j < line_count; ++j) ADD_LINE(j, LOAD16(in, places[j] + IN_STRIDE * column));
            } else {
                const int4 at = IN_STRIDE * clamp(column + (int4)(0, 1, 2, 3), (int4)(0), (int4)(IN_WIDTH - 1));
                for (int j = 0; j < line_count; ++j)
                    ADD_LINE(j, (float16)(LOAD4(in, places[j] + at.s0), LOAD4(in, places[j] + at.s1),
                                          LOAD4(in, places[j] + at.s2), LOAD4(in, places[j] + at.s3)));
            }
            filtered[i] = HELD(along_y, low, high);
        }
        const float4* source = (const float4*)filtered;
        for (int i = 0; i < pixels; ++i) {
            const float4* taps = source + (columns[i].first - first_column);
            const int tap_count = ENLARGES_X ? 4 : columns[i].count;
            float4 sum = 0, least = 1, greatest = 0;
#pragma unroll
            for (int tap = 0; tap < tap_count; ++tap) {
                const float4 v = taps[tap];
                sum = MAD((float4)columns[i].weights[tap], v, sum);
                if (HOLDS(ENLARGES_X, tap)) least = LESSER(v, least), greatest = GREATER(v, greatest);
            }
            STORE_ONE_OR_THREE(OUT, HELD(sum, least, greatest), out, x0 + i, y0 + row);
        }
    }
}
#endif
