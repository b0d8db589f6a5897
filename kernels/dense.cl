// What CLBlast leaves to do between dense layers.

__attribute__((reqd_work_group_size(WG_X, 1, 1))) __kernel void rectify(__global float* values, uint count) {
    const uint i = get_global_id(0);
    if (i < count) values[i] = fmax(values[i], 0.0f);
}
