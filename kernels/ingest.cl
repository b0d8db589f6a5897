// The caller's images into their canonical form (docs/conventions.md), and the planes of the jitter and the scale: one
// pass over the frame.
//
// Options: WIDTH, HEIGHT (of the largest); the layouts COLOR_*, DEPTH_*, MOTION_*, JITTER_X_*, JITTER_Y_*, SCALE_*,
// REACTIVE_*, TRANSPARENCY_*, OPAQUE_*, UI_*, ALPHA_* of what the pipeline uses, each but motion with a …_STORAGE (half
// or float), all with …_SMALLER (whether another is larger); for each resource T of them the caller's format, RAW_T
// (ElementType's name) and RAW_T_COMPONENTS;
// LINEAR_COLOR, EXPOSURE_COMPUTED (exposure.cl has written it), PROJECTIVE_DEPTH, REVERSED_DEPTH. A resource's place is
// (bytes to its first pixel, bytes from row to row).

// Component c of the caller's pixel x in a row of resource T, and channel c of the canonical pixel (x, y).
#define READ_AT(T, row, x, c) JOIN(PIXEL_, RAW_##T)((row), (x), (c), RAW_##T##_COMPONENTS)
#define READ(T, row, c) READ_AT(T, row, x, c)
#define WRITE(T, v, p, c) JOIN(WRITE_, T##_STORAGE)((v), (p), AT(T, x, y, c))

// NaN becomes 0.
inline float within_unit(float v) { return v > 0 ? min(v, 1.0f) : 0; }

#ifdef LINEAR_COLOR
// Negative and NaN become 0, infinity the largest half.
inline float readable(float v) { return v > 0 ? (is_finite(v) ? v : 65504.0f) : 0; }

// Four pixels of four components, the last of each 0.
inline float16 display_values(float16 scene, float exposure) {
    const float16 exposed = min(scene * exposure, FLT_MAX);
    const float4 gain = 1 / (1 + max(exposed.s048c, max(exposed.s159d, exposed.s26ae)));
    const float16 v = exposed * (float16)(gain.xxxx, gain.yyyy, gain.zzzz, gain.wwww);
    // The sRGB transfer function.
    return v < 0.0031308f ? 12.92f * v : 1.055f * power(v, 1 / 2.4f) - 0.055f;
}
#else
inline float readable(float v) { return within_unit(v); }
#endif

#ifdef DEPTH_WIDTH
// Projective: d = r / (t + a (1 - t)) with t = 1 - v, or v where reversed. With a finite far plane r = a = near / far,
// with an infinite one r = 1e-4 and a = 0. No nearly equal numbers are subtracted but v from 1, which is then exact.
inline float canonical_depth(float raw, Frame frame) {
    if (is_nan(raw)) return 1;
    const float v = clamp(raw, 0.0f, 1.0f);
#ifdef REVERSED_DEPTH
    const float toward_near = v, toward_far = 1 - v;
#else
    const float toward_near = 1 - v, toward_far = v;
#endif
#ifdef PROJECTIVE_DEPTH
    const float denominator = toward_near + frame.depth_addend * toward_far;
    return denominator > 0 ? fmin(frame.depth_numerator / denominator, 1.0f) : 1;
#else
    return toward_far;
#endif
}
#endif

// What the pipeline uses of the frame, as parameters of a function and as its arguments.
#ifdef COLOR_WIDTH
#define COLOR_PARAMETERS global const uchar *raw_color, uint2 color_place, global COLOR_STORAGE *color,
#define COLOR_PASSED raw_color, color_place, color,
#else
#define COLOR_PARAMETERS
#define COLOR_PASSED
#endif
#ifdef DEPTH_WIDTH
#define DEPTH_PARAMETERS global const uchar *raw_depth, uint2 depth_place, global DEPTH_STORAGE *depth,
#define DEPTH_PASSED raw_depth, depth_place, depth,
#else
#define DEPTH_PARAMETERS
#define DEPTH_PASSED
#endif
#ifdef MOTION_WIDTH
#define MOTION_PARAMETERS \
    global const uchar *raw_motion, uint2 motion_place, global float *motion, volatile global uint *invalid_vectors,
#define MOTION_PASSED raw_motion, motion_place, motion, invalid_vectors,
#else
#define MOTION_PARAMETERS
#define MOTION_PASSED
#endif
#ifdef JITTER_X_WIDTH
#define JITTER_X_PARAMETERS global JITTER_X_STORAGE *jitter_x,
#define JITTER_X_PASSED jitter_x,
#else
#define JITTER_X_PARAMETERS
#define JITTER_X_PASSED
#endif
#ifdef JITTER_Y_WIDTH
#define JITTER_Y_PARAMETERS global JITTER_Y_STORAGE *jitter_y,
#define JITTER_Y_PASSED jitter_y,
#else
#define JITTER_Y_PARAMETERS
#define JITTER_Y_PASSED
#endif
#ifdef SCALE_WIDTH
#define SCALE_PARAMETERS global SCALE_STORAGE *scale,
#define SCALE_PASSED scale,
#else
#define SCALE_PARAMETERS
#define SCALE_PASSED
#endif
#ifdef REACTIVE_WIDTH
#define REACTIVE_PARAMETERS global const uchar *raw_reactive, uint2 reactive_place, global REACTIVE_STORAGE *reactive,
#define REACTIVE_PASSED raw_reactive, reactive_place, reactive,
#else
#define REACTIVE_PARAMETERS
#define REACTIVE_PASSED
#endif
#ifdef TRANSPARENCY_WIDTH
#define TRANSPARENCY_PARAMETERS \
    global const uchar *raw_transparency, uint2 transparency_place, global TRANSPARENCY_STORAGE *transparency,
#define TRANSPARENCY_PASSED raw_transparency, transparency_place, transparency,
#else
#define TRANSPARENCY_PARAMETERS
#define TRANSPARENCY_PASSED
#endif
#ifdef OPAQUE_WIDTH
#define OPAQUE_PARAMETERS global const uchar *raw_opaque, uint2 opaque_place, global OPAQUE_STORAGE *opaque,
#define OPAQUE_PASSED raw_opaque, opaque_place, opaque,
#else
#define OPAQUE_PARAMETERS
#define OPAQUE_PASSED
#endif
#ifdef UI_WIDTH
#define UI_PARAMETERS global const uchar *raw_ui, uint2 ui_place, global UI_STORAGE *ui,
#define UI_PASSED raw_ui, ui_place, ui,
#else
#define UI_PARAMETERS
#define UI_PASSED
#endif
#ifdef ALPHA_WIDTH
#define ALPHA_PARAMETERS global const uchar *raw_alpha, uint2 alpha_place, global ALPHA_STORAGE *alpha,
#define ALPHA_PASSED raw_alpha, alpha_place, alpha,
#else
#define ALPHA_PARAMETERS
#define ALPHA_PASSED
#endif
#ifdef EXPOSURE_COMPUTED
#define EXPOSURE_PARAMETERS global const float *computed_exposure,
#define EXPOSURE_PASSED computed_exposure,
#define EXPOSURE computed_exposure[0]
#else
#define EXPOSURE_PARAMETERS
#define EXPOSURE_PASSED
#define EXPOSURE frame.exposure
#endif
#define FRAME_PARAMETERS                                                                                         \
    COLOR_PARAMETERS DEPTH_PARAMETERS MOTION_PARAMETERS JITTER_X_PARAMETERS JITTER_Y_PARAMETERS SCALE_PARAMETERS \
        REACTIVE_PARAMETERS TRANSPARENCY_PARAMETERS OPAQUE_PARAMETERS UI_PARAMETERS ALPHA_PARAMETERS             \
            EXPOSURE_PARAMETERS Frame frame
#define FRAME_PASSED                                                                                     \
    COLOR_PASSED DEPTH_PASSED MOTION_PASSED JITTER_X_PASSED JITTER_Y_PASSED SCALE_PASSED REACTIVE_PASSED \
        TRANSPARENCY_PASSED OPAQUE_PASSED UI_PASSED ALPHA_PASSED EXPOSURE_PASSED frame

// Whether pixel (x, y) of the largest image is one of T's.
#define BELONGS(T, x, y) (!T##_SMALLER || INSIDE(T, x, y))

// Colours of pixels of a row, as many as `pixels` and T have from (x0, y) on, into `values` of four pixels.
#define READ_COLORS(T, row, values)                                                  \
    _Pragma("unroll") for (int i = 0; i < 16; ++i) {                                 \
        const int last = T##_SMALLER ? min(pixels, T##_WIDTH - x0) - 1 : pixels - 1; \
        const int x = x0 + min(i / 4, last);                                         \
        values[i] = i % 4 == 3 ? 0 : readable(READ(T, row, i % 4));                  \
    }
#ifdef LINEAR_COLOR
#define ENCODE_COLORS(values) vstore16(display_values(vload16(0, values), EXPOSURE), 0, values)
#else
#define ENCODE_COLORS(values)
#endif
#define WRITE_COLORS(T, values, written)         \
    do {                                         \
        WRITE(T, values[4 * i], written, 0);     \
        WRITE(T, values[4 * i + 1], written, 1); \
        WRITE(T, values[4 * i + 2], written, 2); \
    } while (0)

// `pixels` of a row, 1 … 4, from (x0, y) on. Colours of four fill a vector.
INLINE void ingest_pixels(const Sizes* sizes, int x0, int y, int pixels, FRAME_PARAMETERS) {
#ifdef COLOR_WIDTH
    global const uchar* color_row = raw_color + color_place.x + (size_t)y * color_place.y;
    float colors[16];
    if (BELONGS(COLOR, x0, y)) READ_COLORS(COLOR, color_row, colors)
    ENCODE_COLORS(colors);
#endif
#ifdef OPAQUE_WIDTH
    global const uchar* opaque_row = raw_opaque + opaque_place.x + (size_t)y * opaque_place.y;
    float opaque_colors[16];
    if (BELONGS(OPAQUE, x0, y)) READ_COLORS(OPAQUE, opaque_row, opaque_colors)
    ENCODE_COLORS(opaque_colors);
#endif
#ifdef UI_WIDTH
    global const uchar* ui_row = raw_ui + ui_place.x + (size_t)y * ui_place.y;
#endif
#ifdef ALPHA_WIDTH
    global const uchar* alpha_row = raw_alpha + alpha_place.x + (size_t)y * alpha_place.y;
#endif
#ifdef DEPTH_WIDTH
    global const uchar* depth_row = raw_depth + depth_place.x + (size_t)y * depth_place.y;
#endif
#ifdef REACTIVE_WIDTH
    global const uchar* reactive_row = raw_reactive + reactive_place.x + (size_t)y * reactive_place.y;
#endif
#ifdef TRANSPARENCY_WIDTH
    global const uchar* transparency_row = raw_transparency + transparency_place.x + (size_t)y * transparency_place.y;
#endif
#ifdef MOTION_WIDTH
    // Where a render pixel's centre is in a motion image of another size.
    const int motion_y0 = (y + 0.5f) * frame.motion_step_y;
    global const uchar* motion_row = raw_motion + motion_place.x + (size_t)motion_y0 * motion_place.y;
    const float longest_squared = (float)MOTION_WIDTH * MOTION_WIDTH + (float)MOTION_HEIGHT * MOTION_HEIGHT;
#endif

#pragma unroll
    for (int i = 0; i < 4; ++i) {
        const int x = x0 + i;
        if (i < pixels) {
#ifdef COLOR_WIDTH
            if (BELONGS(COLOR, x, y)) WRITE_COLORS(COLOR, colors, color);
#endif
#ifdef OPAQUE_WIDTH
            if (BELONGS(OPAQUE, x, y)) WRITE_COLORS(OPAQUE, opaque_colors, opaque);
#endif
#ifdef UI_WIDTH
            if (BELONGS(UI, x, y))
                for (int c = 0; c < 4; ++c) WRITE(UI, within_unit(READ(UI, ui_row, c)), ui, c);
#endif
#ifdef ALPHA_WIDTH
            if (BELONGS(ALPHA, x, y)) WRITE(ALPHA, within_unit(READ(ALPHA, alpha_row, 3)), alpha, 0);
#endif
#ifdef DEPTH_WIDTH
            if (BELONGS(DEPTH, x, y)) WRITE(DEPTH, canonical_depth(READ(DEPTH, depth_row, 0), frame), depth, 0);
#endif
#ifdef REACTIVE_WIDTH
            if (BELONGS(REACTIVE, x, y)) WRITE(REACTIVE, within_unit(READ(REACTIVE, reactive_row, 0)), reactive, 0);
#endif
#ifdef TRANSPARENCY_WIDTH
            if (BELONGS(TRANSPARENCY, x, y))
                WRITE(TRANSPARENCY, within_unit(READ(TRANSPARENCY, transparency_row, 0)), transparency, 0);
#endif
#ifdef JITTER_X_WIDTH
            if (BELONGS(JITTER_X, x, y)) WRITE(JITTER_X, frame.jitter_x, jitter_x, 0);
#endif
#ifdef JITTER_Y_WIDTH
            if (BELONGS(JITTER_Y, x, y)) WRITE(JITTER_Y, frame.jitter_y, jitter_y, 0);
#endif
#ifdef SCALE_WIDTH
            if (BELONGS(SCALE, x, y)) WRITE(SCALE, frame.scale, scale, 0);
#endif
#ifdef MOTION_WIDTH
            if (!BELONGS(MOTION, x, y)) continue;
            const int motion_x0 = (x + 0.5f) * frame.motion_step_x;
            const float motion_x = READ_AT(MOTION, motion_row, motion_x0, 0) * frame.motion_scale_x;
            const float motion_y = READ_AT(MOTION, motion_row, motion_x0, 1) * frame.motion_scale_y;
            const bool valid = is_finite(motion_x) && is_finite(motion_y) &&
                               motion_x * motion_x + motion_y * motion_y <= longest_squared;
            if (!valid && !frame.reset) atomic_inc(invalid_vectors);
            motion[AT(MOTION, x, y, 0)] = valid ? motion_x + frame.jitter_change_x : NAN;
            motion[AT(MOTION, x, y, 1)] = valid ? motion_y + frame.jitter_change_y : NAN;
#endif
        }
    }
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void ingest(Sizes given, FRAME_PARAMETERS) {
    TAKE(sizes);
    const int x0 = 4 * get_global_id(0), y = ROW_ITEM(1);
    if (x0 >= WIDTH || y >= HEIGHT) return;
    if (x0 + 4 <= WIDTH)
        ingest_pixels(sizes, x0, y, 4, FRAME_PASSED);
    else
        ingest_pixels(sizes, x0, y, WIDTH - x0, FRAME_PASSED);
}
