// Each pixel's motion, of it and its eight neighbours that of the one nearest to the viewer; of equals its own, then
// the first in raster order.
//
// Options: MOTION_*, DEPTH_*, OUT_* (layouts), STORE_HALF (depth's storage; motion is float).

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void foremost_motion(global const float* motion,
                                                                                 global const storage* depth,
                                                                                 global float* out) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    int foremost_x = x, foremost_y = y;
    float least = LOAD(depth, AT(DEPTH, x, y, 0));
#pragma unroll
    for (int i = 0; i < 9; ++i) {
        const int column = clamp(x + i % 3 - 1, 0, DEPTH_WIDTH - 1), row = clamp(y + i / 3 - 1, 0, DEPTH_HEIGHT - 1);
        const float candidate = LOAD(depth, AT(DEPTH, column, row, 0));
        const bool nearer = candidate < least;
        least = nearer ? candidate : least;
        foremost_x = nearer ? column : foremost_x;
        foremost_y = nearer ? row : foremost_y;
    }
    out[AT(OUT, x, y, 0)] = motion[AT(MOTION, foremost_x, foremost_y, 0)];
    out[AT(OUT, x, y, 1)] = motion[AT(MOTION, foremost_x, foremost_y, 1)];
}
