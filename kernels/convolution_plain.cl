// Convolution as it is defined: a work-item for each pixel, sums over taps and channels one after the other. Its input
// may be stored in blocks. With GROUPS, an output channel sees the input channels of its group only.
//
// Options: CIN, COUT, KERNEL (odd), GROUPS, STRIDE, ACTIVATION, the input (convolution_input.clh), layout OUT, WG_X,
// WG_Y. Work-items: (width, height) of OUT.
// A set of packed weights takes COUT · (1 + KERNEL² · CIN / GROUPS) floats: biases, then weights OIHW.

#include "convolution_input.clh"

#define GROUP_CIN (CIN / GROUPS)

INLINE float channel(INPUT_PARAMETERS int x, int y, int c) {
#define CHANNEL(P) \
    if (c < PART##P##_FIRST + PART##P##_CHANNELS) return read1(INPUT P, x, y, c - PART##P##_FIRST, 1);
    EACH_PART(CHANNEL)
    return 0;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const float* restrict packed, global storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (!INSIDE(OUT, x, y)) return;
    global const float* bias = packed + packed_offset;
    global const float* weight = bias + COUT;
    for (int co = 0; co < COUT; ++co) {
        float sum = bias[co];
        const int first = co / (COUT / GROUPS) * GROUP_CIN;
        for (int ci = first; ci < first + GROUP_CIN; ++ci)
            for (int py = y * STRIDE - KERNEL / 2; py <= y * STRIDE + KERNEL / 2; ++py)
                for (int px = x * STRIDE - KERNEL / 2; px <= x * STRIDE + KERNEL / 2; ++px, ++weight)
                    if (INSIDE(IN, px, py)) sum = MAD(channel(INPUT px, py, ci), *weight, sum);
        STORE(ACTIVATE(sum), out, AT(OUT, x, y, co));
    }
}
