// Sharpening against the four diagonal neighbours: MNSS, step 6.
//
// Options: IN_*, OUT_* (layouts), AMOUNT, STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void sharpen(Sizes given, global const storage* in,
                                                                         global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int left = max(x - 1, 0), right = min(x + 1, IN_WIDTH - 1);
    const int above = max(y - 1, 0), below = min(y + 1, IN_HEIGHT - 1);
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
        const float4 corners = LOAD_CHANNELS(IN, in, left, above, c) + LOAD_CHANNELS(IN, in, right, above, c) +
                               LOAD_CHANNELS(IN, in, left, below, c) + LOAD_CHANNELS(IN, in, right, below, c);
        const float4 sharp = (1 + 4 * AMOUNT) * LOAD_CHANNELS(IN, in, x, y, c) - AMOUNT * corners;
        STORE_CHANNELS(OUT, clamp(sharp, 0.0f, 1.0f), out, x, y, c);
    }
}
