#ifndef CLARUS_TESTS_OPENGL_SCENE_H
#define CLARUS_TESTS_OPENGL_SCENE_H

/* What opengl_scene draws, for the program and for the test that computes how it must look. A floor and a wall before
   an empty sky, seen from a camera that moves; view space is x right, y up, -z ahead. */

#include <math.h>

static const int scene_width = 160, scene_height = 90;

static const double scene_near = 0.5, scene_far = 100, scene_half_height = 0.6; /* of the image, at distance 1 */
static const double floor_y = -1, floor_first_z = 8, wall_z = -30, wall_top = 4, world_half_width = 80;

/* What the player holds: a rectangle at this distance, in view space. */
static const double held_distance = 2, held_left = 0.2, held_right = 0.9, held_bottom = -0.9, held_top = -0.4;

typedef struct camera_place {
    double eye[3], yaw, pitch; /* radians: a point is turned about y by yaw, then about x by pitch */
} camera_place;

/* Whether the camera looks the other way. */
static inline int scene_is_turned(int frame) { return frame % 64 >= 24 && frame % 64 < 32; }

static inline camera_place scene_camera_at(int frame) {
    const double t = frame * 0.13;
    camera_place place;
    place.eye[0] = 1.5 * sin(t);
    place.eye[1] = 0.4 * cos(1.7 * t);
    place.eye[2] = 2 * cos(t);
    place.yaw = 0.2 * sin(0.7 * t) + (scene_is_turned(frame) ? 3.141592653589793 : 0);
    place.pitch = 0.1 + 0.05 * cos(0.9 * t);
    return place;
}

#endif
