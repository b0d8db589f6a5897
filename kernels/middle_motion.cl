// middle_motion(m, d, S) of docs/interpolate.md, a work-item for each render pixel of the frame in between. All images
// are float. Result: a vector, a depth, and who shows what is there.
//
// Options: MOTION_*, DEPTH_*, SOURCE_*, OUT_* (layouts), NO_SOURCE.

#define REACH 64          // pixels in which a hole's surroundings are looked for
#define SAME_MOTION 1.0f  // render pixels: vectors that differ by less are one surface's
#define BY_THIS_FRAME 0.0f
#define BY_EITHER 0.5f
#define BY_PREVIOUS_FRAME 1.0f

INLINE float source_at(const Sizes* sizes, global const float* source, int x, int y) {
    return source[AT(SOURCE, x, y, 0)];
}

// Vector and depth of the pixel with that number.
INLINE float3 surface(const Sizes* sizes, global const float* motion, global const float* depth, float number) {
    const int pixel = (int)number, x = pixel % MOTION_WIDTH, y = pixel / MOTION_WIDTH;
    return (float3)(motion[AT(MOTION, x, y, 0)], motion[AT(MOTION, x, y, 1)], depth[AT(DEPTH, x, y, 0)]);
}

// Of the first surfaces in eight directions the farthest; a depth of -1 where there is none.
INLINE float3 surroundings(const Sizes* sizes, global const float* motion, global const float* depth,
                           global const float* source, int x, int y) {
    float3 farthest = (float3)(0, 0, -1);
    for (int direction = 0; direction < 9; ++direction) {
        const int step_x = direction % 3 - 1, step_y = direction / 3 - 1;
        if (direction == 4) continue;
        for (int i = 1; i <= REACH && INSIDE(SOURCE, x + i * step_x, y + i * step_y); ++i) {
            const float number = source_at(sizes, source, x + i * step_x, y + i * step_y);
            if (!(number < NO_SOURCE)) continue;
            const float3 found = surface(sizes, motion, depth, number);
            if (found.z > farthest.z) farthest = found;
            break;
        }
    }
    return farthest;
}

// Whether a hole beside the pixel is filled with the same surface: then the pixel lies at the edge of what is going to
// hide it, and in this frame has some of that in its colour.
INLINE int is_rim(const Sizes* sizes, global const float* motion, global const float* depth, global const float* source,
                  int x, int y, float3 here) {
    for (int neighbour = 0; neighbour < 9; ++neighbour) {
        const int column = x + neighbour % 3 - 1, row = y + neighbour / 3 - 1;
        if (!INSIDE(SOURCE, column, row) || source_at(sizes, source, column, row) < NO_SOURCE) continue;
        const float3 hole = surroundings(sizes, motion, depth, source, column, row);
        if (fabs(hole.x - here.x) < SAME_MOTION && fabs(hole.y - here.y) < SAME_MOTION) return 1;
    }
    return 0;
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void middle_motion(Sizes given, global const float* motion,
                                                                               global const float* depth,
                                                                               global const float* source,
                                                                               global float* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const float number = source_at(sizes, source, x, y);
    float4 result;
    if (number < NO_SOURCE) {
        const float3 here = surface(sizes, motion, depth, number);
        const int rim = is_rim(sizes, motion, depth, source, x, y, here);
        result = (float4)(here, rim ? BY_PREVIOUS_FRAME : BY_THIS_FRAME);
    } else {
        const float3 around = surroundings(sizes, motion, depth, source, x, y);
        result = around.z < 0 ? (float4)(0, 0, 1, BY_EITHER) : (float4)(around, BY_PREVIOUS_FRAME);
    }
    vstore4(result, 0, out + AT(OUT, x, y, 0));
}
