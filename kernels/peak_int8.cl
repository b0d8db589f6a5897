// The peak of x86's vpdpbusd, for devices whose profile has it: CHAINS independent accumulators of sixteen sums in each
// work-item, to each of whose lanes it adds four products of bytes. Every work-item does 128 · CHAINS · rounds
// operations.
//
// Options: CHAINS, WG_X.

kernel __attribute__((reqd_work_group_size(WG_X, 1, 1))) void peak_int8(global int* out, int numbers, int weights,
                                                                        uint rounds) {
    const size_t item = get_global_id(0);
    const int16 a = (int16)(numbers), b = (int16)(weights);
    int16 chain[CHAINS];
#pragma unroll
    for (int i = 0; i < CHAINS; ++i) chain[i] = (int16)(item + i);
    for (uint round = 0; round < rounds; ++round) {
#pragma unroll
        for (int i = 0; i < CHAINS; ++i) __asm__("vpdpbusd %2, %1, %0" : "+v"(chain[i]) : "v"(a), "v"(b));
    }
    int16 sum = chain[0];
#pragma unroll
    for (int i = 1; i < CHAINS; ++i) sum += chain[i];
    vstore16(sum, item, out);
}
