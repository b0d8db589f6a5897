// reproject(m, d, s) of docs/history.md for any real s: HR motion in HR pixels, NaN where there is no history. All
// images are float.
//
// Options: MOTION_*, DEPTH_*, OUT_* (layouts), SCALE, SCALE_REST (s as the sum of two floats), SHIFT_X, SHIFT_Y (J_m,
// as an expression in `frame`).

#define COUNTED 1e-3f            // the weight along an axis from which on a tap counts
#define SILHOUETTE_DEPTH 0.1f    // of the smallest depth
#define SILHOUETTE_MOTION 0.25f  // render pixels

// The taps of HR column or row x; those that do not count have weight 0.
INLINE Taps counted_taps(int x, float jitter, int size) {
    const Coordinate u = source_coordinate(x, SCALE, SCALE_REST, jitter);
    const int outside = u.whole < 0 || u.whole >= size - 1;
    Taps taps = clamped_taps(clamp(u.whole, 0, size - 1), outside ? 0 : u.fraction, size);
    if (!(taps.first_weight > COUNTED)) taps.first_weight = 0;
    if (!(taps.second_weight > COUNTED)) taps.second_weight = 0;
    return taps;
}

INLINE float2 reprojected(global const float* motion, global const float* depth, Taps tx, Taps ty) {
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

INLINE void store_vector(float2 vector, global float* out, int x, int y) {
#if OUT_BLOCK == 1
    vstore2(vector, 0, out + AT(OUT, x, y, 0));
#else
    out[AT(OUT, x, y, 0)] = vector.x;
    out[AT(OUT, x, y, 1)] = vector.y;
#endif
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void reproject(global const float* motion,
                                                                           global const float* depth, global float* out,
                                                                           Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Taps tx = counted_taps(x, SHIFT_X, MOTION_WIDTH), ty = counted_taps(y, SHIFT_Y, MOTION_HEIGHT);
    store_vector(reprojected(motion, depth, tx, ty), out, x, y);
}

// For devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels. Between four samples
// that are valid and no silhouette, whichever of them count, there is only the mean to be taken; whether that is so is
// found out once for all pixels between them. SPAN is the most samples under a row of the strip.
#ifdef PIXELS
// Columns first … first + SPAN − 1 of a row, clamped to the image.
INLINE void read_row(global const float* motion, global const float* depth, int first, int row, float* along_x,
                     float* along_y, float* distance) {
    for (int i = 0; i < SPAN; ++i) {
        const int column = min(first + i, MOTION_WIDTH - 1);
        along_x[i] = motion[AT(MOTION, column, row, 0)];
        along_y[i] = motion[AT(MOTION, column, row, 1)];
        distance[i] = depth[AT(DEPTH, column, row, 0)];
    }
}

INLINE float least_of(float a, float b) { return a < b ? a : b; }
INLINE float most_of(float a, float b) { return a > b ? a : b; }

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void reproject_strip(global const float* motion,
                                                                                 global const float* depth,
                                                                                 global float* out, Frame frame) {
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * get_global_id(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0), rows = min(ROWS, OUT_HEIGHT - y0);
    Taps across[PIXELS];
    for (int i = 0; i < PIXELS; ++i) across[i] = counted_taps(min(x0 + i, OUT_WIDTH - 1), SHIFT_X, MOTION_WIDTH);
    const int first = across[0].first;
    float x_above[SPAN], y_above[SPAN], depth_above[SPAN], x_below[SPAN], y_below[SPAN], depth_below[SPAN];
    float x_between[SPAN], y_between[SPAN];
    int plain[SPAN];
    int read = -1;  // the row above of those that have been read
    for (int row = 0; row < rows; ++row) {
        const Taps ty = counted_taps(y0 + row, SHIFT_Y, MOTION_HEIGHT);
        if (ty.first != read) {
            read = ty.first;
            read_row(motion, depth, first, ty.first, x_above, y_above, depth_above);
            read_row(motion, depth, first, ty.second, x_below, y_below, depth_below);
            for (int i = 0; i < SPAN - 1; ++i) {
#define SPREAD(above, below)                                                     \
    (most_of(most_of(above[i], above[i + 1]), most_of(below[i], below[i + 1])) - \
     least_of(least_of(above[i], above[i + 1]), least_of(below[i], below[i + 1])))
                const float nearest = least_of(least_of(depth_above[i], depth_above[i + 1]),
                                               least_of(depth_below[i], depth_below[i + 1]));
                // Not a number and not finite where one of them is not.
                const float sum = (x_above[i] - x_above[i]) + (x_above[i + 1] - x_above[i + 1]) +
                                  (x_below[i] - x_below[i]) + (x_below[i + 1] - x_below[i + 1]) +
                                  (y_above[i] - y_above[i]) + (y_above[i + 1] - y_above[i + 1]) +
                                  (y_below[i] - y_below[i]) + (y_below[i + 1] - y_below[i + 1]);
                const int together =
                    SPREAD(x_above, x_below) <= SILHOUETTE_MOTION & SPREAD(y_above, y_below) <= SILHOUETTE_MOTION;
                const int level = SPREAD(depth_above, depth_below) <= SILHOUETTE_DEPTH * nearest;
                plain[i] = is_finite(sum) & (together | level);
            }
        }
        for (int i = 0; i < SPAN; ++i) {
            x_between[i] = (SCALE + SCALE_REST) * (ty.first_weight * x_above[i] + ty.second_weight * x_below[i]);
            y_between[i] = (SCALE + SCALE_REST) * (ty.first_weight * y_above[i] + ty.second_weight * y_below[i]);
        }
        for (int i = 0; i < pixels; ++i) {
            const Taps tx = across[i];
            const int place = tx.first - first;
            const float2 mean = (float2)(tx.first_weight * x_between[place] + tx.second_weight * x_between[place + 1],
                                         tx.first_weight * y_between[place] + tx.second_weight * y_between[place + 1]);
            store_vector(plain[place] ? mean : reprojected(motion, depth, tx, ty), out, x0 + i, y0 + row);
        }
    }
}
#endif
