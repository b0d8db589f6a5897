// maxpool_2: the maximum of every 2×2 pixels.
//
// Options: IN_*, OUT_* (layouts), STRIP (pixels of a row to a work-item), STORE_HALF.

// Channels from c on, in vectors that LOAD_ and STORE_ move.
#define POOL(LOAD_, STORE_)                                                                                \
    STORE_(fmax(fmax(LOAD_(in, AT(IN, 2 * x, 2 * y, c)), LOAD_(in, AT(IN, 2 * x + 1, 2 * y, c))),          \
                fmax(LOAD_(in, AT(IN, 2 * x, 2 * y + 1, c)), LOAD_(in, AT(IN, 2 * x + 1, 2 * y + 1, c)))), \
           out, AT(OUT, x, y, c))

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void max_pool(Sizes given, global const storage* in,
                                                                          global storage* restrict out) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        int c = 0;
#if IN_BLOCK == 1 && OUT_BLOCK == 1
        for (; c + 16 <= OUT_CHANNELS; c += 16) POOL(LOAD16, STORE16);
#endif
        for (; c < OUT_CHANNELS; ++c) POOL(LOAD, STORE);
    }
}
