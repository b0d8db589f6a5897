// The device's copy bandwidth: each work-item moves a stretch of `vectors` float16, neighbours in memory.
//
// Options: WG_X.

kernel __attribute__((reqd_work_group_size(WG_X, 1, 1))) void copy(global const float* from, global float* to,
                                                                   uint vectors) {
    const size_t first = get_global_id(0) * (size_t)vectors;
    for (uint i = 0; i < vectors; ++i) vstore16(vload16(first + i, from), first + i, to);
}
