// What a network carries from frame to frame, at another size: first along y, then along x, by Keys' bicubic held
// between the two pixels around, so that a value that is there stays and edges do not ring. A value that is not a
// number counts as the other of the two; 0 where neither is one. Positions are fractions of whole numbers, the sizes.
//
// Options: IN_*, OUT_* (layouts of the same channels), STORE_HALF.

// Where a pixel lies between the source pixels of an axis.
typedef struct {
    int first;  // of four
    float4 weights;
} Window;

INLINE Window window_of(int x, int from, int to) {
    float fraction;
    const int whole = resized_coordinate(x, from, to, &fraction);
    const Window window = {whole - 1, keys(fraction)};
    return window;
}

// Four pixels, or vectors of them, as one.
#define DEFINE_FILTER(name, real)                                                                             \
    INLINE real name(real a, real b, real c, real d, float4 weights) {                                        \
        const real sum = MAD((real)(weights.s0), a,                                                           \
                             MAD((real)(weights.s1), b, MAD((real)(weights.s2), c, (real)(weights.s3) * d))); \
        const real low = LESSER(c, LESSER(b, (real)(INFINITY)));                                              \
        const real high = GREATER(c, GREATER(b, (real)(-INFINITY)));                                          \
        return low <= high ? LESSER(GREATER(sum, low), high) : (real)(0);                                     \
    }
DEFINE_FILTER(filter4, float4)

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resize_state(Sizes given, global const storage* in,
                                                                              global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Window column = window_of(x, IN_WIDTH, OUT_WIDTH), row = window_of(y, IN_HEIGHT, OUT_HEIGHT);
    const int4 rows = clamp(row.first + (int4)(0, 1, 2, 3), (int4)(0), (int4)(IN_HEIGHT - 1));
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
        float4 along_y[4];
        for (int i = 0; i < 4; ++i) {
            const int at = clamp(column.first + i, 0, IN_WIDTH - 1);
            along_y[i] =
                filter4(LOAD_CHANNELS(IN, in, at, rows.s0, c), LOAD_CHANNELS(IN, in, at, rows.s1, c),
                        LOAD_CHANNELS(IN, in, at, rows.s2, c), LOAD_CHANNELS(IN, in, at, rows.s3, c), row.weights);
        }
        STORE_CHANNELS(OUT, filter4(along_y[0], along_y[1], along_y[2], along_y[3], column.weights), out, x, y, c);
    }
}

// For devices that make vectors of what a work-item says is one: strips of PIXELS pixels, of all source columns of
// which those along y are filtered first, four at a time. Wants pixels of four elements, and at most MOST_RATIO source
// pixels to a pixel along x.
#ifdef PIXELS
#define SPAN (MOST_RATIO * PIXELS + 4)
#define VECTORS ((SPAN + 3) / 4)
DEFINE_FILTER(filter16, float16)

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resize_state_strip(Sizes given,
                                                                                    global const storage* in,
                                                                                    global storage* restrict out) {
    TAKE(sizes);
    const int x0 = PIXELS * get_global_id(0), y = ROW_ITEM(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0);
    const Window row = window_of(y, IN_HEIGHT, OUT_HEIGHT);
    const int4 rows = clamp(row.first + (int4)(0, 1, 2, 3), (int4)(0), (int4)(IN_HEIGHT - 1));
    const int first = window_of(x0, IN_WIDTH, OUT_WIDTH).first;
    const int vectors = (window_of(x0 + pixels - 1, IN_WIDTH, OUT_WIDTH).first + 4 - first + 3) / 4;
    const bool inside = first >= 0 && first + 4 * vectors <= IN_WIDTH;
    const int place0 = AT(IN, 0, rows.s0, 0), place1 = AT(IN, 0, rows.s1, 0);
    const int place2 = AT(IN, 0, rows.s2, 0), place3 = AT(IN, 0, rows.s3, 0);
    float16 filtered[VECTORS];
    for (int i = 0; i < vectors; ++i) {
        const int column = first + 4 * i;
        if (inside) {
            const int at = IN_STRIDE * column;
            filtered[i] = filter16(LOAD16(in, place0 + at), LOAD16(in, place1 + at), LOAD16(in, place2 + at),
                                   LOAD16(in, place3 + at), row.weights);
            continue;
        }
        const int4 at = IN_STRIDE * clamp(column + (int4)(0, 1, 2, 3), (int4)(0), (int4)(IN_WIDTH - 1));
#define LOAD_LINE(place) \
    (float16)(LOAD4(in, place + at.s0), LOAD4(in, place + at.s1), LOAD4(in, place + at.s2), LOAD4(in, place + at.s3))
        filtered[i] = filter16(LOAD_LINE(place0), LOAD_LINE(place1), LOAD_LINE(place2), LOAD_LINE(place3), row.weights);
    }
    const float4* source = (const float4*)filtered;
    for (int i = 0; i < pixels; ++i) {
        const Window column = window_of(x0 + i, IN_WIDTH, OUT_WIDTH);
        const float4* taps = source + (column.first - first);
        STORE4(filter4(taps[0], taps[1], taps[2], taps[3], column.weights), out, AT(OUT, x0 + i, y, 0));
    }
}
#endif
