// The exposure of a frame of linear colour, for ingest and present: computed[0], by one work-group. computed[1] is the
// automatic part of it, which the next frame follows.
//
// Options: RAW_EXPOSURE and RAW_EXPOSURE_COMPONENTS, the caller's image of one pixel; or AUTOMATIC, with the layout
// COLOR_* and RAW_COLOR, RAW_COLOR_COMPONENTS of the caller's colour, as in ingest.cl, and MOST_SAMPLES along an axis.

inline float within_reach(float exposure) { return clamp(exposure, 1e-20f, 1e20f); }

#ifdef AUTOMATIC
// docs/integrating.md, "Exposure".
#define DARKEST 1e-4f
#define SATURATION 9.6f  // of mean luminance: what becomes white

#define COLOR_AT(row, x, c) JOIN(PIXEL_, RAW_COLOR)((row), (x), (c), RAW_COLOR_COMPONENTS)

// NaN and what is negative become 0, infinity the largest half.
inline float light(float v) { return v > 0 ? min(v, 65504.0f) : 0; }

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void make_exposure(Sizes given,
                                                                               global const uchar* raw_color,
                                                                               uint2 color_place,
                                                                               global float* computed, Frame frame) {
    TAKE(sizes);
    local float sums[WG_X];
    const int item = get_local_id(0);
    const int columns = min(COLOR_WIDTH, MOST_SAMPLES), rows = min(COLOR_HEIGHT, MOST_SAMPLES);
    float sum = 0;
    for (int i = item; i < columns * rows; i += WG_X) {
        const int x = (2 * (i % columns) + 1) * COLOR_WIDTH / (2 * columns);
        const int y = (2 * (i / columns) + 1) * COLOR_HEIGHT / (2 * rows);
        global const uchar* row = raw_color + color_place.x + (size_t)y * color_place.y;
        const float luminance = 0.2126f * light(COLOR_AT(row, x, 0)) + 0.7152f * light(COLOR_AT(row, x, 1)) +
                                0.0722f * light(COLOR_AT(row, x, 2));
        sum += log2(max(luminance, DARKEST));
    }
    sums[item] = sum;
    for (int half_of = WG_X / 2; half_of > 0; half_of /= 2) {
        barrier(CLK_LOCAL_MEM_FENCE);
        if (item < half_of) sums[item] += sums[item + half_of];
    }
    if (item > 0) return;
    float own = within_reach(1 / (SATURATION * exp2(sums[0] / (columns * rows))));
    if (!frame.reset) own = computed[1] * pow(own / computed[1], frame.exposure_share);
    computed[0] = within_reach(own * frame.exposure);
    computed[1] = own;
}
#else
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void make_exposure(global const uchar* raw_exposure,
                                                                               uint2 place, global float* computed,
                                                                               Frame frame) {
    if (get_local_id(0) > 0) return;
    const float v = JOIN(PIXEL_, RAW_EXPOSURE)(raw_exposure + place.x, 0, 0, RAW_EXPOSURE_COMPONENTS);
    computed[0] = within_reach(frame.exposure * (v > 0 && is_finite(v) ? v : 1));
}
#endif
