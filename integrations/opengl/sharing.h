#ifndef CLARUS_OPENGL_SHARING_H
#define CLARUS_OPENGL_SHARING_H

#include "scene.h"

/* The stream that a program's frames go to, as the environment says (README.md). */

typedef struct jitter {
    float x, y; /* pixels, y down */
} jitter;

/* Whether the environment names a stream, and nothing has gone wrong with it. */
int sharing_is_wanted(void);

/* Of this frame, once sharing_begin has said that it is wanted. */
jitter sharing_jitter(void);

/* What textures' levels of detail are to be shifted by: of the resolution that is shown. */
float sharing_detail(void);

/* Between two frames, of which `width` and `height` are the last one's, 0 where it showed no world. Lets upscalers
   come; returns whether one wants the next frame, waits for a free slot if so. */
int sharing_begin(int width, int height);

/* The frame: colour (RGBA, 8 bits) and depth as read from the window, in rows from the bottom, of the size given to
   sharing_begin, and the matrices that it was drawn with. */
void sharing_frame(const unsigned char* color, const float* depth, const scene* drawn);

#endif
