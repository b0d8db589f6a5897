// maxpool_2: the maximum of every 2×2 pixels.
//
// Options: IN_*, OUT_* (layouts), STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void max_pool(global const storage* in,
                                                                          global storage* out) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
        const float4 above = fmax(LOAD_CHANNELS(IN, in, 2 * x, 2 * y, c), LOAD_CHANNELS(IN, in, 2 * x + 1, 2 * y, c));
        const float4 below =
            fmax(LOAD_CHANNELS(IN, in, 2 * x, 2 * y + 1, c), LOAD_CHANNELS(IN, in, 2 * x + 1, 2 * y + 1, c));
        STORE_CHANNELS(OUT, fmax(above, below), out, x, y, c);
    }
}
