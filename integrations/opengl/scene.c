#include "scene.h"

#include <math.h>
#include <string.h>

#include "matrix.h"

static layer* layer_of(scene* counted, const float range[2]) {
    for (int i = 0; i < counted->layer_count; ++i)
        if (memcmp(counted->layers[i].range, range, sizeof counted->layers[i].range) == 0) return &counted->layers[i];
    if (counted->layer_count == SCENE_LAYERS) return NULL;
    layer* added = &counted->layers[counted->layer_count++];
    memcpy(added->range, range, sizeof added->range);
    added->view_count = 0;
    return added;
}

void scene_count(scene* counted, const float projection[16], const float model_view[16], const float range[2]) {
    if (range[0] == range[1]) return;
    layer* in = layer_of(counted, range);
    if (!in) return;
    for (int i = 0; i < in->view_count; ++i) {
        view* known = &in->views[i];
        if (memcmp(known->model_view, model_view, sizeof known->model_view) != 0) continue;
        if (memcmp(known->projection, projection, sizeof known->projection) != 0) continue;
        ++known->draws;
        return;
    }
    /* Once there is no room, the last one's place is taken by all that come: what is used much has come before. */
    view* added = &in->views[in->view_count == SCENE_VIEWS ? SCENE_VIEWS - 1 : in->view_count++];
    memcpy(added->projection, projection, sizeof added->projection);
    memcpy(added->model_view, model_view, sizeof added->model_view);
    added->draws = 1;
}

const layer* scene_world(const scene* counted) {
    const layer* widest = NULL;
    for (int i = 0; i < counted->layer_count; ++i) {
        const layer* other = &counted->layers[i];
        if (!widest || fabsf(other->range[1] - other->range[0]) > fabsf(widest->range[1] - widest->range[0]))
            widest = other;
    }
    return widest;
}

static const view* most_used(const layer* of, int only_rigid) {
    const view* most = NULL;
    for (int i = 0; i < of->view_count; ++i) {
        const view* other = &of->views[i];
        if ((!most || other->draws > most->draws) && (!only_rigid || is_rigid(other->model_view))) most = other;
    }
    return most;
}

const view* scene_camera(const scene* counted) {
    const layer* world = scene_world(counted);
    return world ? most_used(world, 1) : NULL;
}

const view* layer_main_view(const layer* of) { return most_used(of, 0); }

const layer* scene_layer_like(const scene* counted, const layer* like) {
    for (int i = 0; i < counted->layer_count; ++i)
        if (memcmp(counted->layers[i].range, like->range, sizeof like->range) == 0) return &counted->layers[i];
    return NULL;
}

const view* layer_nearest_view(const layer* of, const view* to) {
    const view* nearest = NULL;
    double least = 0;
    for (int i = 0; i < of->view_count; ++i) {
        double distance = 0;
        for (int k = 0; k < 16; ++k) {
            const double difference = (double)of->views[i].model_view[k] - to->model_view[k];
            distance += difference * difference;
        }
        if (nearest && distance >= least) continue;
        nearest = &of->views[i];
        least = distance;
    }
    return nearest;
}
