// dilate(m, d, s): the motion of the nearest LR pixel under each 8×8 HR block, in HR pixels.
//
// Options: MOTION_*, DEPTH_*, OUT_* (layouts, OUT a pixel a block), SCALE, STRIP (blocks of a row to a work-item),
// STORE_HALF (depth's storage; motion is float).

#define BLOCK 8
// The most LR columns, and rows, under a block; one that has fewer looks at its last again, which changes nothing.
#if BLOCK % SCALE == 0
#define COLUMNS (BLOCK / SCALE)
#else
#define COLUMNS ((BLOCK - 2) / SCALE + 2)
#endif

// A vector's lanes are columns. What is nearest is chosen without branches, which would be anybody's guess.
#if COLUMNS > 4
#define LANES 8
typedef float8 depths;
typedef int8 numbers;
#define LANE_COLUMNS (int8)(0, 1, 2, 3, 4, 5, 6, 7)
#else
#define LANES 4
typedef float4 depths;
typedef int4 numbers;
#define LANE_COLUMNS (int4)(0, 1, 2, 3)
#endif

// Of a row's columns from the first to the last; further lanes are the last once more.
INLINE depths load_row(const Sizes* sizes, global const storage* depth, int first, int last, int row) {
    float values[LANES];
#pragma unroll
    for (int i = 0; i < LANES; ++i) values[i] = LOAD(depth, AT(DEPTH, min(first + min(i, COLUMNS - 1), last), row, 0));
    return JOIN(vload, LANES)(0, values);
}

// The number of the nearest of the lanes; of equals, the smallest number.
#define KEEP_NEARER(half_numbers, d, n)                                          \
    do {                                                                         \
        const half_numbers later = d.hi < d.lo || (d.hi == d.lo && n.hi < n.lo); \
        d.lo = later ? d.hi : d.lo;                                              \
        n.lo = later ? n.hi : n.lo;                                              \
    } while (0)
INLINE int nearest_number(depths d, numbers n) {
#if LANES == 8
    KEEP_NEARER(int4, d, n);
    float4 d4 = d.lo;
    int4 n4 = n.lo;
#else
    float4 d4 = d;
    int4 n4 = n;
#endif
    KEEP_NEARER(int2, d4, n4);
    const int later = (d4.y < d4.x) | ((d4.y == d4.x) & (n4.y < n4.x));
    return later ? n4.y : n4.x;
}

INLINE void dilate_block(const Sizes* sizes, global const float* motion, global const storage* depth, global float* out,
                         int x, int y) {
    const int first_column = BLOCK * x / SCALE, first_row = BLOCK * y / SCALE;
    const int last_column = min((BLOCK * x + BLOCK - 1) / SCALE, DEPTH_WIDTH - 1);
    const int last_row = min((BLOCK * y + BLOCK - 1) / SCALE, DEPTH_HEIGHT - 1);

    depths nearest = LOAD(depth, AT(DEPTH, first_column, first_row, 0));
    numbers number = 0;  // in raster order
#pragma unroll
    for (int i = 0; i < COLUMNS; ++i) {
        const depths candidate = load_row(sizes, depth, first_column, last_column, min(first_row + i, last_row));
        const numbers nearer = candidate < nearest;
        nearest = nearer ? candidate : nearest;
        number = nearer ? LANES * i + LANE_COLUMNS : number;
    }
    const int chosen = nearest_number(nearest, number);
    const int column = min(first_column + chosen % LANES, last_column), row = min(first_row + chosen / LANES, last_row);
    out[AT(OUT, x, y, 0)] = SCALE * motion[AT(MOTION, column, row, 0)];
    out[AT(OUT, x, y, 1)] = SCALE * motion[AT(MOTION, column, row, 1)];
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void dilate(Sizes given, global const float* motion,
                                                                        global const storage* depth,
                                                                        global float* restrict out) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) dilate_block(sizes, motion, depth, out, x, y);
}
