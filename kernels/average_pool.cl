// avgpool_s: the mean of each SCALE × SCALE square of pixels.
//
// Options: IN_*, OUT_* (layouts), SCALE, STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void average_pool(Sizes given, global const storage* in,
                                                                              global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
        float4 sum = 0;
        for (int i = 0; i < SCALE * SCALE; ++i)
            sum += LOAD_CHANNELS(IN, in, SCALE * x + i % SCALE, SCALE * y + i / SCALE, c);
        STORE_CHANNELS(OUT, sum / (SCALE * SCALE), out, x, y, c);
    }
}
