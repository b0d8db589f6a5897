// What a network carries from frame to frame, at another size: Keys' bicubic along both axes, held between the four
// pixels around, so that a value that is there stays and edges do not ring; a value that is not a number becomes one of
// them, or 0 where none of them is one. Positions are fractions of whole numbers, the sizes.
//
// Options: IN_*, OUT_* (layouts of the same channels), STORE_HALF.

typedef struct {
    int whole;
    float fraction;
} Place;

// The index coordinate of pixel x of `to` in an axis of `from` pixels.
INLINE Place place_of(int x, int from, int to) {
    const int place = (2 * x + 1) * from - to;  // in units of 1 / (2 to)
    const int whole = place < 0 ? -1 : place / (2 * to);
    const Place result = {whole, (float)(place - whole * 2 * to) / (2 * to)};
    return result;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void resize_state(Sizes given, global const storage* in,
                                                                              global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Place column = place_of(x, IN_WIDTH, OUT_WIDTH), row = place_of(y, IN_HEIGHT, OUT_HEIGHT);
    float column_weights[4], row_weights[4];
    vstore4(keys(column.fraction), 0, column_weights);
    vstore4(keys(row.fraction), 0, row_weights);
    for (int c = 0; c < OUT_CHANNELS; c += 4) {
        float4 sum = 0, least = INFINITY, greatest = -INFINITY;
        for (int j = 0; j < 4; ++j)
            for (int i = 0; i < 4; ++i) {
                const float4 v = LOAD_CHANNELS(IN, in, clamp(column.whole - 1 + i, 0, IN_WIDTH - 1),
                                               clamp(row.whole - 1 + j, 0, IN_HEIGHT - 1), c);
                sum = MAD((float4)(column_weights[i] * row_weights[j]), v, sum);
                if ((i == 1 || i == 2) && (j == 1 || j == 2)) least = LESSER(v, least), greatest = GREATER(v, greatest);
            }
        const float4 held = least <= greatest ? LESSER(GREATER(sum, least), greatest) : (float4)(0);
        STORE_CHANNELS(OUT, held, out, x, y, c);
    }
}
