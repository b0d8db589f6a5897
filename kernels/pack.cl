// Convolutions' weights (OIHW) and biases in the form that their kernels read: one set at a time, offsets in floats.
// Shapes are arguments, so that one kernel serves all convolutions of a network.
//
// Options: HALF for pack_tiled's weights in half.

// runtime/implementation.h: PackShape, member by member.
typedef struct {
    int in_channels;  // of a group
    int out_channels;
    int taps;   // of a kernel
    int group;  // blocks of sixteen output channels that are multiplied at once
    int parts;  // of the input along channels
    int part_channels[8];
} Shape;

#define DEFINE_PACK(name)                                                                                  \
    kernel __attribute__((reqd_work_group_size(1, 1, 1))) void name(                                       \
        global const float* weights, global const float* biases, global float* packed, uint packed_offset, \
        uint weights_offset, uint biases_offset, Shape shape)

#define BLOCKS_OF(channels) (((channels) + 15) / 16)

// As they are, biases first. Work-items: (channels of a group, output channels).
DEFINE_PACK(pack_plain) {
    const int ci = get_global_id(0), co = get_global_id(1);
    packed += packed_offset;
    if (ci == 0) packed[co] = biases[biases_offset + co];
    const int first = (co * shape.in_channels + ci) * shape.taps;
    for (int tap = first; tap < first + shape.taps; ++tap)
        packed[shape.out_channels + tap] = weights[weights_offset + tap];
}

#ifdef HALF
#pragma OPENCL EXTENSION cl_khr_fp16 : enable
typedef half packed_operand;
#else
typedef float packed_operand;
#endif

// Biases, then operands as [block][input channel][tap][16]. Work-items: (input channels, those of whole blocks).
DEFINE_PACK(pack_tiled) {
    const int ci = get_global_id(0), co = get_global_id(1);
    packed += packed_offset;
    if (ci == 0) packed[co] = co < shape.out_channels ? biases[biases_offset + co] : 0;
    weights += weights_offset + (co * shape.in_channels + ci) * shape.taps;
    global packed_operand* to = (global packed_operand*)(packed + 16 * BLOCKS_OF(shape.out_channels)) +
                                (co / 16 * shape.in_channels + ci) * 16 * shape.taps + co % 16;
    for (int tap = 0; tap < shape.taps; ++tap) to[16 * tap] = co < shape.out_channels ? weights[tap] : 0;
}

// Where an output channel's first weight of a step is among [group of blocks][tap][step][16 · blocks], after biases;
// `width`: how far it is from step to step.
INLINE int place_in_group(Shape shape, int co, int step, int steps, int* width) {
    const int blocks = BLOCKS_OF(shape.out_channels), before = co / 16 / shape.group * shape.group;
    *width = 16 * min(shape.group, blocks - before);
    return 16 * blocks + before * 16 * shape.taps * steps + step * *width + co - 16 * before;
}

// Biases, then weights in groups, an input channel a step. Work-items: likewise.
DEFINE_PACK(pack_direct) {
    const int ci = get_global_id(0), co = get_global_id(1);
    packed += packed_offset;
    weights += weights_offset + (co * shape.in_channels + ci) * shape.taps;
    if (ci == 0) packed[co] = co < shape.out_channels ? biases[biases_offset + co] : 0;
    int width;
    packed += place_in_group(shape, co, ci, shape.in_channels, &width);
    for (int tap = 0; tap < shape.taps; ++tap)
        packed[tap * shape.in_channels * width] = co < shape.out_channels ? weights[tap] : 0;
}

INLINE ushort bf16(float v) {
    const uint bits = as_uint(v);
    return (bits + 0x7fff + (bits >> 16 & 1)) >> 16;
}

// The same with pairs of weights in bfloat16, a step of two input channels each. Work-items: (input channels, rounded
// up to whole pairs; output channels of whole blocks).
DEFINE_PACK(pack_bf16) {
    const int ci = get_global_id(0), co = get_global_id(1), pairs = (shape.in_channels + 1) / 2;
    packed += packed_offset;
    weights += weights_offset + (co * shape.in_channels + ci) * shape.taps;
    if (ci == 0) packed[co] = co < shape.out_channels ? biases[biases_offset + co] : 0;
    int width;
    packed += place_in_group(shape, co, ci / 2, pairs, &width);
    for (int tap = 0; tap < shape.taps; ++tap)
        ((global ushort*)(packed + tap * pairs * width))[ci % 2] =
            co < shape.out_channels && ci < shape.in_channels ? bf16(weights[tap]) : 0;
}

// Gg for one row or column of a kernel.
INLINE void transform_kernel(float a, float b, float c, float* out, int step) {
    out[0] = a / 4;
    out[step] = -(a + b + c) / 6;
    out[2 * step] = -(a - b + c) / 6;
    out[3 * step] = a / 24 + b / 12 + c / 6;
    out[4 * step] = a / 24 - b / 12 + c / 6;
    out[5 * step] = c;
}

// Vectors of a part's weights for the quad of output channels left over (convolution_winograd.cl).
INLINE int quad_vectors(int channels) { return channels / 16 * 4 + channels % 16; }

// For convolution_winograd.cl: biases, then each of the 36 points' matrix for every group of blocks, then for the quad.
// Work-items: (input channels, those of whole blocks).
DEFINE_PACK(pack_winograd) {
    const int ci = get_global_id(0), co = get_global_id(1);
    const int rest = shape.out_channels % 16, blocks = shape.out_channels / 16 + (rest > 4);
    packed += packed_offset;
    weights += weights_offset + (co * shape.in_channels + ci) * 9;
    if (ci == 0) packed[co] = co < shape.out_channels ? biases[biases_offset + co] : 0;

    // Where point 0 of this pair goes, and how far it is from point to point.
    int position = 16 * BLOCKS_OF(shape.out_channels), step;
    const int before = co / 16 / shape.group * shape.group;
    if (co / 16 < blocks) {
        const int width = 16 * min(shape.group, blocks - before);
        step = width * shape.in_channels;
        position += 36 * 16 * shape.in_channels * before + width * ci + co - 16 * before;
    } else {
        position += 36 * 16 * shape.in_channels * blocks;
        int vectors = 0, own = 0, whole = 0, c = 0;  // all parts', those before this channel's; its blocks, its place
        int first = 0;
        for (int part = 0; part < shape.parts; first += shape.part_channels[part++]) {
            const int channels = shape.part_channels[part];
            if (ci >= first && ci < first + channels) {
                own = vectors;
                whole = channels / 16;
                c = ci - first;
            }
            vectors += quad_vectors(channels);
        }
        step = 16 * vectors;
        if (c >= 16 * whole)
            position += 16 * (own + 4 * whole + c % 16) + co % 16;
        else if (co % 16 < 4)
            position += 16 * (own + c / 16 * 4 + c % 4) + c % 16 / 4 * 4 + co % 16;
        else
            return;
    }

    float rows[18], points[36];
    for (int c = 0; c < 3; ++c) {
        if (co < shape.out_channels)
            transform_kernel(weights[c], weights[c + 3], weights[c + 6], rows + c, 3);
        else
            transform_kernel(0, 0, 0, rows + c, 3);
    }
    for (int r = 0; r < 6; ++r) transform_kernel(rows[3 * r], rows[3 * r + 1], rows[3 * r + 2], points + 6 * r, 1);
    for (int k = 0; k < 36; ++k) packed[position + k * step] = points[k];
}
