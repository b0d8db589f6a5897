// Convolution in whole numbers as it is defined (docs/quantization.md): a work-item for each pixel, sums over taps and
// channels one after the other. Its input may be stored in blocks. With GROUPS, an output channel sees the input
// channels of its group only.
//
// Options: CIN, COUT, KERNEL (odd), GROUPS, STRIDE, WG_X, WG_Y, and those of convolution_int8.clh. Work-items: (width,
// height) of OUT. Packed weights are bytes, OIHW.

#include "convolution_int8.clh"

#define GROUP_CIN (CIN / GROUPS)

INLINE int channel(INPUT_PARAMETERS int x, int y, int c, float inverse_scale, int zero_point) {
#define CHANNEL(P) \
    if (c < PART##P##_FIRST + PART##P##_CHANNELS) return NUMBER_1(P, x, y, c - PART##P##_FIRST);
    EACH_PART(CHANNEL)
    return 0;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(
    Sizes given, IMAGE_PARAMETERS global const int* restrict packed_sets, global result_storage* restrict out,
    uint packed_offset) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (!INSIDE(OUT, x, y)) return;
    global const int* packed = packed_sets + packed_offset;
    const float inverse_scale = HEAD_INVERSE_SCALE(packed);
    const int zero_point = HEAD_ZERO_POINT(packed);
    global const char* weight = (global const char*)WEIGHTS(packed);
    for (int co = 0; co < COUT; ++co) {
        int sum = BIASES(packed)[co];
        const int first = co / (COUT / GROUPS) * GROUP_CIN;
        for (int ci = first; ci < first + GROUP_CIN; ++ci)
            for (int py = y * STRIDE - KERNEL / 2; py <= y * STRIDE + KERNEL / 2; ++py)
                for (int px = x * STRIDE - KERNEL / 2; px <= x * STRIDE + KERNEL / 2; ++px, ++weight)
                    if (INSIDE(IN, px, py))
                        sum += (channel(INPUT px, py, ci, inverse_scale, zero_point) - zero_point) * *weight;
#ifdef RESULT_BYTES
        out[AT(OUT, x, y, co)] = requantized1(sum, UNITS(packed)[co], SHIFTS(packed)[co],
                                              HEAD_RESULT_ZERO_POINT(packed), HEAD_LEAST(packed));
#else
        const float value = sum * as_float(UNITS(packed)[co]);
        STORE(ACTIVATE(value), out, AT(OUT, x, y, co));
#endif
    }
}
