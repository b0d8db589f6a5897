/* A program that draws with OpenGL's own matrices and knows nothing of clarus: opengl_scene linked|address|symbol, by
   how it comes by OpenGL. Ends at SIGTERM; with 3 where OpenGL says that a matrix is not what it was set to. */

#define GL_GLEXT_PROTOTYPES
#include "opengl_scene.h"

#include <GL/gl.h>
#include <GL/glx.h>
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define TABLE(X) \
    X(glBegin) X(glEnd) X(glDrawArrays) X(glNewList) X(glEndList) X(glCallList) X(glClear) X(glXSwapBuffers)

static struct {
#define FIELD(name) __typeof__(&name) name;
    TABLE(FIELD)
#undef FIELD
} gl;

static volatile sig_atomic_t is_over;
static void end(int number) { is_over = number; }

static int load(const char* way) {
    if (strcmp(way, "linked") == 0) {
#define LINK(name) gl.name = &name;
        TABLE(LINK)
    } else if (strcmp(way, "address") == 0) {
#define ASK(name) gl.name = (__typeof__(&name))glXGetProcAddress((const GLubyte*)#name);
        TABLE(ASK)
    } else {
        void* library = dlopen("libGL.so.1", RTLD_NOW | RTLD_LOCAL);
        if (!library) return 0;
#define LOOK_UP(name) *(void**)&gl.name = dlsym(library, #name);
        TABLE(LOOK_UP)
    }
    return gl.glBegin && gl.glXSwapBuffers;
}

static const double degrees = 180 / 3.141592653589793;

static void look_from(int frame) {
    const camera_place place = scene_camera_at(frame);
    glMatrixMode(GL_MODELVIEW);
    glLoadIdentity();
    glRotated(place.pitch * degrees, 1, 0, 0);
    glRotated(place.yaw * degrees, 0, 1, 0);
    glTranslated(-place.eye[0], -place.eye[1], -place.eye[2]);
}

static void quad(double left, double right, double bottom, double top, double z) {
    gl.glBegin(GL_QUADS);
    glVertex3d(left, bottom, z);
    glVertex3d(right, bottom, z);
    glVertex3d(right, top, z);
    glVertex3d(left, top, z);
    gl.glEnd();
}

static void draw_floor(void) {
    const double step = (floor_first_z - wall_z) / 8;
    glColor3f(0, 1, 0);
    for (int i = 0; i < 8; ++i) {
        const double z = floor_first_z - i * step;
        const double corners[12] = {-world_half_width, floor_y, z,        world_half_width,  floor_y, z,
                                    world_half_width,  floor_y, z - step, -world_half_width, floor_y, z - step};
        glEnableClientState(GL_VERTEX_ARRAY);
        glVertexPointer(3, GL_DOUBLE, 0, corners);
        gl.glDrawArrays(GL_QUADS, 0, 4);
        glDisableClientState(GL_VERTEX_ARRAY);
    }
}

static void draw_world(GLuint wall, int frame) {
    look_from(frame);
    draw_floor();
    gl.glCallList(wall);
    /* Out of sight, and drawn more often than the world: what has a scale is no camera. */
    glPushMatrix();
    glScaled(2, 2, 2);
    for (int i = 0; i < 20; ++i) quad(-1, 1, -60, -59, 0);
    glPopMatrix();
}

static void draw_held(void) {
    glLoadIdentity();
    glColor3f(1, 0, 0);
    glDepthRange(0, 0.3);
    quad(held_left, held_right, held_bottom, held_top, -held_distance);
    glDepthRange(0, 1);
}

/* Over the world: flat, then a model in a corner. */
static void draw_interface(void) {
    glMatrixMode(GL_PROJECTION);
    glPushMatrix();
    glLoadIdentity();
    glOrtho(0, 1, 0, 1, -1, 1);
    glMatrixMode(GL_MODELVIEW);
    glLoadIdentity();
    glDisable(GL_DEPTH_TEST);
    glColor3f(1, 0, 1);
    quad(0, 0.3, 0, 0.3, 0);
    glEnable(GL_DEPTH_TEST);
    glMatrixMode(GL_PROJECTION);
    glPopMatrix();
    glMatrixMode(GL_MODELVIEW);
    glViewport(0, 0, 30, 30);
    gl.glClear(GL_DEPTH_BUFFER_BIT);
    quad(-1, 1, -1, 1, -3);
}

static int is_mine(const float projection[16]) {
    float found[16];
    glGetFloatv(GL_PROJECTION_MATRIX, found);
    return memcmp(found, projection, sizeof found) == 0;
}

static GLXContext open_window(Display* display, Window* window) {
    int wanted[] = {GLX_RGBA, GLX_DOUBLEBUFFER, GLX_DEPTH_SIZE, 24, None};
    XVisualInfo* visual = glXChooseVisual(display, DefaultScreen(display), wanted);
    if (!visual) return NULL;
    const Window root = RootWindow(display, visual->screen);
    XSetWindowAttributes attributes = {.colormap = XCreateColormap(display, root, visual->visual, AllocNone)};
    *window = XCreateWindow(display, root, 0, 0, scene_width, scene_height, 0, visual->depth, InputOutput,
                            visual->visual, CWColormap | CWBorderPixel, &attributes);
    XMapWindow(display, *window);
    const GLXContext context = glXCreateContext(display, visual, NULL, True);
    XFree(visual);
    return context;
}

int main(int argc, char** argv) {
    signal(SIGTERM, end);
    Display* display = XOpenDisplay(NULL);
    Window window;
    const GLXContext context = display ? open_window(display, &window) : NULL;
    if (argc != 2 || !context || !glXMakeCurrent(display, window, context) || !load(argv[1])) {
        fprintf(stderr, "opengl_scene: no window with OpenGL\n");
        return 2;
    }
    glEnable(GL_DEPTH_TEST);
    const double half_width = scene_half_height * scene_width / scene_height;
    glMatrixMode(GL_PROJECTION);
    glFrustum(-half_width * scene_near, half_width * scene_near, -scene_half_height * scene_near,
              scene_half_height * scene_near, scene_near, scene_far);
    float projection[16];
    glGetFloatv(GL_PROJECTION_MATRIX, projection);
    const GLuint wall = glGenLists(1);
    gl.glNewList(wall, GL_COMPILE);
    glColor3f(0, 0, 1);
    quad(-world_half_width, world_half_width, floor_y, wall_top, wall_z);
    gl.glEndList();

    int is_right = 1;
    for (int frame = 0; !is_over && is_right; ++frame) {
        glViewport(0, 0, scene_width, scene_height);
        gl.glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_world(wall, frame);
        draw_held();
        is_right = is_mine(projection);
        draw_interface();
        is_right = is_right && is_mine(projection) && glGetError() == GL_NO_ERROR;
        gl.glXSwapBuffers(display, window);
        usleep(2000);
    }
    glXMakeCurrent(display, None, NULL);
    glXDestroyContext(display, context);
    XCloseDisplay(display);
    return is_right ? 0 : 3;
}
