// VALUE everywhere.
//
// Options: OUT_* (layout), VALUE, STORE_HALF.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void fill(Sizes given, global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    for (int c = 0; c < OUT_CHANNELS; ++c) STORE(VALUE, out, AT(OUT, x, y, c));
}
