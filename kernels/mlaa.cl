// Morphological antialiasing after Reshetov 2009: the staircases that one sample a pixel makes of slanted edges become
// slanted edges again.
//
// Between neighbouring pixels whose colours differ there is an edge. Edges one after the other form a line, until an
// edge across meets it. Where a line ends at a step of one pixel to one side, the true edge is taken to run from the
// middle of that step to the middle of the line, and each pixel takes as much of the colour on the other side of the
// line as the true edge cuts off it. Two ends on the same side make Reshetov's U, on different sides his Z, one end
// alone his L. What is not the trace of a slanted edge stays as it is: a turn of more than one pixel is a corner, a
// corner where four edges meet could be anything, and what is one pixel thin would disappear. At 45 degrees all lines
// are one pixel long, across and along; those along x count.
//
// Options: IN_*, OUT_* (layouts, three channels), THRESHOLD, REACH, STORE_HALF.

// Coordinates are along lines (u) and across them (v): x and y for lines along x (axis 0), else y and x.
#define X(axis, u, v) ((axis) ? (v) : (u))
#define Y(axis, u, v) ((axis) ? (u) : (v))

INLINE int differ(const Sizes* sizes, global const storage* in, int ax, int ay, int bx, int by) {
    if (!INSIDE(IN, ax, ay) || !INSIDE(IN, bx, by)) return 0;
    const float4 d = fabs(LOAD_CHANNELS(IN, in, ax, ay, 0) - LOAD_CHANNELS(IN, in, bx, by, 0));
    return d.x >= THRESHOLD || d.y >= THRESHOLD || d.z >= THRESHOLD;
}

// Whether a line passes between (u, v) and (u, v + 1).
INLINE int line_at(const Sizes* sizes, global const storage* in, int axis, int u, int v) {
    return differ(sizes, in, X(axis, u, v), Y(axis, u, v), X(axis, u, v + 1), Y(axis, u, v + 1));
}
// Whether an edge across lines lies between (u, v) and (u + 1, v).
INLINE int edge_across(const Sizes* sizes, global const storage* in, int axis, int u, int v) {
    return differ(sizes, in, X(axis, u, v), Y(axis, u, v), X(axis, u + 1, v), Y(axis, u + 1, v));
}

typedef struct {
    int distance;  // pixels between the starting point and the end
    int step;      // where the line goes on: -1 towards smaller v, 1 towards larger v, 0 nowhere
} End;

// The end of the line between v and v + 1, from u on in a direction.
INLINE End find_end(const Sizes* sizes, global const storage* in, int axis, int u, int v, int direction) {
    End end = {0, 0};
    for (; end.distance < REACH; ++end.distance) {
        const int at = u + direction * end.distance, before = direction > 0 ? at : at - 1;
        const int up = edge_across(sizes, in, axis, before, v), down = edge_across(sizes, in, axis, before, v + 1);
        if (up && !down && !edge_across(sizes, in, axis, before, v - 1)) end.step = -1;
        if (down && !up && !edge_across(sizes, in, axis, before, v + 2)) end.step = 1;
        if (up || down || !line_at(sizes, in, axis, at + direction, v)) break;
    }
    return end;
}

// The area that the true edge cuts off a pixel so far from the line's end: it is half a pixel away from the line there,
// and meets it in the middle.
inline float area(int distance, int length) {
    const float first = distance, last = min(first + 1, 0.5f * length);
    return last > first ? 0.5f * (last - first) * (1 - (first + last) / length) : 0;
}

// The share that the pixel on one side of the line (-1: at v, 1: at v + 1) takes of the other side's colour.
INLINE float share(const Sizes* sizes, global const storage* in, int axis, int u, int v, int side) {
    const End first = find_end(sizes, in, axis, u, v, -1), last = find_end(sizes, in, axis, u, v, 1);
    const int length = first.distance + last.distance + 1;
    if (length == 1 && (axis == 1 || first.step * last.step != -1)) return 0;
    return (first.step == side ? area(first.distance, length) : 0) +
           (last.step == side ? area(last.distance, length) : 0);
}

// What the pixel's colour gains by the lines along an axis.
INLINE float4 gain(const Sizes* sizes, global const storage* in, int axis, int u, int v) {
    const int before = line_at(sizes, in, axis, u, v - 1), after = line_at(sizes, in, axis, u, v);
    if (before == after) return 0;
    const int other = before ? v - 1 : v + 1;
    const float part = share(sizes, in, axis, u, min(v, other), before ? 1 : -1);
    return part * (LOAD_CHANNELS(IN, in, X(axis, u, other), Y(axis, u, other), 0) -
                   LOAD_CHANNELS(IN, in, X(axis, u, v), Y(axis, u, v), 0));
}

kernel __attribute__((reqd_work_group_size(WG_X, WG_Y, 1))) void mlaa(Sizes given, global const storage* in,
                                                                      global storage* restrict out) {
    TAKE(sizes);
    const int x = get_global_id(0), y = ROW_ITEM(1);
    if (x >= OUT_WIDTH || y >= OUT_HEIGHT) return;
    const float4 color = LOAD_CHANNELS(IN, in, x, y, 0) + gain(sizes, in, 0, x, y) + gain(sizes, in, 1, y, x);
    STORE_CHANNELS(OUT, color, out, x, y, 0);
}
