// An image in a byte an element, as convolutions in whole numbers round what they read.
//
// Options: IN_*, OUT_* (layouts), STRIP (pixels of a row to a work-item), STORE_HALF; when it runs, INVERSE_SCALE and
// ZERO_POINT.

#include "numbers.clh"

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void numbers(Sizes given, global const storage* in,
                                                                         global uchar* restrict out) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x)
        for (int c = 0; c < OUT_CHANNELS; c += 4) {
            const float4 values = LOAD_CHANNELS(IN, in, x, y, c);
            const uchar4 four = convert_uchar4(number4(values, INVERSE_SCALE, ZERO_POINT));
            const uchar each[4] = {four.s0, four.s1, four.s2, four.s3};
            for (int i = 0; i < min(4, OUT_CHANNELS - c); ++i) out[AT(OUT, x, y, c + i)] = each[i];
        }
}
