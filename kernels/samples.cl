// pick(I, s, J) and place(I, x, s, J): the HR pixels at the frame's sample position in each s×s tile.
//
// Options: IN_*, OUT_* (layouts), SCALE, STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void pick(Sizes given, global const storage* in,
                                                                      global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int from_x = SCALE * x + frame.sample_x, from_y = SCALE * y + frame.sample_y;
    for (int c = 0; c < OUT_CHANNELS; c += 4)
        STORE_CHANNELS(OUT, LOAD_CHANNELS(IN, in, from_x, from_y, c), out, x, y, c);
}

// The image that the samples are placed in is already there: `out` is its memory.
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void place(Sizes given, global const storage* in,
                                                                       global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= IN_WIDTH || y >= IN_HEIGHT) return;
    const int to_x = SCALE * x + frame.sample_x, to_y = SCALE * y + frame.sample_y;
    for (int c = 0; c < OUT_CHANNELS; c += 4) STORE_CHANNELS(OUT, LOAD_CHANNELS(IN, in, x, y, c), out, to_x, to_y, c);
}
