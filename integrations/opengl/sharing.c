#include "sharing.h"

#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clarus/share.h"
#include "motion.h"

enum { PATIENCE_MS = 10000 };

static struct {
    int read;
    const char* name;
    clarus_share_policy policy;
    double scale;
    int jitter_points;
} settings;

static clarus_share_stream* stream;
static clarus_share_frame slot;
static int width, height; /* the stream's */
static int is_wanted;     /* an upscaler waits for the frame that is drawn */
static int has_before;    /* the frame before was shared */
static uint64_t number;   /* frames that the program showed */
static scene before;      /* what the frame before was drawn with */
static float *distances, *before_distances;
static volatile sig_atomic_t is_at_work; /* with the stream, where a signal may find it */
static float farthest;                   /* of all far planes; depth is shared as a share of it */

static void give_up(const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fputs("clarus: ", stderr);
    vfprintf(stderr, format, arguments);
    fputs("; nothing is shared\n", stderr);
    va_end(arguments);
    settings.name = NULL;
}

static double number_in(const char* variable, double unless_told, double least, double most) {
    const char* text = getenv(variable);
    if (!text || !settings.name) return unless_told;
    char* end;
    const double value = strtod(text, &end);
    if (end != text && *end == '\0' && value >= least && value <= most) return value;
    give_up("%s is '%s', and not a number from %g to %g", variable, text, least, most);
    return unless_told;
}

int sharing_is_wanted(void) {
    if (!settings.read) {
        settings.read = 1;
        settings.name = getenv("CLARUS_GL_STREAM");
        const char* policy = getenv("CLARUS_GL_POLICY");
        if (policy && strcmp(policy, "newest") != 0 && strcmp(policy, "every") != 0 && settings.name)
            give_up("CLARUS_GL_POLICY is '%s', and neither 'newest' nor 'every'", policy);
        settings.policy =
            policy && strcmp(policy, "newest") == 0 ? CLARUS_SHARE_NEWEST_FRAME : CLARUS_SHARE_EVERY_FRAME;
        settings.scale = number_in("CLARUS_GL_SCALE", 2, 1, 16);
        settings.jitter_points = (int)number_in("CLARUS_GL_JITTER", 16, 0, 1024);
    }
    return settings.name != NULL;
}

static float radical_inverse(uint64_t index, int base) {
    double value = 0, digit = 1;
    for (; index > 0; index /= (uint64_t)base) {
        digit /= base;
        value += digit * (double)(index % (uint64_t)base);
    }
    return (float)value;
}

jitter sharing_jitter(void) {
    if (settings.jitter_points == 0) return (jitter){0, 0};
    const uint64_t index = number % (uint64_t)settings.jitter_points + 1;
    return (jitter){radical_inverse(index, 2) - 0.5f, radical_inverse(index, 3) - 0.5f};
}

float sharing_detail(void) { return (float)-log2(settings.scale); }

static void close_stream(void) {
    clarus_share_close(stream);
    stream = NULL;
    free(distances);
    free(before_distances);
    distances = before_distances = NULL;
}

static void open_stream(int new_width, int new_height) {
    close_stream();
    width = new_width;
    height = new_height;
    farthest = 0;
    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = (clarus_share_resource){{CLARUS_U8, 4}, width, height, 0};
    description.resources[CLARUS_SHARE_DEPTH] = (clarus_share_resource){{CLARUS_F32, 1}, width, height, 0};
    description.resources[CLARUS_SHARE_MOTION] = (clarus_share_resource){{CLARUS_F32, 2}, width, height, 0};
    description.motion_sampled_at_jitter = 1;
    description.policy = settings.policy;
    description.scale = (float)settings.scale;
    const size_t bytes = sizeof(float) * (size_t)width * (size_t)height;
    distances = malloc(bytes);
    before_distances = malloc(bytes);
    if (!distances || !before_distances)
        give_up("no memory for frames of %dx%d", width, height);
    else if (clarus_share_open(settings.name, &description, &stream) != CLARUS_SHARE_OK)
        give_up("%s", clarus_share_last_error());
}

int sharing_begin(int new_width, int new_height) {
    if (!settings.name) return 0;
    ++number;
    if (!is_wanted || new_width == 0) has_before = 0;
    is_wanted = 0;
    if (new_width > 0 && (!stream || new_width != width || new_height != height)) {
        has_before = 0;
        open_stream(new_width, new_height);
    }
    if (!stream) return 0;
    is_at_work = 1;
    const int is_connected = clarus_share_stream_state(stream).connected;
    const int waits = is_connected && settings.policy == CLARUS_SHARE_EVERY_FRAME;
    is_wanted = clarus_share_begin(stream, waits ? PATIENCE_MS : 0, &slot) == CLARUS_SHARE_OK &&
                clarus_share_stream_state(stream).connected;
    is_at_work = 0;
    return is_wanted;
}

static void row_major(const float from[16], float to[16]) {
    for (int i = 0; i < 16; ++i) to[i] = from[i % 4 * 4 + i / 4];
}

static void describe_camera(const scene* drawn) {
    const view* camera = scene_camera(drawn);
    const camera_planes planes = planes_of(camera);
    /* Games move their far plane from frame to frame: what is shared must not change with it. */
    farthest = fmaxf(farthest, isinf(planes.far_plane) ? 1e4f * planes.near_plane : planes.far_plane);
    slot.near_plane = planes.near_plane;
    slot.far_plane = farthest;
    slot.fov_y = planes.fov_y;
    slot.has_matrices = 1;
    row_major(camera->model_view, slot.view);
    row_major(camera->projection, slot.projection);
}

void sharing_frame(const unsigned char* color, const float* depth, const scene* drawn) {
    const jitter shift = sharing_jitter();
    const depth_buffer read = {depth, width, height, shift.x, shift.y, drawn};
    describe_camera(drawn);
    slot.number = number;
    slot.jitter_x = shift.x;
    slot.jitter_y = shift.y;

    const size_t row = (size_t)width * 4;
    for (int y = 0; y < height; ++y)
        memcpy((unsigned char*)slot.images[CLARUS_SHARE_COLOR].pixels + (size_t)y * row,
               color + (size_t)(height - 1 - y) * row, row);
    decode_distances(&read, distances);
    float* shared_depth = slot.images[CLARUS_SHARE_DEPTH].pixels;
    for (size_t i = 0; i < (size_t)width * (size_t)height; ++i) shared_depth[i] = fminf(distances[i] / farthest, 1);
    float* motion = slot.images[CLARUS_SHARE_MOTION].pixels;
    if (has_before)
        slot.reset = motion_since(&read, &before, before_distances, motion);
    else {
        slot.reset = 1;
        memset(motion, 0, sizeof(float) * 2 * (size_t)width * (size_t)height);
    }
    is_at_work = 1;
    const clarus_share_status status = clarus_share_end(stream, &slot);
    is_at_work = 0;
    if (status != CLARUS_SHARE_OK) {
        give_up("%s", clarus_share_last_error());
        close_stream();
    }
    before = *drawn;
    has_before = 1;
    float* kept = before_distances;
    before_distances = distances;
    distances = kept;
}

__attribute__((destructor)) static void end(void) {
    if (is_at_work) return; /* a handler of signals ends the program: the upscaler sees it gone */
    if (stream && clarus_share_stream_state(stream).connected) clarus_share_drain(stream, PATIENCE_MS);
    close_stream();
}
