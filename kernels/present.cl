// The pipeline's output, display-encoded, into the caller's image.
//
// Options: OUT_* (the output's layout, three channels, or four with alpha), STORE_HALF (its storage), TARGET (uchar,
// half or float) and TARGET_COMPONENTS (3, or 4 with the output's alpha, 1 where it has none), LINEAR_COLOR,
// EXPOSURE_COMPUTED (exposure.cl has written it). The target's place is (bytes to its first pixel, bytes from row to
// row).

#define WRITE(v, p, i) JOIN(WRITE_, TARGET)((v), (p), (i))

// Four pixels' colours, each with its alpha, or a component that means nothing. Past the row's end they are anything.
inline float16 load_colors(const Sizes* sizes, global const storage* out, int x, int y) {
#if OUT_BLOCK == 1 && OUT_STRIDE == 4
    return LOAD16(out, AT(OUT, x, y, 0));
#elif OUT_BLOCK == 1
    const int last = OUT_WIDTH - 1;
    return (float16)(LOAD4(out, AT(OUT, x, y, 0)), LOAD4(out, AT(OUT, min(x + 1, last), y, 0)),
                     LOAD4(out, AT(OUT, min(x + 2, last), y, 0)), LOAD4(out, AT(OUT, min(x + 3, last), y, 0)));
#else
    float colors[16] = {0};
    for (int i = 0; i < min(4, OUT_WIDTH - x); ++i)
        for (int c = 0; c < OUT_CHANNELS; ++c) colors[4 * i + c] = LOAD(out, AT(OUT, x + i, y, c));
    return vload16(0, colors);
#endif
}

#ifdef LINEAR_COLOR
// From display values to tone-mapped light, by the inverse of the sRGB transfer function, and on to light, for which
// white would be infinitely bright.
inline float16 scene_light(float16 v, float exposure) {
    const float16 toned = v < 12.92f * 0.0031308f ? v * (1 / 12.92f) : power((v + 0.055f) * (1 / 1.055f), 2.4f);
    const float4 brightest = max(toned.s048c, max(toned.s159d, toned.s26ae)), limit = 1 - 0x1p-12f;
    const float4 shrink = brightest > limit ? limit / brightest : 1;
    const float4 gain = shrink / ((1 - min(brightest, limit)) * exposure);
    return toned * (float16)(gain.xxxx, gain.yyyy, gain.zzzz, gain.wwww);
}
#endif

#ifdef EXPOSURE_COMPUTED
#define EXPOSURE_PARAMETER global const float *computed_exposure,
#define EXPOSURE computed_exposure[0]
#else
#define EXPOSURE_PARAMETER
#define EXPOSURE frame.exposure
#endif

inline void store_color(float4 color, float alpha, global TARGET* pixel) {
    WRITE(color.x, pixel, 0);
    WRITE(color.y, pixel, 1);
    WRITE(color.z, pixel, 2);
#if TARGET_COMPONENTS == 4
    WRITE(OUT_CHANNELS == 4 ? alpha : 1.0f, pixel, 3);
#endif
}

// A work-item writes four pixels, whose colours fill a vector.
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void present(Sizes given, global const storage* out,
                                                                         global uchar* target, uint2 place,
                                                                         EXPOSURE_PARAMETER Frame frame) {
    TAKE(sizes);
    const int x = 4 * get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    float16 colors = load_colors(sizes, out, x, y);
    colors = colors > 0 ? min(colors, 1.0f) : 0;  // NaN becomes 0
    const float4 alphas = colors.s37bf;
#ifdef LINEAR_COLOR
    colors = scene_light(colors, EXPOSURE);
#endif
    global TARGET* pixel = (global TARGET*)(target + place.x + (size_t)y * place.y) + x * TARGET_COMPONENTS;
    store_color(colors.s0123, alphas.x, pixel);
    if (x + 1 < OUT_WIDTH) store_color(colors.s4567, alphas.y, pixel + TARGET_COMPONENTS);
    if (x + 2 < OUT_WIDTH) store_color(colors.s89ab, alphas.z, pixel + 2 * TARGET_COMPONENTS);
    if (x + 3 < OUT_WIDTH) store_color(colors.scdef, alphas.w, pixel + 3 * TARGET_COMPONENTS);
}
