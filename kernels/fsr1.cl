// The two passes of AMD's FidelityFX Super Resolution 1, by its published description (pipelines/filters/README.md).
//
// Options: IN_*, OUT_* (layouts), STORE_HALF; for easu SCALE, SCALE_REST (s as the sum of two floats), for rcas
// SHARPNESS; for the kernels of strips what they say.

#ifdef ROWS
#include "planes.clh"
#endif

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

// For devices that make vectors of what a work-item says is one: all pixels between CELLS texels and the next ones, of
// ROWS lines of texels. Sixteen cells side by side are a vector for each pixel that they have; what is found of texels
// is found once. Wants texels of four elements.
#ifdef ROWS
#define CELLS 64
#define COLUMNS (CELLS + 16)  // that are read: the first is before the first cell, the last two after the last

// Along an axis, the first of the pixels that are between this texel and the next one, or beyond.
INLINE int first_of_cell(const Sizes* sizes, int texel, float jitter, int pixels) {
    int x = (int)clamp((texel + 0.5f + jitter) * SCALE - 0.5f, 0.0f, (float)pixels);
    while (x > 0 && source_coordinate(x - 1, SCALE, SCALE_REST, jitter).whole >= texel) --x;
    while (x < pixels && source_coordinate(x, SCALE, SCALE_REST, jitter).whole < texel) ++x;
    return x;
}

// Of cells side by side: the first pixel of each, how many it has, and how far the first is beyond the texel; the most
// that one has, and whether all of sixteen have two, as at ×2.
typedef struct {
    int first[CELLS], count[CELLS], most, have_two[CELLS / 16];
    float fraction[CELLS];
} Cells;

INLINE Cells find_cells(const Sizes* sizes, int texel, float jitter) {
    Cells cells;
    cells.most = 0;
    int x = first_of_cell(sizes, texel, jitter, OUT_WIDTH);
    for (int i = 0; i < CELLS; ++i) {
        cells.first[i] = x;
        Coordinate u = source_coordinate(x, SCALE, SCALE_REST, jitter);
        cells.fraction[i] = u.fraction;
        while (x < OUT_WIDTH && u.whole <= texel + i) u = source_coordinate(++x, SCALE, SCALE_REST, jitter);
        cells.count[i] = x - cells.first[i];
        cells.most = max(cells.most, cells.count[i]);
        cells.have_two[i / 16] = cells.count[i] == 2 && (i % 16 == 0 || cells.have_two[i / 16]);
    }
    return cells;
}

// Lines of texels, line y in the place of y % 4, and the edges of two of them, in that of y % 2.
typedef struct {
    float color[4][3][COLUMNS], brightness[4][COLUMNS];
    float edge_x[2][COLUMNS], edge_y[2][COLUMNS], edge[2][COLUMNS];
} Lines;

INLINE void read_line(const Sizes* sizes, global const storage* in, int first_column, int y, Lines* lines) {
    stage_planes(in + AT(IN, 0, clamp(y, 0, IN_HEIGHT - 1), 0), IN_STRIDE, IN_WIDTH, first_column, COLUMNS,
                 lines->color[y & 3][0], COLUMNS);
    for (int i = 0; i < COLUMNS; i += 16) {
        float(*color)[COLUMNS] = lines->color[y & 3];
        const float16 twice =
            0.5f * vload16(0, color[0] + i) + vload16(0, color[1] + i) + 0.5f * vload16(0, color[2] + i);
        vstore16(twice, 0, lines->brightness[y & 3] + i);
    }
}

INLINE float16 share_of_steepest(float16 before, float16 at, float16 after, float16 gradient) {
    const float16 to_after = fabs(after - at), to_before = fabs(at - before);
    const float16 steepest = GREATER(to_after, to_before), most = GREATER(steepest, (float16)(1e-20f));
    const float16 share = fabs(gradient) / most, limited = LESSER(share, (float16)(1));
    return limited * limited;
}

// edge_at of the texels that cells begin or end with.
INLINE void find_edges(int y, Lines* lines) {
    const float* above = lines->brightness[(y - 1) & 3];
    const float* here = lines->brightness[y & 3];
    const float* below = lines->brightness[(y + 1) & 3];
    for (int vector = 0; vector <= CELLS / 16; ++vector) {
        const int i = min(1 + 16 * vector, CELLS - 14);
        const float16 left = vload16(0, here + i - 1), at = vload16(0, here + i), right = vload16(0, here + i + 1);
        const float16 up = vload16(0, above + i), down = vload16(0, below + i);
        const float16 x = right - left, y_ = down - up;
        vstore16(x, 0, lines->edge_x[y & 1] + i);
        vstore16(y_, 0, lines->edge_y[y & 1] + i);
        vstore16(share_of_steepest(left, at, right, x) + share_of_steepest(up, at, down, y_), 0,
                 lines->edge[y & 1] + i);
    }
}

// Between a texel and those to its right, below, and there.
INLINE float16 between(float (*edge)[COLUMNS], int y, int i, float16 s, float t) {
    const float16 above = mix(vload16(0, edge[y & 1] + i), vload16(0, edge[y & 1] + i + 1), s);
    const float16 below = mix(vload16(0, edge[(y + 1) & 1] + i), vload16(0, edge[(y + 1) & 1] + i + 1), s);
    return mix(above, below, (float16)(t));
}

// easu for sixteen cells, the first texel in column i: three planes.
INLINE void filter_cells(Lines* lines, int y, int i, float16 s, float t, float16* result) {
    const float16 edge_x = between(lines->edge_x, y, i, s, t), edge_y = between(lines->edge_y, y, i, s, t);
    const float16 edge = between(lines->edge, y, i, s, t);
    // edge_kernel
    const float16 squared = edge_x * edge_x + edge_y * edge_y;
    const int16 none = squared < 1 / 32768.0f;
    const float16 scale = none ? (float16)(1) : 1 / sqrt(squared);
    const float16 direction_x = none ? (float16)(1) : edge_x * scale, direction_y = edge_y * scale;
    const float16 strength = 0.25f * edge * edge;
    const float16 size_x = fabs(direction_x), size_y = fabs(direction_y);
    const float16 stretch = (direction_x * direction_x + direction_y * direction_y) / GREATER(size_x, size_y);
    const float16 along = 1 + (stretch - 1) * strength, across = 1 - 0.5f * strength;
    const float16 along_x = direction_x * along, along_y = direction_y * along;
    const float16 across_x = -direction_y * across, across_y = direction_x * across;
    const float16 lobe = 0.5f - 0.29f * strength, clip = 1 / lobe;
    // edge_weight of all taps, columns before and after added up apart.
    const float16 first_along = -s * along_x - t * along_y, first_across = -s * across_x - t * across_y;
    float16 red = 0, green = 0, blue = 0, weights = 0;
#define ADD(column, line)                                                           \
    do {                                                                            \
        const float16 x = first_along + (column)*along_x + (line)*along_y;          \
        const float16 y_ = first_across + (column)*across_x + (line)*across_y;      \
        const float16 distance = x * x + y_ * y_, d = LESSER(distance, clip);       \
        const float16 base = 0.4f * d - 1, window = lobe * d - 1;                   \
        const float16 weight = (1.5625f * base * base - 0.5625f) * window * window; \
        float(*color)[COLUMNS] = lines->color[(y + (line)) & 3];                    \
        red += weight * vload16(0, color[0] + i + (column));                        \
        green += weight * vload16(0, color[1] + i + (column));                      \
        blue += weight * vload16(0, color[2] + i + (column));                       \
        weights += weight;                                                          \
    } while (0)
    ADD(0, -1);
    ADD(1, -1);
    ADD(-1, 0);
    ADD(0, 0);
    ADD(1, 0);
    ADD(2, 0);
    ADD(-1, 1);
    ADD(0, 1);
    ADD(1, 1);
    ADD(2, 1);
    ADD(0, 2);
    ADD(1, 2);
#undef ADD
    const float16 share = 1 / weights;
    result[0] = red * share;
    result[1] = green * share;
    result[2] = blue * share;
#pragma unroll
    for (int c = 0; c < 3; ++c) {
        const float* here = lines->color[y & 3][c] + i;
        const float* below = lines->color[(y + 1) & 3][c] + i;
        const float16 f = vload16(0, here), g = vload16(0, here + 1), j = vload16(0, below), k = vload16(0, below + 1);
        const float16 least_above = LESSER(f, g), least_below = LESSER(j, k), least = LESSER(least_above, least_below);
        const float16 most_above = GREATER(f, g), most_below = GREATER(j, k), most = GREATER(most_above, most_below);
        const float16 raised = GREATER(result[c], least);
        result[c] = LESSER(raised, most);
    }
}

// Each cell's pixel of that number, of sixteen cells.
INLINE void scatter_pixels(const float16* planes, const Cells* cells, int first, int pixel, global storage* row) {
    float16 pixels[4];
    float made[64];
    join_planes(planes, pixels);
#pragma unroll
    for (int i = 0; i < 4; ++i) vstore16(pixels[i], i, made);
#pragma unroll
    for (int i = 0; i < 16; ++i)
        if (pixel < cells->count[first + i])
            store_three(vload4(i, made), row + OUT_STRIDE * (cells->first[first + i] + pixel));
}

INLINE void easu_row(const Sizes* sizes, Lines* lines, const Cells* cells, int line, float t, global storage* row) {
    for (int first = 0; first < CELLS && cells->first[first] < OUT_WIDTH; first += 16) {
        const float16 s = vload16(0, cells->fraction + first);
        if (cells->have_two[first / 16]) {
            // The pixels of all of them follow each other.
            float16 even[3], odd[3], left[3], right[3];
            filter_cells(lines, line, 1 + first, s, t, even);
            filter_cells(lines, line, 1 + first, s + 1 / SCALE, t, odd);
#pragma unroll
            for (int c = 0; c < 3; ++c) {
                const float16 a = even[c], b = odd[c];
                left[c] = (float16)(a.s0, b.s0, a.s1, b.s1, a.s2, b.s2, a.s3, b.s3,  //
                                    a.s4, b.s4, a.s5, b.s5, a.s6, b.s6, a.s7, b.s7);
                right[c] = (float16)(a.s8, b.s8, a.s9, b.s9, a.sa, b.sa, a.sb, b.sb,  //
                                     a.sc, b.sc, a.sd, b.sd, a.se, b.se, a.sf, b.sf);
            }
            global storage* pixel = row + OUT_STRIDE * cells->first[first];
            store_planes(left, 16, pixel, OUT_STRIDE);
            store_planes(right, 16, pixel + 16 * OUT_STRIDE, OUT_STRIDE);
            continue;
        }
        for (int pixel = 0; pixel < cells->most; ++pixel) {
            float16 planes[3];
            filter_cells(lines, line, 1 + first, s + pixel * (1 / SCALE), t, planes);
            scatter_pixels(planes, cells, first, pixel, row);
        }
    }
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void easu_cells(Sizes given, global const storage* in,
                                                                            global storage* restrict out, Frame frame) {
    TAKE(sizes);
    // Pixels' own coordinates begin before the first texel, if not on it.
    const int column = source_coordinate(0, SCALE, SCALE_REST, frame.jitter_x).whole + CELLS * (int)get_global_id(0);
    const int line = source_coordinate(0, SCALE, SCALE_REST, frame.jitter_y).whole + ROWS * ROW_ITEM(1);
    const Cells cells = find_cells(sizes, column, frame.jitter_x);
    int y = first_of_cell(sizes, line, frame.jitter_y, OUT_HEIGHT);
    if (cells.most == 0 || y >= OUT_HEIGHT) return;
    Lines lines;
    for (int i = -1; i < 2; ++i) read_line(sizes, in, column - 1, line + i, &lines);
    find_edges(line, &lines);
    for (int i = line; i < line + ROWS && y < OUT_HEIGHT; ++i) {
        read_line(sizes, in, column - 1, i + 2, &lines);
        find_edges(i + 1, &lines);
        prefetch_row(in + AT(IN, clamp(column, 0, IN_WIDTH - 1), clamp(i + 3, 0, IN_HEIGHT - 1), 0), CELLS * IN_STRIDE);
        for (; y < OUT_HEIGHT; ++y) {
            const Coordinate v = source_coordinate(y, SCALE, SCALE_REST, frame.jitter_y);
            if (v.whole > i) break;
            easu_row(sizes, &lines, &cells, i, v.fraction, out + AT(OUT, 0, y, 0));
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

// The same for devices that make vectors of what a work-item says is one: a strip of PIXELS × ROWS pixels, in planes,
// sixteen of them at a time. Wants pixels of four elements.
#ifdef ROWS
#define COLUMNS (PIXELS + 32)  // that are read: sixteen before the first pixel, so that vectors are aligned

INLINE void read_line(const Sizes* sizes, global const storage* in, int x, int y, float (*planes)[3][COLUMNS]) {
    stage_planes(in + AT(IN, 0, clamp(y, 0, IN_HEIGHT - 1), 0), IN_STRIDE, IN_WIDTH, x - 16, COLUMNS,
                 planes[(y + 3) % 3][0], COLUMNS);
}

// A quotient of which nothing but its order among others is asked for until the smallest is found: divisions take long.
typedef struct {
    float16 dividend, divisor;  // not negative
} Quotient;

INLINE Quotient smaller_quotient(Quotient a, Quotient b) {
    const int16 is_first = a.dividend * b.divisor < b.dividend * a.divisor;
    const Quotient smaller = {is_first ? a.dividend : b.dividend, is_first ? a.divisor : b.divisor};
    return smaller;
}

// The sum of a plane's four neighbours, and the smaller of the quotients that are `lobes`.
INLINE Quotient sharpen_plane(const float* above, const float* here, const float* below, float16* sum) {
    const float16 centre = vload16(0, here), left = vload16(0, here - 1), right = vload16(0, here + 1);
    const float16 up = vload16(0, above), down = vload16(0, below);
    const float16 least_y = LESSER(up, down), least_x = LESSER(left, right), least = LESSER(least_y, least_x);
    const float16 most_y = GREATER(up, down), most_x = GREATER(left, right), most = GREATER(most_y, most_x);
    const float16 brightest = GREATER(most, centre), of_black = 4 * most, of_white = 4 - 4 * least;
    const Quotient black = {LESSER(least, centre), GREATER(of_black, (float16)(1e-20f))};
    const Quotient white = {1 - brightest, GREATER(of_white, (float16)(1e-20f))};
    *sum = up + left + right + down;
    return smaller_quotient(black, white);
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void rcas_strip(Sizes given, global const storage* in,
                                                                            global storage* restrict out) {
    TAKE(sizes);
    const int x0 = PIXELS * get_global_id(0), y0 = ROWS * ROW_ITEM(1);
    const int pixels = min(PIXELS, OUT_WIDTH - x0), end = min(y0 + ROWS, OUT_HEIGHT);
    float lines[3][3][COLUMNS];
    read_line(sizes, in, x0, y0 - 1, lines);
    read_line(sizes, in, x0, y0, lines);
    for (int y = y0; y < end; ++y) {
        read_line(sizes, in, x0, y + 1, lines);
        prefetch_row(in + AT(IN, x0, min(y + 2, IN_HEIGHT - 1), 0), PIXELS * IN_STRIDE);
        float(*above)[COLUMNS] = lines[(y + 2) % 3];
        float(*here)[COLUMNS] = lines[y % 3];
        float(*below)[COLUMNS] = lines[(y + 1) % 3];
        for (int x = 0; x < pixels; x += 16) {
            float16 sums[3], planes[3];
            Quotient each = {LIMIT, 1};
#pragma unroll
            for (int c = 0; c < 3; ++c) {
                const int i = 16 + x;
                each = smaller_quotient(sharpen_plane(above[c] + i, here[c] + i, below[c] + i, &sums[c]), each);
            }
            const float16 lobe = SHARPNESS * (each.dividend / each.divisor), scale = 1 / (1 - 4 * lobe);
#pragma unroll
            for (int c = 0; c < 3; ++c) {
                const float16 sharpened = (vload16(0, here[c] + 16 + x) - lobe * sums[c]) * scale;
                const float16 raised = GREATER(sharpened, (float16)(0));
                planes[c] = LESSER(raised, (float16)(1));
            }
            store_planes(planes, min(16, pixels - x), out + AT(OUT, x0 + x, y, 0), OUT_STRIDE);
        }
    }
}
#endif
#endif
