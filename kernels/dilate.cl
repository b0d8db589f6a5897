// dilate(m, d, s): the motion of the nearest LR pixel under each 8×8 HR block, in HR pixels.
//
// Options: MOTION_*, DEPTH_*, OUT_* (layouts, OUT a pixel a block), SCALE, STORE_HALF (depth's storage; motion is
// float).

#define BLOCK 8
// The most LR columns, and rows, under a block; one that has fewer looks at its last again, which changes nothing.
#if BLOCK % SCALE == 0
#define COLUMNS (BLOCK / SCALE)
#else
#define COLUMNS ((BLOCK - 2) / SCALE + 2)
#endif

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void dilate(Sizes given, global const float* motion,
                                                                        global const storage* depth,
                                                                        global float* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int first_column = BLOCK * x / SCALE, first_row = BLOCK * y / SCALE;
    const int last_column = min((BLOCK * x + BLOCK - 1) / SCALE, DEPTH_WIDTH - 1);
    const int last_row = min((BLOCK * y + BLOCK - 1) / SCALE, DEPTH_HEIGHT - 1);

    int nearest_x = first_column, nearest_y = first_row;
    float nearest = LOAD(depth, AT(DEPTH, first_column, first_row, 0));
#pragma unroll
    for (int i = 0; i < COLUMNS * COLUMNS; ++i) {
        const int column = min(first_column + i % COLUMNS, last_column), row = min(first_row + i / COLUMNS, last_row);
        const float candidate = LOAD(depth, AT(DEPTH, column, row, 0));
        const bool nearer = candidate < nearest;  // of equals the first in raster order stays
        nearest = nearer ? candidate : nearest;
        nearest_x = nearer ? column : nearest_x;
        nearest_y = nearer ? row : nearest_y;
    }
    out[AT(OUT, x, y, 0)] = SCALE * motion[AT(MOTION, nearest_x, nearest_y, 0)];
    out[AT(OUT, x, y, 1)] = SCALE * motion[AT(MOTION, nearest_x, nearest_y, 1)];
}
