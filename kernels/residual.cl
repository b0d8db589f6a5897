// residual(colour, past, J) of docs/fsr2.md: what a sample differs by from the history where it was taken, in YCoCg.
//
// Options: COLOR_*, OUT_* (render resolution), PAST_* (output resolution: colour and a weight; layouts), SCALE_X,
// SCALE_X_REST, SCALE_Y, SCALE_Y_REST (the ratio of the sizes along each axis as the sum of two floats), STRIP (pixels
// of a row to a work-item), STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void residual(Sizes given, global const storage* color,
                                                                          global const storage* past,
                                                                          global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    const Taps row = place_taps(y, frame.jitter_y, SCALE_Y, SCALE_Y_REST, PAST_HEIGHT);
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        const Taps column = place_taps(x, frame.jitter_x, SCALE_X, SCALE_X_REST, PAST_WIDTH);
        const float4 difference = LOAD_CHANNELS(COLOR, color, x, y, 0) - BILINEAR(PAST, past, column, row, 0);
        STORE_CHANNELS(OUT, to_ycocg(difference), out, x, y, 0);
    }
}
