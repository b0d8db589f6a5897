// The pipeline's output, display-encoded, into the caller's image.
//
// Options: OUT_* (the output's layout, three channels), STORE_HALF (its storage), TARGET (uchar, half or float) and
// TARGET_COMPONENTS (3, or 4 with alpha 1), LINEAR_COLOR. The target's place is (bytes to its first pixel, bytes from
// row to row).

#define WRITE(v, p, i) JOIN(WRITE_, TARGET)((v), (p), (i))

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void present(global const storage* out,
                                                                     global uchar* target, uint2 place, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    float4 color = (float4)(unit(LOAD(out, AT(OUT, x, y, 0))), unit(LOAD(out, AT(OUT, x, y, 1))),
                            unit(LOAD(out, AT(OUT, x, y, 2))), 0);
#ifdef LINEAR_COLOR
    // The inverse of the sRGB transfer function, then of the tone mapping, for which white would be infinitely bright.
    color = color < 12.92f * 0.0031308f ? color / 12.92f : power((color + 0.055f) / 1.055f, 2.4f);
    const float brightest = fmax(color.x, fmax(color.y, color.z)), limit = 1 - 0x1p-12f;
    if (brightest > limit) color *= limit / brightest;
    color /= (1 - fmin(brightest, limit)) * frame.exposure;
#endif
    global TARGET* pixel = (global TARGET*)(target + place.x + (size_t)y * place.y) + x * TARGET_COMPONENTS;
    WRITE(color.x, pixel, 0);
    WRITE(color.y, pixel, 1);
    WRITE(color.z, pixel, 2);
#if TARGET_COMPONENTS == 4
    WRITE(1.0f, pixel, 3);
#endif
}
