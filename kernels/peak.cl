// The device's multiply–add peak: CHAINS independent accumulators of LANES floats in each work-item, so that a sweep
// over both finds how many of them hide the latency. Every work-item does 2 · LANES · CHAINS · rounds operations.
//
// Options: LANES (1, 2, 4, 8, 16), CHAINS, WG_X.

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#if LANES == 1
typedef float lanes;
#define STORE_LANES(v, i, p) ((p)[i] = (v))
#else
typedef JOIN(float, LANES) lanes;
#define STORE_LANES JOIN(vstore, LANES)
#endif

kernel __attribute__((reqd_work_group_size(WG_X, 1, 1))) void peak(global float* out, float factor, float term,
                                                                   uint rounds) {
    const size_t item = get_global_id(0);
    lanes chain[CHAINS];
#pragma unroll
    for (int i = 0; i < CHAINS; ++i) chain[i] = (lanes)(item + i);
    for (uint round = 0; round < rounds; ++round) {
#pragma unroll
        for (int i = 0; i < CHAINS; ++i) chain[i] = MAD(chain[i], (lanes)(factor), (lanes)(term));
    }
    lanes sum = chain[0];
#pragma unroll
    for (int i = 1; i < CHAINS; ++i) sum += chain[i];
    STORE_LANES(sum, item, out);
}
