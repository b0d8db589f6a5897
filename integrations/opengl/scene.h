#ifndef CLARUS_OPENGL_SCENE_H
#define CLARUS_OPENGL_SCENE_H

/* Which matrices a frame was drawn with, and so which of them are the camera's. */

enum { SCENE_LAYERS = 4, SCENE_VIEWS = 64 };

typedef struct view {
    float projection[16], model_view[16];
    int draws;
} view;

/* What was drawn in one depth range. Games that keep the weapon in the player's hands out of walls draw it in a narrow
   one in front of the world's. */
typedef struct layer {
    float range[2]; /* the depth buffer's values of the near and the far plane */
    int view_count;
    view views[SCENE_VIEWS];
} layer;

typedef struct scene {
    int layer_count;
    layer layers[SCENE_LAYERS];
} scene;

/* One draw call more. A range of no depth, a sky's, is not counted. */
void scene_count(scene* counted, const float projection[16], const float model_view[16], const float range[2]);

/* The widest layer; NULL where nothing was counted. */
const layer* scene_world(const scene* counted);

/* The world's most used rigid view: what moves by itself, or is scaled, has a model-view of its own, and each fewer
   draws than the world. NULL where none is rigid. */
const view* scene_camera(const scene* counted);

/* The most used of a layer, rigid or not. */
const view* layer_main_view(const layer* of);

/* The layer of the same range; NULL where there is none. */
const layer* scene_layer_like(const scene* counted, const layer* like);

/* Of the layer's views the one whose model-view is nearest: the same part, a frame ago. */
const view* layer_nearest_view(const layer* of, const view* to);

#endif
