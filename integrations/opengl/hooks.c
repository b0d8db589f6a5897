/* The functions that this library takes the place of, for programs that link OpenGL, ask glXGetProcAddress for it, or
   load it and look symbols up, as SDL does. */

#define GL_GLEXT_PROTOTYPES
#define GLX_GLXEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include <GL/glx.h>
#include <dlfcn.h>
#include <stddef.h>
#include <string.h>

#include "frame.h"
#include "real.h"

#define EXPORTED __attribute__((visibility("default")))

/* `real`, the function of this name behind the interposer's. */
#define FIND(name)                 \
    static __typeof__(&name) real; \
    if (!real) *(void**)&real = real_function(#name)

#define DRAWS(X)                                                                                                      \
    X(glDrawArrays, (GLenum a, GLint b, GLsizei c), (a, b, c))                                                        \
    X(glDrawArraysEXT, (GLenum a, GLint b, GLsizei c), (a, b, c))                                                     \
    X(glDrawElements, (GLenum a, GLsizei b, GLenum c, const void* d), (a, b, c, d))                                   \
    X(glDrawRangeElements, (GLenum a, GLuint b, GLuint c, GLsizei d, GLenum e, const void* f), (a, b, c, d, e, f))    \
    X(glDrawRangeElementsEXT, (GLenum a, GLuint b, GLuint c, GLsizei d, GLenum e, const void* f), (a, b, c, d, e, f)) \
    X(glDrawElementsBaseVertex, (GLenum a, GLsizei b, GLenum c, const void* d, GLint e), (a, b, c, d, e))             \
    X(glDrawRangeElementsBaseVertex, (GLenum a, GLuint b, GLuint c, GLsizei d, GLenum e, const void* f, GLint g),     \
      (a, b, c, d, e, f, g))                                                                                          \
    X(glDrawArraysInstanced, (GLenum a, GLint b, GLsizei c, GLsizei d), (a, b, c, d))                                 \
    X(glDrawElementsInstanced, (GLenum a, GLsizei b, GLenum c, const void* d, GLsizei e), (a, b, c, d, e))            \
    X(glMultiDrawArrays, (GLenum a, const GLint* b, const GLsizei* c, GLsizei d), (a, b, c, d))                       \
    X(glMultiDrawArraysEXT, (GLenum a, const GLint* b, const GLsizei* c, GLsizei d), (a, b, c, d))                    \
    X(glMultiDrawElements, (GLenum a, const GLsizei* b, GLenum c, const void* const* d, GLsizei e), (a, b, c, d, e))  \
    X(glMultiDrawElementsEXT, (GLenum a, const GLsizei* b, GLenum c, const void* const* d, GLsizei e), (a, b, c, d, e))

#define DRAW(name, parameters, arguments) \
    EXPORTED void name parameters {       \
        FIND(name);                       \
        frame_before_draw();              \
        real arguments;                   \
        frame_after_draw();               \
    }
DRAWS(DRAW)

/* Between glBegin and glEnd: a list that is called there holds vertices, and matrices cannot be changed. */
static int is_in_primitive;

EXPORTED void glBegin(GLenum mode) {
    FIND(glBegin);
    frame_before_draw();
    is_in_primitive = 1;
    real(mode);
}

EXPORTED void glEnd(void) {
    FIND(glEnd);
    real();
    is_in_primitive = 0;
    frame_after_draw();
}

EXPORTED void glCallList(GLuint list) {
    FIND(glCallList);
    if (!is_in_primitive) frame_before_list();
    real(list);
    if (!is_in_primitive) frame_after_draw();
}

EXPORTED void glCallLists(GLsizei count, GLenum type, const void* lists) {
    FIND(glCallLists);
    if (!is_in_primitive) frame_before_list();
    real(count, type, lists);
    if (!is_in_primitive) frame_after_draw();
}

EXPORTED void glNewList(GLuint list, GLenum mode) {
    FIND(glNewList);
    frame_compiles_list(1);
    real(list, mode);
}

EXPORTED void glEndList(void) {
    FIND(glEndList);
    real();
    frame_compiles_list(0);
}

EXPORTED void glClear(GLbitfield mask) {
    FIND(glClear);
    if (mask & GL_DEPTH_BUFFER_BIT) frame_before_depth_clear();
    real(mask);
}

EXPORTED void glXSwapBuffers(Display* display, GLXDrawable drawable) {
    FIND(glXSwapBuffers);
    frame_end();
    real(display, drawable);
}

typedef void (*function)(void);

static function hook_of(const char* name) {
    static const struct {
        const char* name;
        function hook;
    } hooks[] = {
#define HOOK(name) {#name, (function)name},
#define DRAW_HOOK(name, parameters, arguments) HOOK(name)
        DRAWS(DRAW_HOOK) HOOK(glBegin) HOOK(glEnd) HOOK(glCallList) HOOK(glCallLists) HOOK(glNewList) HOOK(glEndList)
            HOOK(glClear) HOOK(glXSwapBuffers) HOOK(glXGetProcAddress) HOOK(glXGetProcAddressARB)};
    for (size_t i = 0; i < sizeof hooks / sizeof *hooks; ++i)
        if (strcmp(name, hooks[i].name) == 0) return real_function(name) ? hooks[i].hook : NULL;
    return NULL;
}

EXPORTED function glXGetProcAddress(const GLubyte* name) {
    FIND(glXGetProcAddress);
    const function hook = hook_of((const char*)name);
    return hook ? hook : real(name);
}

EXPORTED function glXGetProcAddressARB(const GLubyte* name) {
    FIND(glXGetProcAddressARB);
    const function hook = hook_of((const char*)name);
    return hook ? hook : real(name);
}

EXPORTED void* dlsym(void* restrict library, const char* restrict name) {
    /* Another interposer that asks for what is behind it gets that. */
    if (library != RTLD_NEXT && name[0] == 'g' && name[1] == 'l') {
        void* hook;
        *(function*)&hook = hook_of(name);
        if (hook) return hook;
    }
    return real_symbol(library, name);
}
