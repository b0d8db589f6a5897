// The two passes of AMD's FidelityFX Super Resolution 1, by its published description (pipelines/filters/README.md).
//
// Options: IN_*, OUT_* (layouts), STORE_HALF; for easu SCALE, SCALE_REST (s as the sum of two floats), for rcas
// SHARPNESS; for the kernels of strips what they say.

#ifdef SCALE
// Twice the luma.
INLINE float brightness(float4 color) { return 0.5f * color.x + color.y + 0.5f * color.z; }

// What a texel adds to the edge under the pixel: the gradient's direction, and how much it is an edge rather than
// a line of one texel, along each axis between the texel's two neighbours.
INLINE float2 edge_along(float before, float at, float after) {
    const float gradient = after - before;
    const float steepest = fmax(fabs(after - at), fabs(at - before));
    const float share = fmin(fabs(gradient) / fmax(steepest, 1e-20f), 1.0f);
    return (float2)(gradient, share * share);
}

INLINE float3 edge_at(float above, float left, float at, float right, float below) {
    const float2 x = edge_along(left, at, right), y = edge_along(above, at, below);
    return (float3)(x.x, y.x, x.y + y.y);
}

// The kernel: turned along the edge, drawn out along it and narrowed across it, with a negative lobe the smaller the
// stronger the edge.
typedef struct {
    float2 along, across;  // unit vectors times the reciprocals of the kernel's radii
    float lobe, clip;      // the squared distance beyond which the weight is 0
} EdgeKernel;

INLINE EdgeKernel edge_kernel(float3 edge) {
    const float squared = edge.x * edge.x + edge.y * edge.y;
    const float2 direction = squared < 1 / 32768.0f ? (float2)(1, edge.y) : edge.xy * rsqrt(squared);
    const float strength = 0.25f * edge.z * edge.z;
    // Between 1 along an axis and sqrt(2) along a diagonal.
    const float stretch = dot(direction, direction) / fmax(fabs(direction.x), fabs(direction.y));
    EdgeKernel kernel_;
    kernel_.along = direction * (1 + (stretch - 1) * strength);
    kernel_.across = (float2)(-direction.y, direction.x) * (1 - 0.5f * strength);
    kernel_.lobe = 0.5f - 0.29f * strength;
    kernel_.clip = 1 / kernel_.lobe;
    return kernel_;
}

// A Lanczos-2 window without trigonometry: (25/16 (2/5 d² - 1)² - 9/16) (lobe d² - 1)².
INLINE float edge_weight(EdgeKernel kernel_, float2 offset) {
    const float x = dot(offset, kernel_.along), y = dot(offset, kernel_.across);
    const float squared = fmin(x * x + y * y, kernel_.clip);
    const float base = 0.4f * squared - 1, window = kernel_.lobe * squared - 1;
    return (1.5625f * base * base - 0.5625f) * window * window;
}

// EASU: edge-adaptive spatial upsampling from the twelve texels
//     b c
//   e f g h
//   i j k l
//     n o
// around the pixel, which is between f, g, j and k, whose range the result does not leave.
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void easu(Sizes given, global const storage* in,
                                                                      global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const Coordinate u = source_coordinate(x, SCALE, SCALE_REST, frame.jitter_x);
    const Coordinate v = source_coordinate(y, SCALE, SCALE_REST, frame.jitter_y);
#define TEXEL(i, j) \
    LOAD_CHANNELS(IN, in, clamp(u.whole + (i), 0, IN_WIDTH - 1), clamp(v.whole + (j), 0, IN_HEIGHT - 1), 0)
    const float4 b = TEXEL(0, -1), c = TEXEL(1, -1);
    const float4 e = TEXEL(-1, 0), f = TEXEL(0, 0), g = TEXEL(1, 0), h = TEXEL(2, 0);
    const float4 i = TEXEL(-1, 1), j = TEXEL(0, 1), k = TEXEL(1, 1), l = TEXEL(2, 1);
    const float4 n = TEXEL(0, 2), o = TEXEL(1, 2);
#undef TEXEL
    const float lf = brightness(f), lg = brightness(g), lj = brightness(j), lk = brightness(k);
    const float s = u.fraction, t = v.fraction;
    const float3 edge = (1 - s) * (1 - t) * edge_at(brightness(b), brightness(e), lf, lg, lj) +
                        s * (1 - t) * edge_at(brightness(c), lf, lg, brightness(h), lk) +
                        (1 - s) * t * edge_at(lf, brightness(i), lj, lk, brightness(n)) +
                        s * t * edge_at(lg, lj, lk, brightness(l), brightness(o));
    const EdgeKernel edge_kernel_ = edge_kernel(edge);
    float4 sum = 0;
    float weights = 0;
#define ADD(texel, i, j)                                                        \
    do {                                                                        \
        const float weight = edge_weight(edge_kernel_, (float2)((i)-s, (j)-t)); \
        sum += weight * texel;                                                  \
        weights += weight;                                                      \
    } while (0)
    ADD(b, 0, -1);
    ADD(c, 1, -1);
    ADD(e, -1, 0);
    ADD(f, 0, 0);
    ADD(g, 1, 0);
    ADD(h, 2, 0);
    ADD(i, -1, 1);
    ADD(j, 0, 1);
    ADD(k, 1, 1);
    ADD(l, 2, 1);
    ADD(n, 0, 2);
    ADD(o, 1, 2);
#undef ADD
    const float4 least = fmin(fmin(f, g), fmin(j, k)), most = fmax(fmax(f, g), fmax(j, k));
    STORE_CHANNELS(OUT, clamp(sum / weights, least, most), out, x, y, 0);
}

// For devices that make vectors of what a work-item says is one: a strip of 16 × ROWS pixels. Edges are found for each
// texel under it, once, and then interpolated, first between lines. Wants texels of four elements; COLUMNS and LINES
// are the texels under the strip along each axis, all taps included, up to MOST_COLUMNS and MOST_LINES.
#ifdef ROWS
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void easu_strip(Sizes given, global const storage* in,
                                                                            global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x0 = 16 * get_global_id(0), y0 = ROWS * ROW_ITEM(1);
    const int pixels = min(16, OUT_WIDTH - x0), rows = min(ROWS, OUT_HEIGHT - y0);
    const int first_column = source_coordinate(x0, SCALE, SCALE_REST, frame.jitter_x).whole - 1;
    const int first_line = source_coordinate(y0, SCALE, SCALE_REST, frame.jitter_y).whole - 1;
    float4 color[MOST_LINES][MOST_COLUMNS];
    float bright[MOST_LINES][MOST_COLUMNS];
    for (int j = 0; j < LINES; ++j) {
        const int line = AT(IN, 0, clamp(first_line + j, 0, IN_HEIGHT - 1), 0);
        for (int i = 0; i < COLUMNS; ++i) {
            color[j][i] = LOAD4(in, line + IN_STRIDE * clamp(first_column + i, 0, IN_WIDTH - 1));
            bright[j][i] = brightness(color[j][i]);
        }
    }
    float edge_x[MOST_LINES][MOST_COLUMNS], edge_y[MOST_LINES][MOST_COLUMNS], edge[MOST_LINES][MOST_COLUMNS];
    for (int j = 1; j < LINES - 1; ++j) {
        for (int i = 1; i < COLUMNS - 1; ++i) {
            const float3 found =
                edge_at(bright[j - 1][i], bright[j][i - 1], bright[j][i], bright[j][i + 1], bright[j + 1][i]);
            edge_x[j][i] = found.x;
            edge_y[j][i] = found.y;
            edge[j][i] = found.z;
        }
    }
    int place[16];
    float fractions[16];
    for (int i = 0; i < 16; ++i) {
        const Coordinate u = source_coordinate(x0 + i, SCALE, SCALE_REST, frame.jitter_x);
        place[i] = u.whole - first_column;
        fractions[i] = u.fraction;
    }
    const float16 s = vload16(0, fractions);

    for (int row = 0; row < rows; ++row) {
        const Coordinate v = source_coordinate(y0 + row, SCALE, SCALE_REST, frame.jitter_y);
        const int line = v.whole - first_line;
        const float t = v.fraction;
        float4 between[MOST_COLUMNS];
        for (int i = 1; i < COLUMNS - 1; ++i)
            between[i] =
                (float4)(mix(edge_x[line][i], edge_x[line + 1][i], t), mix(edge_y[line][i], edge_y[line + 1][i], t),
                         mix(edge[line][i], edge[line + 1][i], t), 0);
        float along[16], across[16], strengths[16];
        for (int i = 0; i < 16; ++i) {
            const float4 here = mix(between[place[i]], between[place[i] + 1], fractions[i]);
            along[i] = here.x;
            across[i] = here.y;
            strengths[i] = here.z;
        }

        // edge_kernel and edge_weight, of sixteen pixels.
        const float16 x = vload16(0, along), y = vload16(0, across), total = vload16(0, strengths);
        const float16 squared = x * x + y * y;
        const int16 none = squared < 1 / 32768.0f;
        const float16 scale = none ? (float16)(1) : 1 / sqrt(squared);
        const float16 direction_x = none ? (float16)(1) : x * scale, direction_y = y * scale;
        const float16 strength = 0.25f * total * total;
        const float16 stretch =
            (direction_x * direction_x + direction_y * direction_y) / fmax(fabs(direction_x), fabs(direction_y));
        const float16 long_x = direction_x * (1 + (stretch - 1) * strength);
        const float16 long_y = direction_y * (1 + (stretch - 1) * strength);
        const float16 short_x = -direction_y * (1 - 0.5f * strength), short_y = direction_x * (1 - 0.5f * strength);
        const float16 lobe = 0.5f - 0.29f * strength, clip = 1 / lobe;
        float weights[12][16];
        float16 sum = 0;
#define WEIGH(tap, i, j)                                                                                              \
    do {                                                                                                              \
        const float16 offset_x = (i)-s;                                                                               \
        const float offset_y = (j)-t;                                                                                 \
        const float16 u = offset_x * long_x + offset_y * long_y, v = offset_x * short_x + offset_y * short_y;         \
        const float16 distance = fmin(u * u + v * v, clip), base = 0.4f * distance - 1, window = lobe * distance - 1; \
        const float16 weight = (1.5625f * base * base - 0.5625f) * window * window;                                   \
        sum += weight;                                                                                                \
        vstore16(weight, 0, weights[tap]);                                                                            \
    } while (0)
        WEIGH(0, 0, -1);
        WEIGH(1, 1, -1);
        WEIGH(2, -1, 0);
        WEIGH(3, 0, 0);
        WEIGH(4, 1, 0);
        WEIGH(5, 2, 0);
        WEIGH(6, -1, 1);
        WEIGH(7, 0, 1);
        WEIGH(8, 1, 1);
        WEIGH(9, 2, 1);
        WEIGH(10, 0, 2);
        WEIGH(11, 1, 2);
#undef WEIGH
        float shares[16];
        vstore16(1 / sum, 0, shares);
        for (int i = 0; i < pixels; ++i) {
            const float4* above = color[line - 1] + place[i];
            const float4* here = color[line] + place[i];
            const float4* below = color[line + 1] + place[i];
            const float4* last = color[line + 2] + place[i];
            const float4 filtered = (weights[0][i] * above[0] + weights[1][i] * above[1]) +
                                    (weights[2][i] * here[-1] + weights[3][i] * here[0] + weights[4][i] * here[1] +
                                     weights[5][i] * here[2]) +
                                    (weights[6][i] * below[-1] + weights[7][i] * below[0] + weights[8][i] * below[1] +
                                     weights[9][i] * below[2]) +
                                    (weights[10][i] * last[0] + weights[11][i] * last[1]);
            const float4 least = fmin(fmin(here[0], here[1]), fmin(below[0], below[1]));
            const float4 most = fmax(fmax(here[0], here[1]), fmax(below[0], below[1]));
            STORE3(clamp(filtered * shares[i], least, most).xyz, out, AT(OUT, x0 + i, y0 + row, 0));
        }
    }
}
#endif
#endif

#ifdef SHARPNESS
// RCAS: robust contrast-adaptive sharpening. The centre less its four neighbours, as much of them as takes no channel
// out of [0, 1] were all neighbours at their extremes, and never more than LIMIT of each.
#define LIMIT 0.1875f

INLINE float4 lobes(float4 centre, float4 least, float4 most) {
    const float4 to_black = fmin(least, centre) / fmax(4 * most, 1e-20f);
    const float4 to_white = (1 - fmax(most, centre)) / fmax(4 - 4 * least, 1e-20f);
    return fmin(to_black, to_white);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void rcas(Sizes given, global const storage* in,
                                                                      global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const float4 centre = LOAD_CHANNELS(IN, in, x, y, 0);
    const float4 above = LOAD_CHANNELS(IN, in, x, max(y - 1, 0), 0);
    const float4 left = LOAD_CHANNELS(IN, in, max(x - 1, 0), y, 0);
    const float4 right = LOAD_CHANNELS(IN, in, min(x + 1, IN_WIDTH - 1), y, 0);
    const float4 below = LOAD_CHANNELS(IN, in, x, min(y + 1, IN_HEIGHT - 1), 0);
    const float4 each =
        lobes(centre, fmin(fmin(above, below), fmin(left, right)), fmax(fmax(above, below), fmax(left, right)));
    const float lobe = SHARPNESS * fmin(fmin(each.x, fmin(each.y, each.z)), LIMIT);
    const float4 sharpened = (centre - lobe * (above + left + right + below)) / (1 - 4 * lobe);
    STORE_CHANNELS(OUT, clamp(sharpened, 0.0f, 1.0f), out, x, y, 0);
}

// The same for devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels, four at a
// time. Wants pixels of four elements.
#ifdef ROWS
INLINE float16 load_four(const Sizes* sizes, global const storage* in, int line, int x) {
    if (x >= 0 && x + 4 <= IN_WIDTH) return LOAD16(in, line + IN_STRIDE * x);
    const int4 columns = clamp(x + (int4)(0, 1, 2, 3), (int4)(0), (int4)(IN_WIDTH - 1)) * IN_STRIDE + line;
    return (float16)(LOAD4(in, columns.s0), LOAD4(in, columns.s1), LOAD4(in, columns.s2), LOAD4(in, columns.s3));
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void rcas_strip(Sizes given, global const storage* in,
                                                                            global storage* restrict out) {
    TAKE(sizes);
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * ROW_ITEM(1);
    const int end_x = min(x0 + PIXELS, OUT_WIDTH), end_y = min(y0 + ROWS, OUT_HEIGHT);
    for (int y = y0; y < end_y; ++y) {
        const int line = AT(IN, 0, y, 0), line_above = AT(IN, 0, max(y - 1, 0), 0);
        const int line_below = AT(IN, 0, min(y + 1, IN_HEIGHT - 1), 0);
        for (int x = x0; x < end_x; x += 4) {
            const float16 centre = load_four(sizes, in, line, x), left = load_four(sizes, in, line, x - 1);
            const float16 right = load_four(sizes, in, line, x + 1), above = load_four(sizes, in, line_above, x);
            const float16 below = load_four(sizes, in, line_below, x);
            const float16 least = fmin(fmin(above, below), fmin(left, right));
            const float16 most = fmax(fmax(above, below), fmax(left, right));
            // The smaller of two quotients.
            const float16 black = fmin(least, centre), white = 1 - fmax(most, centre);
            const float16 to_black = fmax(4 * most, 1e-20f), to_white = fmax(4 - 4 * least, 1e-20f);
            const int16 is_black = black * to_white < white * to_black;
            const float16 each = (is_black ? black : white) / (is_black ? to_black : to_white);
            const float4 least_each = fmin(fmin(each.s048c, each.s159d), each.s26ae);
            const float4 pixel_lobe = SHARPNESS * fmin(least_each, LIMIT);
            const float16 lobe = pixel_lobe.s0000111122223333;
            const float16 sharpened = (centre - lobe * (above + left + right + below)) / (1 - 4 * lobe);
            float result[16];
            vstore16(clamp(sharpened, 0.0f, 1.0f), 0, result);
            for (int i = 0; i < min(4, end_x - x); ++i) STORE3(vload3(0, result + 4 * i), out, AT(OUT, x + i, y, 0));
        }
    }
}
#endif
#endif
