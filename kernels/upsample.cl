// upsample(x, s, J): bilinear, by a whole factor.
//
// Options: IN_*, OUT_* (layouts), SCALE, SHIFT_X, SHIFT_Y (the jitter, as an expression in `frame`), STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void upsample_image(global const storage* in,
                                                                                global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Taps tx = upsample_taps(x, SCALE, SHIFT_X, IN_WIDTH);
    const Taps ty = upsample_taps(y, SCALE, SHIFT_Y, IN_HEIGHT);
    for (int c = 0; c < OUT_CHANNELS; c += 4) STORE_CHANNELS(OUT, BILINEAR(IN, in, tx, ty, c), out, x, y, c);
}
