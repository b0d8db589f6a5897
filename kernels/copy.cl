// The device's copy bandwidth: each work-item moves `vectors` float16. INTERLEAVED: neighbouring work-items move
// neighbours; else each moves a stretch of its own.
//
// Options: WG_X, INTERLEAVED.

kernel __attribute__((reqd_work_group_size(WG_X, 1, 1))) void copy(global const float* from, global float* to,
                                                                   uint vectors) {
#if INTERLEAVED
    const size_t first = get_global_id(0), step = get_global_size(0);
#else
    const size_t first = get_global_id(0) * (size_t)vectors, step = 1;
#endif
    for (uint i = 0; i < vectors; ++i) vstore16(vload16(first + i * step, from), first + i * step, to);
}
