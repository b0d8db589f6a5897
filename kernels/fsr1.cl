// The two passes of AMD's FidelityFX Super Resolution 1, by its published description (pipelines/filters/README.md).
//
// Options: IN_*, OUT_* (layouts), STORE_HALF; for easu SCALE, SCALE_REST (s as the sum of two floats), for rcas
// SHARPNESS; for the kernels of strips PIXELS, ROWS.

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
kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void easu(global const storage* in, global storage* out,
                                                                      Frame frame) {
    const int x = get_global_id(0), y = get_global_id(1);
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

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void rcas(global const storage* in, global storage* out) {
    const int x = get_global_id(0), y = get_global_id(1);
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
#endif
