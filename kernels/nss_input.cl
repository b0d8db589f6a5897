// NSS, steps 2 and 3 (docs/nss.md): what the network sees. The guide is float, all else of one storage.
//
// Options: COLOR_* (radiance), GUIDE_*, OUT_* (layouts), STORE_HALF; FLICKER, and DERIVATIVE_*; or else FLICKER_*,
// HISTORY_*, TEMPORAL_*.

#include "nss.clh"

INLINE float2 vector_at(const Sizes* sizes, global const float* guide, int x, int y) {
    return (float2)(guide[AT(GUIDE, x, y, 0)], guide[AT(GUIDE, x, y, 1)]);
}

#ifdef FLICKER
INLINE float3 compared(const Sizes* sizes, global const storage* color, int x, int y) {
    const float4 c = LOAD_CHANNELS(COLOR, color, clamp(x, 0, COLOR_WIDTH - 1), clamp(y, 0, COLOR_HEIGHT - 1), 0);
    const float3 root = sqrt(max(c.xyz, 0.0f));
    const float orange = root.x - root.z, middle = root.z + orange / 2, green = root.y - middle;
    return (float3)(middle + green / 2, orange, green);
}

INLINE float distance_of(float3 a, float3 b) {
    const float3 d = (a - b) * (float3)(1, 1.25f, 1.25f);
    return sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

INLINE float ramp(float x, float low, float high) { return clamp((x - low) / (high - low), 0.0f, 1.0f); }

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void flicker(Sizes given, global const storage* color,
                                                                         global const float* guide,
                                                                         global const storage* derivative,
                                                                         global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const float2 vector = vector_at(sizes, guide, x, y);
    float4 before = 0;
    if (is_valid(vector)) {
        const float2 u = still(vector);
        const Taps tx = zero_taps(x - u.x, COLOR_WIDTH), ty = zero_taps(y - u.y, COLOR_HEIGHT);
        before = BILINEAR(DERIVATIVE, derivative, tx, ty, 0);
    }
    const float3 here = compared(sizes, color, x, y);
    const float above = distance_of(here, compared(sizes, color, x, y - 1)),
                below = distance_of(here, compared(sizes, color, x, y + 1)),
                left = distance_of(here, compared(sizes, color, x - 1, y)),
                right = distance_of(here, compared(sizes, color, x + 1, y));
    const float support = max(above + below + left + right - max(max(above, below), max(left, right)), 0.0f) / 3;
    const float was = before.w, supported = 0.75f * (0.7f * distance_of(here, before.xyz) + 0.3f * support);

    const float recall = ramp(supported, 0.065f, 0.42f), mean = ramp(supported, 0.07f, 0.23f);
    const float entry = sqrt(recall) * sqrt(ramp(max(supported - was, 0.0f), 0.025f, 0.16f)) * mean;
    const float heat = ramp(was, 0.11f, 0.21f);
    const float held = ramp(0.7f * was + 0.3f * supported, 0.177f - 0.02f * heat, 0.33f - 0.025f * heat);
    const float hot = ramp(was, 0.18f, 0.28f), carry = max(held * held, 0.12f * hot * hot);
    const float aim = max(entry, 0.8f * was * carry);
    const float fall = 0.24f - 0.19f * max(held * held, 0.5f * heat * heat), rise = 0.08f + 0.14f * sqrt(recall * mean);
    const float filtered = was + (aim - was) * (aim > was ? rise : fall);
    const float shown = was + (filtered - was) * (filtered > was ? 0.75f : 0.8f);
    const float4 size = fabs(before);
    const bool known = guide[AT(GUIDE, x, y, 2)] <= DISOCCLUDED && size.x + size.y + size.z + size.w >= 1e-4f;

    const float result[5] = {here.x, here.y, here.z, known ? filtered : 0, known ? shown : 0};
    for (int c = 0; c < 5; ++c) STORE(result[c], out, AT(OUT, x, y, c));
}
#else
INLINE int mirrored(int i, int size) { return i < size ? i : max(2 * size - 1 - i, 0); }

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void network_input(
    Sizes given, global const storage* color, global const float* guide, global const storage* flicker,
    global const storage* history, global const storage* temporal, global storage* restrict out, Frame frame) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const int i = mirrored(x, COLOR_WIDTH), j = mirrored(y, COLOR_HEIGHT);
    const float2 vector = vector_at(sizes, guide, i, j);
    const bool valid = is_valid(vector);
    const float2 u = valid ? still(vector) : (float2)(0);

    float4 warped = 0, fed_back = 0;
    if (valid) {
        const float from_x = (i + 0.5f - u.x) * ((float)HISTORY_WIDTH / COLOR_WIDTH) - 0.5f;
        const float from_y = (j + 0.5f - u.y) * ((float)HISTORY_HEIGHT / COLOR_HEIGHT) - 0.5f;
        const Taps tx = zero_taps(from_x, HISTORY_WIDTH), ty = zero_taps(from_y, HISTORY_HEIGHT);
        warped = karis(BILINEAR(HISTORY, history, tx, ty, 0));
        if (guide[AT(GUIDE, i, j, 2)] <= DISOCCLUDED) {
            const Taps px = zero_taps(x - u.x, OUT_WIDTH), py = zero_taps(y - u.y, OUT_HEIGHT);
            fed_back = BILINEAR(TEMPORAL, temporal, px, py, 0);
        }
    }
    const Taps tx = taps_at(i - frame.jitter_x, COLOR_WIDTH), ty = taps_at(j - frame.jitter_y, COLOR_HEIGHT);
    const float4 current = karis(BILINEAR(COLOR, color, tx, ty, 0));
    const float2 pixel = (float2)(1.0f / COLOR_WIDTH, 1.0f / COLOR_HEIGHT), moved = u * pixel;
    const float least = sqrt(pixel.x * pixel.x + pixel.y * pixel.y);
    const float length = sqrt(moved.x * moved.x + moved.y * moved.y);
    const float moves = sqrt((clamp(length, least, 200 * least) - least) / (199 * least));

    STORE_CHANNELS(OUT, (float4)(warped.xyz, current.x), out, x, y, 0);
    STORE_CHANNELS(OUT, (float4)(current.yz, moves, fed_back.x), out, x, y, 4);
    STORE_CHANNELS(OUT, (float4)(fed_back.yzw, LOAD(flicker, AT(FLICKER, i, j, 4))), out, x, y, 8);
}
#endif
