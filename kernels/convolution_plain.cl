// 3×3 convolution as it is defined: a work-item for each pixel, sums over taps and channels one after the other. Its
// input may be stored in blocks.
//
// Options: CIN, COUT, ACTIVATION, layouts IN and OUT, WG_X, WG_Y. Work-items: (width, height).
// A set of packed weights takes COUT · (1 + 9 · CIN) floats: biases, then weights OIHW.

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
            for (int ky = -1; ky <= 1; ++ky)
                for (int kx = -1; kx <= 1; ++kx, ++weight)
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
    for (int tap = 0; tap < 9; ++tap)
        packed[COUT + (co * CIN + ci) * 9 + tap] = weights[weights_offset + (co * CIN + ci) * 9 + tap];
}
