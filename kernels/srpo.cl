// What SRPO makes of its network's offsets: the mask, and the colours that are moved.
//
// Options: OFFSETS_* (raw offsets, two channels), OUT_* and the other images' layouts, STORE_HALF; WG_X, WG_Y.

#ifdef OFFSET_MASK
// Options: PIXELS, ROWS. A work-item blurs a strip of ROWS rows of PIXELS pixels. Work-items: (⌈width / PIXELS⌉,
// ⌈height / ROWS⌉).

// exp(-d² / 2) of d = 0 … 3, divided by the seven taps' sum.
#define W0 0.39905028f
#define W1 0.24203623f
#define W2 0.05400558f
#define W3 0.00443305f
#define BLUR(p, step)                                                                                       \
    (W0 * (p)[3 * (step)] + W1 * ((p)[2 * (step)] + (p)[4 * (step)]) + W2 * ((p)[step] + (p)[5 * (step)]) + \
     W3 * ((p)[0] + (p)[6 * (step)]))

INLINE float is_moved(const Sizes* sizes, global const storage* offsets, int x, int y) {
    if (!INSIDE(OFFSETS, x, y)) return 0;
    const float ox = LOAD(offsets, AT(OFFSETS, x, y, 0)) + 0.5f, oy = LOAD(offsets, AT(OFFSETS, x, y, 1)) + 0.5f;
    return ox >= 0 && ox < 1 && oy >= 0 && oy < 1 ? 0 : 1;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void offset_mask(Sizes given, global const storage* offsets,
                                                                             global storage* restrict out) {
    TAKE(sizes);
    const int left = (int)get_global_id(0) * PIXELS, top = ROW_ITEM(1) * ROWS;
    if (left >= OUT_WIDTH || top >= OUT_HEIGHT) return;
    float along_x[(ROWS + 6) * PIXELS];
    for (int r = 0; r < ROWS + 6; ++r) {
        float moved[PIXELS + 6];
        for (int p = 0; p < PIXELS + 6; ++p) moved[p] = is_moved(sizes, offsets, left + p - 3, top + r - 3);
        for (int p = 0; p < PIXELS; ++p) along_x[r * PIXELS + p] = BLUR(moved + p, 1);
    }
    for (int r = 0; r < min(ROWS, OUT_HEIGHT - top); ++r) {
        float mask[PIXELS];
        for (int p = 0; p < PIXELS; ++p) mask[p] = clamp(BLUR(along_x + r * PIXELS + p, PIXELS), 0.0f, 1.0f);
        for (int p = 0; p < min(PIXELS, OUT_WIDTH - left); ++p) STORE(mask[p], out, AT(OUT, left + p, top + r, 0));
    }
}
#else
// Options: COLOR_*, MASK_*, INTERPOLATED_*, SCALE.

// The pixel that an offset leads to. It is limited before it becomes an int, to beyond the image.
inline int moved_to(int pixel, float offset, int size) {
    const float limited = clamp(floor(offset + 0.5f), -(float)size, (float)size);
    return clamp(pixel + (int)limited, 0, size - 1);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void project(Sizes given, global const storage* color,
                                                                         global const storage* offsets,
                                                                         global const storage* mask,
                                                                         global const storage* interpolated,
                                                                         global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int from_x = moved_to(x / SCALE, LOAD(offsets, AT(OFFSETS, x, y, 0)), COLOR_WIDTH);
    const int from_y = moved_to(y / SCALE, LOAD(offsets, AT(OFFSETS, x, y, 1)), COLOR_HEIGHT);
    const float share = LOAD(mask, AT(MASK, x, y, 0));
    const float4 moved = LOAD_CHANNELS(COLOR, color, from_x, from_y, 0);
    const float4 between = LOAD_CHANNELS(INTERPOLATED, interpolated, x, y, 0);
    STORE_CHANNELS(OUT, share * moved + (1 - share) * between, out, x, y, 0);
}
#endif
