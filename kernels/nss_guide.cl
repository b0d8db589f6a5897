// NSS, step 1 (docs/nss.md): what a frame's depth and motion say. All images are float.
//
// Options: DEPTH_*, MOTION_*, OUT_* (layouts); one of FAR, SCATTER and GUIDE; of the last BEFORE_* (the scattered
// depth), TOLERANCE and EXPONENT.

#include "nss.clh"

// Calls VISIT(column, row, weight) for the four pixels around index coordinate p.
#define VISIT_CORNERS(p, VISIT)                                        \
    do {                                                               \
        const int left_ = whole_part((p).x), top_ = whole_part((p).y); \
        const float right_ = (p).x - left_, down_ = (p).y - top_;      \
        VISIT(left_, top_, (1 - right_) * (1 - down_));                \
        VISIT(left_ + 1, top_, right_ * (1 - down_));                  \
        VISIT(left_, top_ + 1, (1 - right_) * down_);                  \
        VISIT(left_ + 1, top_ + 1, right_ * down_);                    \
    } while (0)

#ifdef FAR
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void far_depth(Sizes given, global float* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x < OUT_WIDTH && y < OUT_HEIGHT) out[AT(OUT, x, y, 0)] = 1;
}
#endif

#ifdef SCATTER
// Depths are not negative, so that they have the order of their bits as whole numbers.
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void scatter_depth(Sizes given, global const float* depth,
                                                                               global const float* motion,
                                                                               volatile global int* out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT || frame.reset) return;
    const int left = ((2 * x + 1) * DEPTH_WIDTH - OUT_WIDTH) / (2 * OUT_WIDTH);
    const int top = ((2 * y + 1) * DEPTH_HEIGHT - OUT_HEIGHT) / (2 * OUT_HEIGHT);
    int column = left, row = top;
    float nearest = depth[AT(DEPTH, left, top, 0)];
#pragma unroll
    for (int i = 1; i < 4; ++i) {
        const int u = min(left + i % 2, DEPTH_WIDTH - 1), v = min(top + i / 2, DEPTH_HEIGHT - 1);
        const float candidate = depth[AT(DEPTH, u, v, 0)];
        const bool nearer = candidate <= nearest;
        nearest = nearer ? candidate : nearest;
        column = nearer ? u : column;
        row = nearer ? v : row;
    }
    const float2 vector = -(float2)(motion[AT(MOTION, column, row, 0)], motion[AT(MOTION, column, row, 1)]);
    if (!is_valid(vector)) return;
    const float2 share = (float2)((float)OUT_WIDTH / DEPTH_WIDTH, (float)OUT_HEIGHT / DEPTH_HEIGHT);
    const float2 p = (float2)(x, y) - still(vector * share);
#define TAKE(column, row, weight) \
    if ((weight) > 0.1f && INSIDE(OUT, column, row)) atomic_min(out + AT(OUT, column, row, 0), as_int(nearest))
    VISIT_CORNERS(p, TAKE);
}
#endif

#ifdef GUIDE
constant char kColumns[16] = {0, 0, 1, -1, 0, 1, 1, -1, -1, 2, 2, 2, 2, 1, 0, -1};
constant char kRows[16] = {0, 1, 0, 0, -1, -1, 1, -1, 1, -1, 0, 1, 2, 2, 2, 2};

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void guide(Sizes given, global const float* depth,
                                                                       global const float* motion,
                                                                       global const float* before,
                                                                       global float* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    int column = x, row = y;
    float nearest = depth[AT(DEPTH, x, y, 0)];
#pragma unroll
    for (int i = 1; i < 16; ++i) {
        const int u = x + kColumns[i], v = y + kRows[i];
        const float candidate = depth[AT(DEPTH, clamp(u, 0, DEPTH_WIDTH - 1), clamp(v, 0, DEPTH_HEIGHT - 1), 0)];
        const bool nearer = INSIDE(DEPTH, u, v) && candidate < nearest;
        nearest = nearer ? candidate : nearest;
        column = nearer ? u : column;
        row = nearer ? v : row;
    }
    const float2 vector = -(float2)(motion[AT(MOTION, column, row, 0)], motion[AT(MOTION, column, row, 1)]);
    const bool valid = !frame.reset && is_valid(vector);
    float mask = 1;
    if (valid) {
        const float2 share = (float2)((float)BEFORE_WIDTH / DEPTH_WIDTH, (float)BEFORE_HEIGHT / DEPTH_HEIGHT);
        const float2 p = (float2)(x / 2, y / 2) - still(vector) * share;
        float kept = 0, weights = 0;
#define COUNT(column, row, weight)                                                          \
    do {                                                                                    \
        if (!INSIDE(BEFORE, column, row)) {                                                 \
            weights += (weight);                                                            \
        } else if ((weight) > 0.1f) {                                                       \
            const float then = before[AT(BEFORE, column, row, 0)], behind = nearest - then; \
            if (behind > 0) {                                                               \
                const float near = TOLERANCE * nearest / behind;                            \
                kept += (near < 1 ? exp2(EXPONENT * log2(near)) : 1) * (weight);            \
                weights += (weight);                                                        \
            }                                                                               \
        }                                                                                   \
    } while (0)
        VISIT_CORNERS(p, COUNT);
        mask = weights > 0 ? clamp(1 - kept / weights, 0.0f, 1.0f) : 0;
    }
    out[AT(OUT, x, y, 0)] = valid ? vector.x : NAN;
    out[AT(OUT, x, y, 1)] = valid ? vector.y : NAN;
    out[AT(OUT, x, y, 2)] = mask;
}
#endif
