/* A renderer that shares its frames: all of what an engine adds. docs/sharing.md shows it. */

#include <clarus/share.h>
#include <stdio.h>
#include <stdlib.h>

enum { WIDTH = 320, HEIGHT = 180 };

/* Here a game would draw, its camera shifted by the jitter. */
static void draw(int number, float* color, float* depth, float* motion) {
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x) {
            const int i = y * WIDTH + x;
            const int inside = x > number % WIDTH && x < number % WIDTH + 40;
            color[3 * i] = inside ? 0.9f : 0.1f;
            color[3 * i + 1] = (float)y / HEIGHT;
            color[3 * i + 2] = 0.5f;
            depth[i] = inside ? 0.3f : 0.8f;
            motion[2 * i] = inside ? -1.0f : 0.0f;
            motion[2 * i + 1] = 0.0f;
        }
}

int main(int argc, char** argv) {
    const char* name = argc > 1 ? argv[1] : "tiny";
    const int frames = argc > 2 ? atoi(argv[2]) : 100;

    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = (clarus_share_resource){{CLARUS_F32, 3}, WIDTH, HEIGHT, 0};
    description.resources[CLARUS_SHARE_DEPTH] = (clarus_share_resource){{CLARUS_F32, 1}, WIDTH, HEIGHT, 0};
    description.resources[CLARUS_SHARE_MOTION] = (clarus_share_resource){{CLARUS_F32, 2}, WIDTH, HEIGHT, 0};
    description.scale = 2;

    clarus_share_stream* stream;
    clarus_share_status status = clarus_share_open(name, &description, &stream);
    for (int number = 0; status == CLARUS_SHARE_OK && number < frames; ++number) {
        clarus_share_frame frame;
        status = clarus_share_begin(stream, 10000, &frame);
        if (status != CLARUS_SHARE_OK) break;
        draw(number, frame.images[CLARUS_SHARE_COLOR].pixels, frame.images[CLARUS_SHARE_DEPTH].pixels,
             frame.images[CLARUS_SHARE_MOTION].pixels);
        frame.number = (uint64_t)number;
        status = clarus_share_end(stream, &frame);
    }
    if (status == CLARUS_SHARE_OK) status = clarus_share_drain(stream, 10000);
    if (status != CLARUS_SHARE_OK) fprintf(stderr, "tiny_renderer: %s\n", clarus_share_last_error());
    clarus_share_close(stream);
    return status == CLARUS_SHARE_OK ? 0 : 1;
}
