#ifndef CLARUS_OPENGL_MOTION_H
#define CLARUS_OPENGL_MOTION_H

#include "scene.h"

/* A depth buffer that was read back, and what it was drawn with. */
typedef struct depth_buffer {
    const float* values; /* of the window, in its rows' order: from the bottom */
    int width, height;
    float jitter_x, jitter_y; /* pixels, y down */
    const scene* drawn;
} depth_buffer;

typedef struct camera_planes {
    float near_plane, far_plane; /* far may be infinite */
    float fov_y;
} camera_planes;

camera_planes planes_of(const view* camera);

/* Distances along the view from the window's values, row by row from the top; infinite where nothing was drawn. */
void decode_distances(const depth_buffer* from, float* distances);

/* Where each pixel's surface was in the frame before, if it stood still: pixels to there, y down, without jitter; NaN
   where it was behind the camera. Of layers in front of the world, which move with the camera, by the matrices that
   they were drawn with. Returns whether the frame shows little that the one before did: `before_distances` are that
   one's. */
int motion_since(const depth_buffer* now, const scene* before, const float* before_distances, float* motion);

#endif
