// between(M, I, I') of docs/interpolate.md for any real s: the frame in between, at output resolution.
//
// Options: MIDDLE_* (the result of middle_motion, float), COLOR_*, PREVIOUS_*, OUT_* (layouts), SCALE, SCALE_REST (s as
// the sum of two floats), STORE_HALF.

#define SILHOUETTE_DEPTH 0.1f    // of the smallest depth
#define SILHOUETTE_MOTION 0.25f  // render pixels
#define SAME_MOTION 1.0f         // render pixels: vectors that differ by less are one surface's
#define ALIKE 0.1f               // the difference between display values up to which they are one surface's
#define UNLIKE 0.4f              // and that from which on they are not

// A pixel's vector in render pixels, and who shows it: 0 this frame, 1 the previous one.
INLINE float3 middle_at(global const float* middle, int x, int y) {
    const Taps tx = counted_taps(x, SCALE, SCALE_REST, 0, MIDDLE_WIDTH);
    const Taps ty = counted_taps(y, SCALE, SCALE_REST, 0, MIDDLE_HEIGHT);
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
        low = fmin(low, taps[i]);
        high = fmax(high, taps[i]);
        if (taps[i].z < nearest) {
            nearest = taps[i].z;
            foremost = taps[i];
        }
    }
    const float apart = fmax(high.x - low.x, high.y - low.y);
    const int deep = high.z - low.z > SILHOUETTE_DEPTH * low.z;
    const float2 vector = apart > SAME_MOTION || (apart > SILHOUETTE_MOTION && deep) ? foremost.xy : mean;
    float shown_by = 0;
#pragma unroll
    for (int i = 0; i < 4; ++i)
        if (weights[i] > 0 && fabs(taps[i].x - vector.x) < SAME_MOTION && fabs(taps[i].y - vector.y) < SAME_MOTION)
            shown_by = fmax(shown_by, taps[i].w);
    return (float3)(vector, shown_by);
}

// Whether pixel x + shift along an axis is in the image.
INLINE int is_shown(int x, float shift, int size) { return shift >= -0.5f - x && shift <= size - 0.5f - x; }

// An image at (column + s, row + t), 0 <= s, t < 1, held within the four pixels around it.
#define DEFINE_FILTERED(name, IMAGE)                                                                            \
    INLINE float4 name(global const storage* image, int column, int row, float s, float t) {                    \
        const float4 x = keys(s), y = keys(t);                                                                  \
        const int4 offsets = (int4)(-1, 0, 1, 2);                                                               \
        const int4 columns = clamp(column + offsets, (int4)(0), (int4)(IMAGE##_WIDTH - 1));                     \
        const int4 rows = clamp(row + offsets, (int4)(0), (int4)(IMAGE##_HEIGHT - 1));                          \
        const float4 a = LOAD_CHANNELS(IMAGE, image, columns.y, rows.y, 0);                                     \
        const float4 b = LOAD_CHANNELS(IMAGE, image, columns.z, rows.y, 0);                                     \
        const float4 c = LOAD_CHANNELS(IMAGE, image, columns.y, rows.z, 0);                                     \
        const float4 d = LOAD_CHANNELS(IMAGE, image, columns.z, rows.z, 0);                                     \
        const float4 sum = y.x * ALONG_X(IMAGE, rows.x) + y.w * ALONG_X(IMAGE, rows.w) +                        \
                           y.y * (x.x * LOAD_CHANNELS(IMAGE, image, columns.x, rows.y, 0) + x.y * a + x.z * b + \
                                  x.w * LOAD_CHANNELS(IMAGE, image, columns.w, rows.y, 0)) +                    \
                           y.z * (x.x * LOAD_CHANNELS(IMAGE, image, columns.x, rows.z, 0) + x.y * c + x.z * d + \
                                  x.w * LOAD_CHANNELS(IMAGE, image, columns.w, rows.z, 0));                     \
        return clamp(sum, fmin(fmin(a, b), fmin(c, d)), fmax(fmax(a, b), fmax(c, d)));                          \
    }
#define ALONG_X(IMAGE, row)                                                                                        \
    (x.x * LOAD_CHANNELS(IMAGE, image, columns.x, row, 0) + x.y * LOAD_CHANNELS(IMAGE, image, columns.y, row, 0) + \
     x.z * LOAD_CHANNELS(IMAGE, image, columns.z, row, 0) + x.w * LOAD_CHANNELS(IMAGE, image, columns.w, row, 0))

DEFINE_FILTERED(color_at, COLOR)
DEFINE_FILTERED(previous_at, PREVIOUS)

INLINE float4 interpolated(global const float* middle, global const storage* color, global const storage* previous,
                           int x, int y) {
    const float3 here = middle_at(middle, x, y);
    // Half of the way; longer than the image it leaves it all the same, and then fits an int.
    const float dx = clamp(0.5f * (SCALE + SCALE_REST) * here.x, -(float)OUT_WIDTH, (float)OUT_WIDTH);
    const float dy = clamp(0.5f * (SCALE + SCALE_REST) * here.y, -(float)OUT_HEIGHT, (float)OUT_HEIGHT);
    const int x_now = whole_part(-dx), y_now = whole_part(-dy), x_before = whole_part(dx), y_before = whole_part(dy);
    const float4 now = color_at(color, x + x_now, y + y_now, -dx - x_now, -dy - y_now);
    const float4 before = previous_at(previous, x + x_before, y + y_before, dx - x_before, dy - y_before);
    const int in_color = is_shown(x, -dx, OUT_WIDTH) && is_shown(y, -dy, OUT_HEIGHT);
    const int in_previous = is_shown(x, dx, OUT_WIDTH) && is_shown(y, dy, OUT_HEIGHT);
    const float4 apart = fabs(now - before);
    const float unlike = clamp((fmax(apart.x, fmax(apart.y, apart.z)) - ALIKE) * (1 / (UNLIKE - ALIKE)), 0.0f, 1.0f);
    float share = 0.5f + (here.z - 0.5f) * unlike;
    if (in_color != in_previous) share = in_color ? 0.0f : 1.0f;
    return now + share * (before - now);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void between(global const float* middle,
                                                                         global const storage* color,
                                                                         global const storage* previous,
                                                                         global storage* out, Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const float4 result =
        frame.reset ? LOAD_CHANNELS(COLOR, color, x, y, 0) : interpolated(middle, color, previous, x, y);
    STORE_CHANNELS(OUT, result, out, x, y, 0);
}
