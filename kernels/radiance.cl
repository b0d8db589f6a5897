// Display-encoded colours as radiance, and back (docs/nss.md).
//
// Options: IN_*, OUT_* (layouts), FOLD (1 - 1 / white: how far display values near 1 stand for light without bound),
// DECODE or ENCODE, STORE_HALF. A work-item makes four pixels, whose colours fill a vector.

#define BRIGHTEST (65504.0f / 65505.0f)

INLINE float16 converted(float16 colors) {
#ifdef DECODE
    const float16 v = clamp(colors, 0.0f, 1.0f);
    const float16 linear = v <= 0.04045f ? v * (1 / 12.92f) : power((v + 0.055f) * (1 / 1.055f), 2.4f);
    const float4 peak = max(linear.s048c, max(linear.s159d, linear.s26ae));
    const float4 gain = 1 / (1 - FOLD * min(peak, BRIGHTEST));
    return linear * (float16)(gain.xxxx, gain.yyyy, gain.zzzz, gain.wwww);
#else
    const float4 peak = max(colors.s048c, max(colors.s159d, colors.s26ae));
    const float4 gain = 1 / (1 + FOLD * peak);
    const float16 linear = clamp(colors * (float16)(gain.xxxx, gain.yyyy, gain.zzzz, gain.wwww), 0.0f, 1.0f);
    return linear < 0.0031308f ? 12.92f * linear : 1.055f * power(fmax(linear, 0.0031308f), 1 / 2.4f) - 0.055f;
#endif
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void radiance(Sizes given, global const storage* in,
                                                                          global storage* restrict out) {
    TAKE(sizes);
    const int x = 4 * get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    float colors[16];
#pragma unroll
    for (int i = 0; i < 16; ++i) {
        const float v = i % 4 == 3 ? 0 : LOAD(in, AT(IN, min(x + i / 4, IN_WIDTH - 1), y, i % 4));
        colors[i] = v > 0 ? v : 0;  // NaN becomes 0
    }
    vstore16(converted(vload16(0, colors)), 0, colors);
#pragma unroll
    for (int i = 0; i < 16; ++i)
        if (i % 4 < 3 && x + i / 4 < OUT_WIDTH) STORE(colors[i], out, AT(OUT, x + i / 4, y, i % 4));
}
