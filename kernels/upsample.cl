// upsample(x, s, J): bilinear, by a whole factor.
//
// Options: IN_*, OUT_* (layouts), STRIP (pixels of a row to a work-item), SCALE, SHIFT_X, SHIFT_Y (the jitter, as an
// expression in `frame`), STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void upsample_image(Sizes given, global const storage* in,
                                                                                global storage* restrict out,
                                                                                Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    const Taps ty = upsample_taps(y, SCALE, SHIFT_Y, IN_HEIGHT);
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        const Taps tx = upsample_taps(x, SCALE, SHIFT_X, IN_WIDTH);
        int c = 0;
#if IN_BLOCK == 1 && OUT_BLOCK == 1
        for (; c + 16 <= OUT_CHANNELS; c += 16)
            STORE16(tx.first_weight * ty.first_weight * LOAD16(in, AT(IN, tx.first, ty.first, c)) +
                        tx.second_weight * ty.first_weight * LOAD16(in, AT(IN, tx.second, ty.first, c)) +
                        tx.first_weight * ty.second_weight * LOAD16(in, AT(IN, tx.first, ty.second, c)) +
                        tx.second_weight * ty.second_weight * LOAD16(in, AT(IN, tx.second, ty.second, c)),
                    out, AT(OUT, x, y, c));
#endif
        for (; c < OUT_CHANNELS; c += 4) STORE_CHANNELS(OUT, BILINEAR(IN, in, tx, ty, c), out, x, y, c);
    }
}
