// between(M, I, I') of docs/interpolate.md for any real s: the frame in between, at output resolution.
//
// Options: MIDDLE_* (the result of middle_motion, float), COLOR_*, PREVIOUS_*, OUT_* (layouts), STRIP (pixels
// of a row to a work-item), SCALE, SCALE_REST (s as the sum of two floats), STORE_HALF.

#define SILHOUETTE_DEPTH 0.1f    // of the smallest depth
#define SILHOUETTE_MOTION 0.25f  // render pixels
#define SAME_MOTION 1.0f         // render pixels: vectors that differ by less are one surface's
#define ALIKE 0.1f               // the difference between display values up to which they are one surface's
#define UNLIKE 0.4f              // and that from which on they are not

// A pixel's vector in render pixels, and who shows it: 0 this frame, 1 the previous one.
INLINE float3 middle_at(const Sizes* sizes, global const float* middle, int x, Taps ty) {
    const Taps tx = counted_taps(x, SCALE, SCALE_REST, 0, MIDDLE_WIDTH);
    float4 taps[4];
    float weights[4];
    float4 foremost = 0, low = INFINITY, high = -INFINITY;
    float2 mean = 0;
    float nearest = INFINITY;
#pragma unroll
    for (int i = 0; i < 4; ++i) {
        weights[i] = (i & 1 ? tx.second_weight : tx.first_weight) * (i & 2 ? ty.second_weight : ty.first_weight);
        taps[i] = vload4(0, middle + AT(MIDDLE, i & 1 ? tx.second : tx.first, i & 2 ? ty.second : ty.first, 0));
        if (!(weights[i] > 0)) continue;
        mean += weights[i] * taps[i].xy;
        low = LESSER(low, taps[i]);
        high = GREATER(high, taps[i]);
        if (taps[i].z < nearest) {
            nearest = taps[i].z;
            foremost = taps[i];
        }
    }
    const float apart = GREATER(high.x - low.x, high.y - low.y);
    const int deep = high.z - low.z > SILHOUETTE_DEPTH * low.z;
    const float2 vector = apart > SAME_MOTION || (apart > SILHOUETTE_MOTION && deep) ? foremost.xy : mean;
    float shown_by = 0;
#pragma unroll
    for (int i = 0; i < 4; ++i)
        if (weights[i] > 0 && fabs(taps[i].x - vector.x) < SAME_MOTION && fabs(taps[i].y - vector.y) < SAME_MOTION)
            shown_by = GREATER(shown_by, taps[i].w);
    return (float3)(vector, shown_by);
}

// Whether pixel x + shift along an axis is in the image.
INLINE int is_shown(int x, float shift, int size) { return shift >= -0.5f - x && shift <= size - 0.5f - x; }

// Four pixels of each of four rows, with their weights along both axes.
INLINE float4 filtered(float16 above, float16 upper, float16 lower, float16 below, float4 x, float4 y) {
    const float16 sums = y.x * above + y.y * upper + y.z * lower + y.w * below;
    const float4 sum = x.x * sums.s0123 + x.y * sums.s4567 + x.z * sums.s89ab + x.w * sums.scdef;
    const float8 low = LESSER(upper.s456789ab, lower.s456789ab), high = GREATER(upper.s456789ab, lower.s456789ab);
    return GREATER(LESSER(sum, GREATER(high.lo, high.hi)), LESSER(low.lo, low.hi));
}

// An image of that layout at (column + s, row + t), 0 <= s, t < 1, held within the four pixels around it: where that
// is a pixel, that. Pixels of four elements one after another are read a row at a time where all are inside.
#define DEFINE_FILTERED(name, IMAGE)                                                                                   \
    INLINE float4 name(const Sizes* sizes, global const storage* image, int column, int row, float s, float t) {       \
        if (s == 0 && t == 0)                                                                                          \
            return LOAD_CHANNELS(IMAGE, image, clamp(column, 0, IMAGE##_WIDTH - 1), clamp(row, 0, IMAGE##_HEIGHT - 1), \
                                 0);                                                                                   \
        const float4 x = keys(s), y = keys(t);                                                                         \
        if (IMAGE##_BLOCK == 1 && IMAGE##_STRIDE == 4 && column >= 1 && column + 2 < IMAGE##_WIDTH && row >= 1 &&      \
            row + 2 < IMAGE##_HEIGHT) {                                                                                \
            global const storage* corner = image + AT(IMAGE, column - 1, row - 1, 0);                                  \
            return filtered(LOAD16(corner, 0), LOAD16(corner, IMAGE##_ROW), LOAD16(corner, 2 * IMAGE##_ROW),           \
                            LOAD16(corner, 3 * IMAGE##_ROW), x, y);                                                    \
        }                                                                                                              \
        const int4 columns = clamp(column + (int4)(-1, 0, 1, 2), (int4)(0), (int4)(IMAGE##_WIDTH - 1));                \
        const int4 rows = clamp(row + (int4)(-1, 0, 1, 2), (int4)(0), (int4)(IMAGE##_HEIGHT - 1));                     \
        return filtered(ROW_OF_FOUR(IMAGE, columns, rows.x), ROW_OF_FOUR(IMAGE, columns, rows.y),                      \
                        ROW_OF_FOUR(IMAGE, columns, rows.z), ROW_OF_FOUR(IMAGE, columns, rows.w), x, y);               \
    }
#define ROW_OF_FOUR(IMAGE, columns, row)                                                                      \
    (float16)(LOAD_CHANNELS(IMAGE, image, columns.x, row, 0), LOAD_CHANNELS(IMAGE, image, columns.y, row, 0), \
              LOAD_CHANNELS(IMAGE, image, columns.z, row, 0), LOAD_CHANNELS(IMAGE, image, columns.w, row, 0))

DEFINE_FILTERED(color_at, COLOR)
DEFINE_FILTERED(previous_at, PREVIOUS)

INLINE float4 interpolated(const Sizes* sizes, global const float* middle, global const storage* color,
                           global const storage* previous, int x, int y, Taps ty) {
    const float3 here = middle_at(sizes, middle, x, ty);
    // Half of the way; longer than the image it leaves it all the same, and then fits an int.
    const float dx = clamp(0.5f * (SCALE + SCALE_REST) * here.x, -(float)OUT_WIDTH, (float)OUT_WIDTH);
    const float dy = clamp(0.5f * (SCALE + SCALE_REST) * here.y, -(float)OUT_HEIGHT, (float)OUT_HEIGHT);
    const int x_now = whole_part(-dx), y_now = whole_part(-dy), x_before = whole_part(dx), y_before = whole_part(dy);
    const float4 now = color_at(sizes, color, x + x_now, y + y_now, -dx - x_now, -dy - y_now);
    const float4 before = previous_at(sizes, previous, x + x_before, y + y_before, dx - x_before, dy - y_before);
    const int in_color = is_shown(x, -dx, OUT_WIDTH) && is_shown(y, -dy, OUT_HEIGHT);
    const int in_previous = is_shown(x, dx, OUT_WIDTH) && is_shown(y, dy, OUT_HEIGHT);
    const float4 apart = fabs(now - before);
    const float most = GREATER(apart.x, GREATER(apart.y, apart.z));
    const float unlike = (most - ALIKE) * (1 / (UNLIKE - ALIKE));
    float share = 0.5f + (here.z - 0.5f) * GREATER(LESSER(unlike, 1), 0);
    if (in_color != in_previous) share = in_color ? 0.0f : 1.0f;
    return now + share * (before - now);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void between(Sizes given, global const float* middle,
                                                                         global const storage* color,
                                                                         global const storage* previous,
                                                                         global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int y = ROW_ITEM(1), first = (int)get_global_id(0) * STRIP;
    if (y >= OUT_HEIGHT) return;
    const Taps ty = counted_taps(y, SCALE, SCALE_REST, 0, MIDDLE_HEIGHT);
    for (int x = first; x < min(first + STRIP, OUT_WIDTH); ++x) {
        const float4 result =
            frame.reset ? LOAD_CHANNELS(COLOR, color, x, y, 0) : interpolated(sizes, middle, color, previous, x, y, ty);
        STORE_CHANNELS(OUT, result, out, x, y, 0);
    }
}
