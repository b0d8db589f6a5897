// Convolution as it is defined: a work-item for each pixel, sums over taps and channels one after the other. Its input
// may be stored in blocks.
//
// Options: CIN, COUT, KERNEL (odd), ACTIVATION, layouts IN and OUT, WG_X, WG_Y. Work-items: (width, height).
// A set of packed weights takes COUT · (1 + KERNEL² · CIN) floats: biases, then weights OIHW.

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void convolution(global const storage* restrict in,
                                                                             global const float* restrict packed,
                                                                             global storage* restrict out,
                                                                             uint packed_offset) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (!INSIDE(OUT, x, y)) return;
    global const float* bias = packed + packed_offset;
    global const float* weight = bias + COUT;
    for (int co = 0; co < COUT; ++co) {
        float sum = bias[co];
        for (int ci = 0; ci < CIN; ++ci)
            for (int ky = -KERNEL / 2; ky <= KERNEL / 2; ++ky)
                for (int kx = -KERNEL / 2; kx <= KERNEL / 2; ++kx, ++weight)
                    if (INSIDE(IN, x + kx, y + ky)) sum = MAD(LOAD(in, AT(IN, x + kx, y + ky, ci)), *weight, sum);
        STORE(ACTIVATE(sum), out, AT(OUT, x, y, co));
    }
}

// Work-items: (CIN, COUT).
kernel __attribute__((reqd_work_group_size(1, 1, 1))) void pack(global const float* weights, global const float* biases,
                                                                global float* packed, uint packed_offset,
                                                                uint weights_offset, uint biases_offset) {
    const int ci = get_global_id(0), co = get_global_id(1);
    packed += packed_offset;
    if (ci == 0) packed[co] = biases[biases_offset + co];
    const int taps = KERNEL * KERNEL, first = (co * CIN + ci) * taps;
    for (int tap = first; tap < first + taps; ++tap) packed[COUT + tap] = weights[weights_offset + tap];
}
