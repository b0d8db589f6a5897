// M = s · upsample(m, s, J_m) of motion vectors, in HR pixels; NaN where a tap whose weight along both axes exceeds
// 10⁻³ is invalid. All images are float.
//
// Options: IN_*, OUT_* (layouts), SCALE, STRIP (pixels of a row to a work-item).

// Adds what the vector at (x, y) contributes with these weights, and returns whether it is invalid and counts.
INLINE int add_tap(const Sizes* sizes, global const float* in, int x, int y, float weight_x, float weight_y,
                   float2* sum) {
    const float2 vector = (float2)(in[AT(IN, x, y, 0)], in[AT(IN, x, y, 1)]);
    const int valid = is_finite(vector.x) && is_finite(vector.y);
    if (valid) *sum += SCALE * weight_x * weight_y * vector;
    return !valid && weight_x > 1e-3f && weight_y > 1e-3f;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void upsample_motion(Sizes given, global const float* in,
                                                                                 global float* restrict out,
                                                                                 Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    const Taps ty = upsample_taps(y, SCALE, frame.motion_jitter_y, IN_HEIGHT);
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        const Taps tx = upsample_taps(x, SCALE, frame.motion_jitter_x, IN_WIDTH);
        float2 sum = (float2)(0);
        const int invalid = add_tap(sizes, in, tx.first, ty.first, tx.first_weight, ty.first_weight, &sum) |
                            add_tap(sizes, in, tx.second, ty.first, tx.second_weight, ty.first_weight, &sum) |
                            add_tap(sizes, in, tx.first, ty.second, tx.first_weight, ty.second_weight, &sum) |
                            add_tap(sizes, in, tx.second, ty.second, tx.second_weight, ty.second_weight, &sum);
        if (invalid) sum = (float2)(NAN);
        out[AT(OUT, x, y, 0)] = sum.x;
        out[AT(OUT, x, y, 1)] = sum.y;
    }
}
