#include "frame.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "matrix.h"
#include "real.h"
#include "scene.h"
#include "sharing.h"

#define USED(X)           \
    X(glActiveTexture)    \
    X(glBindBuffer)       \
    X(glGetFloatv)        \
    X(glGetIntegerv)      \
    X(glGetString)        \
    X(glLoadMatrixf)      \
    X(glMatrixMode)       \
    X(glPixelStorei)      \
    X(glPopAttrib)        \
    X(glPopClientAttrib)  \
    X(glPushAttrib)       \
    X(glPushClientAttrib) \
    X(glReadBuffer)       \
    X(glReadPixels)       \
    X(glTexEnvf)

static struct {
#define FIELD(name) __typeof__(&name) name;
    USED(FIELD)
#undef FIELD
} gl;

static enum { UNKNOWN, USABLE, UNUSABLE } context;

static scene drawn;     /* since the depth buffer was cleared */
static int viewport[4]; /* the largest that a world was drawn in; width 0: none was */
static int is_done;     /* what follows is no part of the frame */
static int is_compiling;
static int is_wanted;   /* an upscaler waits for this frame */
static int has_detail;  /* textures are sharper than the program asked for */
static int is_jittered; /* from before a draw to after it, with what then is put back: */
static float plain[16];
static int matrix_mode;
static unsigned char* color; /* as read */
static float* depth;
static size_t pixels; /* that there is room for */

/* Whether OpenGL is there, and with it the matrices that this is about. */
static int is_usable(void) {
    if (context != UNKNOWN || !sharing_is_wanted()) return context == USABLE && sharing_is_wanted();
    context = UNUSABLE;
#define LOAD(name)                            \
    *(void**)&gl.name = real_function(#name); \
    if (!gl.name) return 0;
    USED(LOAD)
#undef LOAD
    int major = 0, minor = 0, profile = 0;
    const char* version = (const char*)gl.glGetString(GL_VERSION);
    if (version && sscanf(version, "%d.%d", &major, &minor) == 2 && major * 10 + minor >= 32)
        gl.glGetIntegerv(GL_CONTEXT_PROFILE_MASK, &profile);
    if (major < 3 || profile & GL_CONTEXT_CORE_PROFILE_BIT)
        fprintf(stderr, "clarus: OpenGL is %s here, without matrices or older than 3.0; nothing is shared\n",
                version ? version : "missing");
    else
        context = USABLE;
    return context == USABLE;
}

/* The projection with the image moved by minus the jitter, so that pixel centres sample what lies at the jitter. */
static void load_jittered(const int at[4]) {
    const jitter shift = sharing_jitter();
    float moved[16];
    memcpy(moved, plain, sizeof moved);
    for (int column = 0; column < 4; ++column) {
        moved[4 * column] -= 2 * shift.x / (float)at[2] * plain[4 * column + 3];
        moved[4 * column + 1] += 2 * shift.y / (float)at[3] * plain[4 * column + 3];
    }
    gl.glGetIntegerv(GL_MATRIX_MODE, &matrix_mode);
    gl.glMatrixMode(GL_PROJECTION);
    gl.glLoadMatrixf(moved);
    gl.glMatrixMode((GLenum)matrix_mode);
    is_jittered = 1;
}

void frame_after_draw(void) {
    if (!is_jittered) return;
    gl.glMatrixMode(GL_PROJECTION);
    gl.glLoadMatrixf(plain);
    gl.glMatrixMode((GLenum)matrix_mode);
    is_jittered = 0;
}

static int has_room(void) {
    const size_t needed = (size_t)viewport[2] * (size_t)viewport[3];
    if (needed <= pixels) return 1;
    free(color);
    free(depth);
    color = malloc(4 * needed);
    depth = malloc(sizeof(float) * needed);
    pixels = color && depth ? needed : 0;
    return pixels > 0;
}

/* The world is complete: its colour, depth and matrices are shared. */
static void finish(void) {
    is_done = 1;
    if (!is_wanted || !scene_camera(&drawn) || !has_room()) return;
    gl.glPushAttrib(GL_PIXEL_MODE_BIT);
    gl.glPushClientAttrib(GL_CLIENT_PIXEL_STORE_BIT);
    gl.glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    gl.glPixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    gl.glPixelStorei(GL_PACK_SKIP_ROWS, 0);
    gl.glPixelStorei(GL_PACK_SKIP_PIXELS, 0);
    gl.glPixelStorei(GL_PACK_SWAP_BYTES, 0);
    gl.glReadBuffer(GL_BACK);
    gl.glReadPixels(viewport[0], viewport[1], viewport[2], viewport[3], GL_RGBA, GL_UNSIGNED_BYTE, color);
    gl.glReadPixels(viewport[0], viewport[1], viewport[2], viewport[3], GL_DEPTH_COMPONENT, GL_FLOAT, depth);
    gl.glPopClientAttrib();
    gl.glPopAttrib();
    sharing_frame(color, depth, &drawn);
}

static void before_draw(int may_be_none) {
    if (is_compiling || !is_usable() || is_done) return;
    int framebuffer = 0, at[4];
    gl.glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
    if (framebuffer != 0) return;
    gl.glGetFloatv(GL_PROJECTION_MATRIX, plain);
    if (!is_perspective(plain)) {
        /* Flat things over the world are the user interface; a world over them is a picture in a menu. */
        if (drawn.layer_count > 0)
            finish();
        else if (!may_be_none)
            is_done = 1;
        return;
    }
    gl.glGetIntegerv(GL_VIEWPORT, at);
    if ((double)at[2] * at[3] < (double)viewport[2] * viewport[3] || at[2] <= 0 || at[3] <= 0) return;
    if (memcmp(at, viewport, sizeof at) != 0) {
        memcpy(viewport, at, sizeof at);
        drawn.layer_count = 0;
    }
    float model_view[16], range[2];
    gl.glGetFloatv(GL_MODELVIEW_MATRIX, model_view);
    gl.glGetFloatv(GL_DEPTH_RANGE, range);
    scene_count(&drawn, plain, model_view, range);
    if (is_wanted) load_jittered(at);
}

void frame_before_draw(void) { before_draw(0); }

void frame_before_list(void) { before_draw(1); }

void frame_compiles_list(int whether) { is_compiling = whether; }

void frame_before_depth_clear(void) {
    if (is_compiling || is_done || drawn.layer_count == 0) return;
    int at[4];
    gl.glGetIntegerv(GL_VIEWPORT, at);
    /* For a model in the user interface; else for the world behind a mirror's or a portal's, which come first. */
    if (at[2] < viewport[2] || at[3] < viewport[3])
        finish();
    else
        drawn.layer_count = 0;
}

/* Shown at a multiple of its size, a texture is to have the detail of that. */
static void set_detail(int whether) {
    if (whether == has_detail) return;
    has_detail = whether;
    int units = 0, active = 0;
    gl.glGetIntegerv(GL_MAX_TEXTURE_UNITS, &units);
    gl.glGetIntegerv(GL_ACTIVE_TEXTURE, &active);
    for (int i = 0; i < units; ++i) {
        gl.glActiveTexture((GLenum)(GL_TEXTURE0 + i));
        gl.glTexEnvf(GL_TEXTURE_FILTER_CONTROL, GL_TEXTURE_LOD_BIAS, whether ? sharing_detail() : 0);
    }
    gl.glActiveTexture((GLenum)active);
}

void frame_end(void) {
    if (!is_usable()) return;
    if (!is_done && drawn.layer_count > 0) finish();
    const int shows_world = drawn.layer_count > 0 && scene_camera(&drawn);
    is_wanted = sharing_begin(shows_world ? viewport[2] : 0, viewport[3]);
    set_detail(is_wanted);
    drawn.layer_count = 0;
    is_done = 0;
    memset(viewport, 0, sizeof viewport);
}
