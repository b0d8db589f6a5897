#include "motion.h"

#include <math.h>
#include <stddef.h>

#include "matrix.h"

/* How the pixels of a layer are decoded and where they come from. */
typedef struct decoder {
    float range[2], low, high;
    double depth_scale, depth_offset; /* of the projection: distance = offset / (ndc z + scale) */
    int has_motion;
    matrix to_before; /* from now's clip space to the one before's */
} decoder;

typedef struct decoders {
    int count;
    decoder of[SCENE_LAYERS]; /* the world's is the first */
} decoders;

camera_planes planes_of(const view* camera) {
    const double scale = camera->projection[10], offset = camera->projection[14];
    camera_planes planes;
    planes.near_plane = (float)(offset / (scale - 1));
    planes.far_plane = scale == -1 ? INFINITY : (float)(offset / (scale + 1));
    planes.fov_y = (float)(2 * atan(1 / fabs((double)camera->projection[5])));
    return planes;
}

static matrix model_view_of(const view* of, int is_far) {
    matrix result = matrix_from(of->model_view);
    if (is_far) result.of[12] = result.of[13] = result.of[14] = 0;
    return result;
}

/* From clip space to clip space of the frame before. What is infinitely far only turns. */
static int way_back(const view* now, const view* before, int is_far, matrix* way) {
    const matrix projection = matrix_from(now->projection), model_view = model_view_of(now, is_far);
    matrix from_clip, from_view;
    if (!matrix_inverse(&projection, &from_clip) || !matrix_inverse(&model_view, &from_view)) return 0;
    const matrix before_projection = matrix_from(before->projection), before_view = model_view_of(before, is_far);
    const matrix turn = matrix_product(&before_view, &from_view);
    const matrix to_clip = matrix_product(&before_projection, &turn);
    *way = matrix_product(&to_clip, &from_clip);
    return 1;
}

static decoder decoder_of(const layer* from, const view* main_view) {
    decoder result = {.has_motion = 0};
    for (int i = 0; i < 2; ++i) result.range[i] = from->range[i];
    result.low = fminf(from->range[0], from->range[1]);
    result.high = fmaxf(from->range[0], from->range[1]);
    result.depth_scale = main_view->projection[10];
    result.depth_offset = main_view->projection[14];
    return result;
}

static decoders decoders_of(const scene* now, const scene* before) {
    const layer* world = scene_world(now);
    const view* camera = scene_camera(now);
    decoders result = {.count = 1};
    result.of[0] = decoder_of(world, camera);
    const view* camera_before = before ? scene_camera(before) : NULL;
    if (camera_before) result.of[0].has_motion = way_back(camera, camera_before, 0, &result.of[0].to_before);
    for (int i = 0; i < now->layer_count; ++i) {
        const layer* near = &now->layers[i];
        if (near == world) continue;
        const view* main_view = layer_main_view(near);
        decoder added = decoder_of(near, main_view);
        const layer* near_before = before ? scene_layer_like(before, near) : NULL;
        if (near_before)
            added.has_motion = way_back(main_view, layer_nearest_view(near_before, main_view), 0, &added.to_before);
        result.of[result.count++] = added;
    }
    return result;
}

/* The narrowest that has the value. */
static const decoder* decoder_for(const decoders* all, float value) {
    const decoder* narrowest = &all->of[0];
    for (int i = 1; i < all->count; ++i) {
        const decoder* other = &all->of[i];
        if (value >= other->low && value <= other->high && other->high - other->low < narrowest->high - narrowest->low)
            narrowest = other;
    }
    return narrowest;
}

static double ndc_depth(const decoder* by, float value) {
    return 2.0 * (value - by->range[0]) / (by->range[1] - by->range[0]) - 1;
}

static double distance_of(const decoder* by, float value) {
    return by->depth_offset / (ndc_depth(by, value) + by->depth_scale);
}

static int is_background(const decoders* all, float value) { return value == all->of[0].range[1]; }

void decode_distances(const depth_buffer* from, float* distances) {
    const decoders all = decoders_of(from->drawn, NULL);
    for (int y = 0; y < from->height; ++y)
        for (int x = 0; x < from->width; ++x) {
            const float value = from->values[(size_t)(from->height - 1 - y) * from->width + x];
            const decoder* by = decoder_for(&all, value);
            distances[(size_t)y * from->width + x] =
                is_background(&all, value) ? INFINITY : (float)distance_of(by, value);
        }
}

/* How much of what is seen was seen before. */
typedef struct agreement {
    int looked, agreed;
} agreement;

static int agrees(const depth_buffer* now, const float* before_distances, double x, double y, double distance) {
    if (!(x >= 0 && x < now->width && y >= 0 && y < now->height)) return 0;
    const double found = before_distances[(size_t)y * (size_t)now->width + (size_t)x];
    return isinf(distance) ? isinf(found) : fabs(found - distance) < 0.1 * distance;
}

int motion_since(const depth_buffer* now, const scene* before, const float* before_distances, float* motion) {
    const decoders all = decoders_of(now->drawn, before);
    matrix sky;
    const int has_sky = way_back(scene_camera(now->drawn), scene_camera(before), 1, &sky);
    agreement seen = {0, 0};
    for (int y = 0; y < now->height; ++y)
        for (int x = 0; x < now->width; ++x) {
            const float value = now->values[(size_t)(now->height - 1 - y) * now->width + x];
            const int background = is_background(&all, value);
            const decoder* by = background ? &all.of[0] : decoder_for(&all, value);
            float* to = &motion[2 * ((size_t)y * now->width + x)];
            to[0] = to[1] = NAN;
            if (background ? !has_sky : !by->has_motion) continue;
            const double* way = background ? sky.of : by->to_before.of;
            const double at_x = x + 0.5 + now->jitter_x, at_y = y + 0.5 + now->jitter_y;
            const double from[3] = {2 * at_x / now->width - 1, 1 - 2 * at_y / now->height, ndc_depth(by, value)};
            double clip[4];
            for (int row = 0; row < 4; ++row)
                clip[row] = way[row] * from[0] + way[4 + row] * from[1] + way[8 + row] * from[2] + way[12 + row];
            const int is_before_camera = clip[3] > 0;
            const double before_x = (clip[0] / clip[3] + 1) / 2 * now->width;
            const double before_y = (1 - clip[1] / clip[3]) / 2 * now->height;
            if (is_before_camera) {
                to[0] = (float)(before_x - at_x);
                to[1] = (float)(before_y - at_y);
            }
            if (by != &all.of[0] || x % 8 != 4 || y % 8 != 4) continue;
            ++seen.looked;
            /* w is the distance of then over that of now, for the inverse of the projection has divided by that. */
            const double distance = background ? INFINITY : clip[3] * distance_of(by, value);
            seen.agreed += is_before_camera && agrees(now, before_distances, before_x, before_y, distance);
        }
    return 4 * seen.agreed < seen.looked;
}
