// reproject(m, d, s) of docs/history.md for any real s: HR motion in HR pixels, NaN where there is no history. All
// images are float.
//
// Options: MOTION_*, DEPTH_*, OUT_* (layouts), SCALE, SCALE_REST (s as the sum of two floats), SHIFT_X, SHIFT_Y (J_m,
// as an expression in `frame`).

#define SILHOUETTE_DEPTH 0.1f    // of the smallest depth
#define SILHOUETTE_MOTION 0.25f  // render pixels

INLINE float2 reprojected(const Sizes* sizes, global const float* motion, global const float* depth, Taps tx, Taps ty) {
    float2 mean = 0, low = INFINITY, high = -INFINITY, foremost = NAN, largest = NAN;
    float nearest = INFINITY, farthest = -INFINITY, most = 0;
    int all_valid = 1;
#pragma unroll
    for (int i = 0; i < 4; ++i) {
        const float weight =
            (i & 1 ? tx.second_weight : tx.first_weight) * (i & 2 ? ty.second_weight : ty.first_weight);
        const int x = i & 1 ? tx.second : tx.first, y = i & 2 ? ty.second : ty.first;
        if (!(weight > 0)) continue;
        const float2 vector = (float2)(motion[AT(MOTION, x, y, 0)], motion[AT(MOTION, x, y, 1)]);
        const float distance = depth[AT(DEPTH, x, y, 0)];
        if (is_finite(vector.x) && is_finite(vector.y)) {
            mean += weight * vector;
            low = fmin(low, vector);
            high = fmax(high, vector);
        } else {
            all_valid = 0;
        }
        if (distance < nearest) {
            nearest = distance;
            foremost = vector;
        }
        farthest = fmax(farthest, distance);
        if (weight > most) {
            most = weight;
            largest = vector;
        }
    }
    const int apart = high.x - low.x > SILHOUETTE_MOTION || high.y - low.y > SILHOUETTE_MOTION;
    const int silhouette = apart && farthest - nearest > SILHOUETTE_DEPTH * nearest;
    const float2 vector = silhouette ? foremost : all_valid ? mean : largest;
    return is_finite(vector.x) && is_finite(vector.y) ? (SCALE + SCALE_REST) * vector : (float2)(NAN);
}

INLINE void store_vector(const Sizes* sizes, float2 vector, global float* out, int x, int y) {
#if OUT_BLOCK == 1
    vstore2(vector, 0, out + AT(OUT, x, y, 0));
#else
    out[AT(OUT, x, y, 0)] = vector.x;
    out[AT(OUT, x, y, 1)] = vector.y;
#endif
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void reproject(Sizes given, global const float* motion,
                                                                           global const float* depth,
                                                                           global float* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Taps tx = counted_taps(x, SCALE, SCALE_REST, SHIFT_X, MOTION_WIDTH),
               ty = counted_taps(y, SCALE, SCALE_REST, SHIFT_Y, MOTION_HEIGHT);
    store_vector(sizes, reprojected(sizes, motion, depth, tx, ty), out, x, y);
}

// For devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels. Between four samples
// that are valid and no silhouette, whichever of them count, there is only the mean to be taken; whether that is so is
// found out once for all pixels between them. SPAN samples, up to MOST_SPAN, are under a row of the strip.
#ifdef PIXELS
// SPAN samples of a row from column `first` on, clamped to the image: vectors and depths.
INLINE void read_row(const Sizes* sizes, global const float* motion, global const float* depth, int first, int row,
                     float* vectors, float* depths) {
    for (int i = 0; i < SPAN; ++i) {
        const int column = min(first + i, MOTION_WIDTH - 1);
        vectors[2 * i] = motion[AT(MOTION, column, row, 0)];
        vectors[2 * i + 1] = motion[AT(MOTION, column, row, 1)];
        depths[i] = depth[AT(DEPTH, column, row, 0)];
    }
}

INLINE float least_of(float a, float b) { return a < b ? a : b; }
INLINE float most_of(float a, float b) { return a > b ? a : b; }

// Of element i and its right neighbour, `step` elements on, in two rows.
#define LEAST_OF_FOUR(above, below, i, step) \
    least_of(least_of(above[i], above[(i) + (step)]), least_of(below[i], below[(i) + (step)]))
#define MOST_OF_FOUR(above, below, i, step) \
    most_of(most_of(above[i], above[(i) + (step)]), most_of(below[i], below[(i) + (step)]))
// 0, but not a number where one of them is not finite.
#define FINITE_OF_FOUR(above, below, i, step)                                                      \
    ((above[i] - above[i]) + (above[(i) + (step)] - above[(i) + (step)]) + (below[i] - below[i]) + \
     (below[(i) + (step)] - below[(i) + (step)]))

// Whether only the mean is to be taken between each sample of two rows and the one to its right, and whether it is so
// everywhere.
INLINE int find_plain(const Sizes* sizes, const float* above, const float* below, const float* depths_above,
                      const float* depths_below, int* plain) {
    int all = 1;
    for (int i = 0; i < SPAN - 1; ++i) {
        const float nearest = LEAST_OF_FOUR(depths_above, depths_below, i, 1);
        const float farthest = MOST_OF_FOUR(depths_above, depths_below, i, 1);
        const float apart_x = MOST_OF_FOUR(above, below, 2 * i, 2) - LEAST_OF_FOUR(above, below, 2 * i, 2);
        const float apart_y = MOST_OF_FOUR(above, below, 2 * i + 1, 2) - LEAST_OF_FOUR(above, below, 2 * i + 1, 2);
        const float finite = FINITE_OF_FOUR(above, below, 2 * i, 2) + FINITE_OF_FOUR(above, below, 2 * i + 1, 2);
        const int together = (apart_x <= SILHOUETTE_MOTION) & (apart_y <= SILHOUETTE_MOTION);
        plain[i] = (finite == 0) & (together | (farthest - nearest <= SILHOUETTE_DEPTH * nearest));
        all &= plain[i];
    }
    return all;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void reproject_strip(
    Sizes given, global const float* motion, global const float* depth, global float* restrict out, Frame frame) {
    TAKE(sizes);
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * ROW_ITEM(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0), rows = min(ROWS, OUT_HEIGHT - y0);
    const int first = counted_taps(x0, SCALE, SCALE_REST, SHIFT_X, MOTION_WIDTH).first;
    int place[PIXELS];
    float4 weights[PIXELS];
    for (int i = 0; i < pixels; ++i) {
        const Taps tx = counted_taps(x0 + i, SCALE, SCALE_REST, SHIFT_X, MOTION_WIDTH);
        place[i] = tx.first - first;
        weights[i] = (float4)(tx.first_weight, tx.first_weight, tx.second_weight, tx.second_weight);
    }
    float above[2 * MOST_SPAN], below[2 * MOST_SPAN], between[2 * MOST_SPAN];
    float depths_above[MOST_SPAN], depths_below[MOST_SPAN];
    int plain[MOST_SPAN], all_plain = 0;
    int row_above = -1, row_below = -1;  // that have been read
    for (int row = 0; row < rows; ++row) {
        const Taps ty = counted_taps(y0 + row, SCALE, SCALE_REST, SHIFT_Y, MOTION_HEIGHT);
        if (ty.first != row_above) {
            if (ty.first == row_below) {
                for (int i = 0; i < 2 * SPAN; ++i) above[i] = below[i];
                for (int i = 0; i < SPAN; ++i) depths_above[i] = depths_below[i];
            } else {
                read_row(sizes, motion, depth, first, ty.first, above, depths_above);
            }
            read_row(sizes, motion, depth, first, ty.second, below, depths_below);
            row_above = ty.first;
            row_below = ty.second;
            all_plain = find_plain(sizes, above, below, depths_above, depths_below, plain);
        }
        const float weight_above = (SCALE + SCALE_REST) * ty.first_weight;
        const float weight_below = (SCALE + SCALE_REST) * ty.second_weight;
        for (int i = 0; i < 2 * SPAN; ++i) between[i] = weight_above * above[i] + weight_below * below[i];
        for (int i = 0; i < pixels; ++i) {
            const float4 weighted = weights[i] * vload4(0, between + 2 * place[i]);
            float2 vector = weighted.lo + weighted.hi;
            if (!all_plain && !plain[place[i]])
                vector = reprojected(sizes, motion, depth,
                                     counted_taps(x0 + i, SCALE, SCALE_REST, SHIFT_X, MOTION_WIDTH), ty);
            store_vector(sizes, vector, out, x0 + i, y0 + row);
        }
    }
}
#endif
