#include <doctest/doctest.h>

#include "render/worlds/camera_path.h"

using namespace clarus::render;

TEST_CASE("a path moves, stands still and moves again") {
    for (const int number : {0, 1, 2}) {
        const CameraPath path(number);
        int still = 0, moving = 0, objects_still = 0;
        for (int frame = 0; frame < 192; ++frame) {
            const FrameState state = path.frame(frame);
            const CameraPose &a = state.camera, &b = state.previous_camera;
            const bool stands = a.position == b.position && a.yaw == b.yaw && a.pitch == b.pitch;
            ++(stands ? still : moving);
            if (state.seconds == state.previous_seconds) {
                CHECK(stands);
                ++objects_still;
            }
            // The frame before is the frame before.
            CHECK(path.frame(frame + 1).previous_camera.position == a.position);
            CHECK(path.frame(frame + 1).previous_seconds == state.seconds);
        }
        CHECK(still == 64);
        CHECK(moving == 128);
        CHECK(objects_still == 32);
    }
}
