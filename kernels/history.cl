// depth_before(m, d), previous_depth(m, d), checked_motion(m, d, P) and validity(m) of docs/history.md, and
// landed_depth(m, d) and landed_source(m, d, L) of docs/interpolate.md, a work-item for each render pixel. All images
// are float, but that validity is stored as images are.
//
// Options: MOTION_*, OUT_* (layouts), STORE_HALF, and what to make: DEPTH_BEFORE (with DEPTH_*), PREVIOUS_DEPTH (with
// DEPTH_* and SHARE, of the way to the previous frame; OUT holds ones before), LANDED_SOURCE (with DEPTH_*, LANDED_*
// and SHARE; OUT holds a number beyond all pixels' before), CHECKED_MOTION (with DEPTH_*, PREVIOUS_*) or VALIDITY.

#define REACHED 0.1f               // the bilinear weight from which on a pixel's depth is that of a neighbour too
#define NEARER 0.02f               // of the depth: what is nearer by less hides nothing
#define DEPTH_STEP 1.52587891e-5f  // 2^-16

// Where a pixel was in the previous frame, along one axis: x + shift as a whole part and a fraction. Rounding errors
// are those of the shift, however far x is from the origin.
INLINE Coordinate moved(int x, float shift) {
    const int whole = whole_part(shift);
    const Coordinate result = {x + whole, shift - whole};
    return result;
}

#ifdef DEPTH_BEFORE
#define LEAST_AREA 0.25f
#define MOST_AREA 4.0f

// Of what is from LEAST_AREA to MOST_AREA, by Newton's method from 1 on: unlike cbrt, compilers make vectors of it.
INLINE float cube_root(float area) {
    float root = (2 + area) / 3;
    for (int i = 0; i < 4; ++i) root = (2 * root + area / (root * root)) / 3;
    return root;
}

// How the vector changes from one pixel to the next: from the neighbour before or to the one after, whichever is less,
// for across an edge it is more.
INLINE float2 change(float2 before, float2 here, float2 after) {
    const float2 from = here - before, to = after - here;
    const float from_size = fabs(from.x) + fabs(from.y), to_size = fabs(to.x) + fabs(to.y);
    return to_size < from_size || isnan(from_size) ? to : from;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void depth_before(Sizes given, global const float* motion,
                                                                              global const float* depth,
                                                                              global float* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
#define MOTION_AT(x, y) (float2)(motion[AT(MOTION, x, y, 0)], motion[AT(MOTION, x, y, 1)])
    const float2 here = MOTION_AT(x, y), none = NAN;
    const float2 left = x > 0 ? MOTION_AT(x - 1, y) : none, right = x + 1 < OUT_WIDTH ? MOTION_AT(x + 1, y) : none;
    const float2 above = y > 0 ? MOTION_AT(x, y - 1) : none, below = y + 1 < OUT_HEIGHT ? MOTION_AT(x, y + 1) : none;
    const float2 across = change(left, here, right), down = change(above, here, below);
    const float xx = across.x, yx = across.y, xy = down.x, yy = down.y;
    float area = (1 + xx) * (1 + yy) - xy * yx;
    area = is_finite(area) ? fmin(fmax(area, LEAST_AREA), MOST_AREA) : 1;
    out[AT(OUT, x, y, 0)] = fmin(depth[AT(DEPTH, x, y, 0)] / cube_root(area), 1.0f);
}
#endif

#ifdef SHARE
// Where pixel (x, y) is at SHARE of its way to the previous frame, and whether that can be inside the image: an invalid
// vector is not a number, and so not inside; neither is one too long for an int.
INLINE int lands(const Sizes* sizes, global const float* motion, int x, int y, Frame frame, Coordinate* u,
                 Coordinate* v) {
    const float shift_x = frame.jitter_x + SHARE * motion[AT(MOTION, x, y, 0)];
    const float shift_y = frame.jitter_y + SHARE * motion[AT(MOTION, x, y, 1)];
    if (!(shift_x >= -1.0f - x && shift_x < OUT_WIDTH - x && shift_y >= -1.0f - y && shift_y < OUT_HEIGHT - y))
        return 0;
    *u = moved(x, shift_x);
    *v = moved(y, shift_y);
    return 1;
}

// Depths are not negative, so that their bits are ordered as they are.
INLINE int ordered_bits(float depth) { return max(as_int(depth), 0); }  // of −0 too
#endif

#ifdef PREVIOUS_DEPTH
// The least does not depend on who comes first.
INLINE void reach(const Sizes* sizes, volatile global int* out, int x, int y, float weight, int depth) {
    if (weight > REACHED && INSIDE(OUT, x, y)) atomic_min(out + AT(OUT, x, y, 0), depth);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void previous_depth(Sizes given, global const float* motion,
                                                                                global const float* depth,
                                                                                volatile global int* out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    Coordinate u, v;
    if (!lands(sizes, motion, x, y, frame, &u, &v)) return;
    const int bits = ordered_bits(depth[AT(DEPTH, x, y, 0)]);
    reach(sizes, out, u.whole, v.whole, (1 - u.fraction) * (1 - v.fraction), bits);
    reach(sizes, out, u.whole + 1, v.whole, u.fraction * (1 - v.fraction), bits);
    reach(sizes, out, u.whole, v.whole + 1, (1 - u.fraction) * v.fraction, bits);
    reach(sizes, out, u.whole + 1, v.whole + 1, u.fraction * v.fraction, bits);
}
#endif

#ifdef LANDED_SOURCE
// Numbers of pixels are whole and not negative: as floats they are ordered as their bits are.
INLINE void claim(const Sizes* sizes, global const int* landed, volatile global int* out, int x, int y, float weight,
                  int depth, int number) {
    if (weight > REACHED && INSIDE(OUT, x, y) && landed[AT(LANDED, x, y, 0)] == depth)
        atomic_min(out + AT(OUT, x, y, 0), number);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void landed_source(Sizes given, global const float* motion,
                                                                               global const float* depth,
                                                                               global const int* landed,
                                                                               volatile global int* out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    Coordinate u, v;
    if (!lands(sizes, motion, x, y, frame, &u, &v)) return;
    const int bits = ordered_bits(depth[AT(DEPTH, x, y, 0)]), number = as_int((float)(y * OUT_WIDTH + x));
    claim(sizes, landed, out, u.whole, v.whole, (1 - u.fraction) * (1 - v.fraction), bits, number);
    claim(sizes, landed, out, u.whole + 1, v.whole, u.fraction * (1 - v.fraction), bits, number);
    claim(sizes, landed, out, u.whole, v.whole + 1, (1 - u.fraction) * v.fraction, bits, number);
    claim(sizes, landed, out, u.whole + 1, v.whole + 1, u.fraction * v.fraction, bits, number);
}
#endif

#ifdef CHECKED_MOTION
#define DEPTH_AT(x, y) depth[AT(DEPTH, x, y, 0)]
#define ALONG 0.25f  // render pixels by which vectors differ that still move along

#define NEAR 2  // pixels around one that may be of its surface, where vectors draw it together

// Depths of the pixel's neighbours that move along with it; −1 of the others.
INLINE void find_companions(const Sizes* sizes, global const float* motion, global const float* depth, int x, int y,
                            float* companions) {
    const float motion_x = motion[AT(MOTION, x, y, 0)], motion_y = motion[AT(MOTION, x, y, 1)];
    for (int i = 0; i < 9; ++i) {
        const int column = x + i % 3 - 1, row = y + i / 3 - 1;
        companions[i] = -1;
        if (!INSIDE(MOTION, column, row)) continue;
        const float apart_x = fabs(motion[AT(MOTION, column, row, 0)] - motion_x);
        const float apart_y = fabs(motion[AT(MOTION, column, row, 1)] - motion_y);
        if (apart_x <= ALONG && apart_y <= ALONG) companions[i] = DEPTH_AT(column, row);
    }
}

INLINE int is_companion(float depth, const float* companions) {
    int found = 0;
    for (int i = 0; i < 9; ++i) found |= companions[i] == depth;
    return found;
}

// Whether one of the 5×5 pixels around (x, y) has that depth and was less than a pixel from (u, v).
INLINE int is_from_near(const Sizes* sizes, global const float* motion, global const float* depth, int x, int y, int u,
                        int v, float before, Frame frame) {
    int found = 0;
    for (int row = max(y - NEAR, 0); row <= min(y + NEAR, DEPTH_HEIGHT - 1); ++row)
        for (int column = max(x - NEAR, 0); column <= min(x + NEAR, DEPTH_WIDTH - 1); ++column) {
            const float off_x = column - u + (frame.jitter_x + motion[AT(MOTION, column, row, 0)]);
            const float off_y = row - v + (frame.jitter_y + motion[AT(MOTION, column, row, 1)]);
            found |= DEPTH_AT(column, row) == before && fabs(off_x) < 1 && fabs(off_y) < 1;
        }
    return found;
}

// The smaller difference to the neighbours along an axis; at the image's border to the one that there is.
INLINE float slope(float before, float here, float after, int has_before, int has_after) {
    const float to_before = fabs(here - before), to_after = fabs(here - after);
    return has_before && has_after ? (to_before < to_after ? to_before : to_after) : has_before ? to_before : to_after;
}

INLINE int was_seen(const Sizes* sizes, global const float* motion, global const float* depth,
                    global const float* previous, int x, int y, Frame frame) {
    const float shift_x = frame.jitter_x + motion[AT(MOTION, x, y, 0)];
    const float shift_y = frame.jitter_y + motion[AT(MOTION, x, y, 1)];
    // An invalid vector is not a number, and so not on screen.
    if (!(shift_x >= -0.5f - x && shift_x <= DEPTH_WIDTH - 0.5f - x && shift_y >= -0.5f - y &&
          shift_y <= DEPTH_HEIGHT - 0.5f - y))
        return 0;
    const float here = DEPTH_AT(x, y);
    const float slopes =
        slope(DEPTH_AT(max(x - 1, 0), y), here, DEPTH_AT(min(x + 1, DEPTH_WIDTH - 1), y), x > 0, x < DEPTH_WIDTH - 1) +
        slope(DEPTH_AT(x, max(y - 1, 0)), here, DEPTH_AT(x, min(y + 1, DEPTH_HEIGHT - 1)), y > 0, y < DEPTH_HEIGHT - 1);
    const float least = here - (NEARER * here + 2 * slopes + DEPTH_STEP);
    const Coordinate u = moved(x, shift_x), v = moved(y, shift_y);
    float seen = 0, hidden = 0, companions[9];
    find_companions(sizes, motion, depth, x, y, companions);
    for (int i = 0; i < 4; ++i) {
        const int column = u.whole + i % 2, row = v.whole + i / 2;
        if (!INSIDE(PREVIOUS, column, row)) continue;
        const float weight = (i % 2 ? u.fraction : 1 - u.fraction) * (i / 2 ? v.fraction : 1 - v.fraction);
        seen += weight;
        const float before = previous[AT(PREVIOUS, column, row, 0)];
        if (before >= here || is_companion(before, companions)) continue;
        if (before < least || !is_from_near(sizes, motion, depth, x, y, column, row, before, frame)) hidden += weight;
    }
    return hidden <= 0.5f * seen;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void checked_motion(Sizes given, global const float* motion,
                                                                                global const float* depth,
                                                                                global const float* previous,
                                                                                global float* restrict out,
                                                                                Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int seen = was_seen(sizes, motion, depth, previous, x, y, frame);
    out[AT(OUT, x, y, 0)] = seen ? motion[AT(MOTION, x, y, 0)] : NAN;
    out[AT(OUT, x, y, 1)] = seen ? motion[AT(MOTION, x, y, 1)] : NAN;
}
#endif

#ifdef VALIDITY
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void validity(Sizes given, global const float* motion,
                                                                          global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int valid = !frame.reset && is_finite(motion[AT(MOTION, x, y, 0)]) && is_finite(motion[AT(MOTION, x, y, 1)]);
    STORE(valid ? 1.0f : 0.0f, out, AT(OUT, x, y, 0));
}
#endif
