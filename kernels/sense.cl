// sense(past, d, J) of docs/clarus.md: what a render pixel sees of the history where its sample was taken and a quarter
// of a pixel around its centre, and how much nearer its nearest neighbour is.
//
// Options: PAST_* (output resolution: colour and a weight), DEPTH_*, OUT_* (render resolution; layouts), SCALE_X,
// SCALE_X_REST, SCALE_Y, SCALE_Y_REST (the ratio of the sizes along each axis as the sum of two floats), STRIP (pixels
// of a row to a work-item), STORE_HALF (all but depth, which is float).

INLINE float luma(float4 color) { return 0.299f * color.x + 0.587f * color.y + 0.114f * color.z; }

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void sense(Sizes given, global const storage* past,
                                                                       global const float* depth,
                                                                       global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
#define ACROSS(x, offset) place_taps(x, offset, SCALE_X, SCALE_X_REST, PAST_WIDTH)
#define DOWN(y, offset) place_taps(y, offset, SCALE_Y, SCALE_Y_REST, PAST_HEIGHT)
    const Taps row = DOWN(y, frame.jitter_y), upper = DOWN(y, -0.25f), lower = DOWN(y, 0.25f);
    const int above = max(y - 1, 0), below = min(y + 1, DEPTH_HEIGHT - 1);
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        const Taps column = ACROSS(x, frame.jitter_x), left = ACROSS(x, -0.25f), right = ACROSS(x, 0.25f);
        const float4 here = BILINEAR(PAST, past, column, row, 0);
        STORE_CHANNELS(OUT, (float4)(here.xyz, 0.25f * log2_float(1 + here.w)), out, x, y, 0);
        STORE_CHANNELS(
            OUT,
            (float4)(luma(BILINEAR(PAST, past, left, upper, 0)), luma(BILINEAR(PAST, past, right, upper, 0)),
                     luma(BILINEAR(PAST, past, left, lower, 0)), luma(BILINEAR(PAST, past, right, lower, 0))),
            out, x, y, 4);
        const int before = max(x - 1, 0), after = min(x + 1, DEPTH_WIDTH - 1);
#define DEPTH_AT(x, y) depth[AT(DEPTH, x, y, 0)]
        const float middle = DEPTH_AT(x, y);
        float nearest = middle;
#define CONSIDER(x, y) nearest = DEPTH_AT(x, y) < nearest ? DEPTH_AT(x, y) : nearest
        CONSIDER(before, above);
        CONSIDER(x, above);
        CONSIDER(after, above);
        CONSIDER(before, y);
        CONSIDER(after, y);
        CONSIDER(before, below);
        CONSIDER(x, below);
        CONSIDER(after, below);
        STORE(1 - nearest / (middle > 1e-6f ? middle : 1e-6f), out, AT(OUT, x, y, 8));
    }
}
