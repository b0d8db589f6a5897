/* What the C interface tells of devices, models, frames and stages is what C++ tells. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "c_check.h"
#include "clarus/clarus.h"

enum { WIDTH = 13, HEIGHT = 9, SCALE = 2 };

static int contains(const clarus_list* list, const char* word) {
    size_t i;
    for (i = 0; i < clarus_list_count(list); ++i)
        if (strcmp(clarus_list_item(list, i), word) == 0) return 1;
    return 0;
}

static void keep_part(double part, void* user) { *(double*)user = part; }

int main(void) {
    static float color[WIDTH * HEIGHT * 3], depth[WIDTH * HEIGHT], motion[WIDTH * HEIGHT * 2];
    static float output[WIDTH * SCALE * HEIGHT * SCALE * 3];
    static unsigned char ui[WIDTH * SCALE * HEIGHT * SCALE * 4];
    const char* viewed[] = {"alpha"};
    clarus_device* device = NULL;
    clarus_model* model = NULL;
    clarus_upscaler* upscaler = NULL;
    clarus_list* list = NULL;
    clarus_device_profile profile;
    clarus_options options = clarus_default_options();
    clarus_frame frame = clarus_default_frame();
    clarus_camera camera;
    clarus_view view;
    const clarus_stage_profile* stages = NULL;
    double part = -1;
    double scale = 0;
    float x = 9, y = 9;
    int width = 0, height = 0, phases = 0;
    unsigned invalid = 9;
    size_t count = 0;

    CHECK(clarus_device_open(getenv("CLARUS_TEST_DEVICE"), &device) == CLARUS_OK);
    memset(&profile, 0xff, sizeof profile);
    profile.struct_size = 0;
    CHECK(clarus_device_read_profile(device, 0, &profile) == CLARUS_INVALID_ARGUMENT);
    profile.struct_size = offsetof(clarus_device_profile, sub_devices);
    CHECK(clarus_device_read_profile(device, 0, &profile) == CLARUS_OK);
    CHECK(strcmp(profile.selector, clarus_device_selector(device, 0)) == 0 && strlen(profile.name) > 0);
    CHECK(profile.compute_units >= 1 && profile.global_memory > 0 && profile.max_work_group_size >= 1);
    CHECK(profile.sub_devices == -1); /* beyond what was asked for */
    CHECK(clarus_device_read_profile(device, 1, &profile) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_device_is_one_context(device) == 1);
    CHECK(clarus_list_devices(&list) == CLARUS_OK);
    CHECK(contains(list, profile.selector) && clarus_list_item(list, clarus_list_count(list)) == NULL);
    clarus_list_release(list);
    CHECK(strlen(clarus_cache_directory()) > 0);

    CHECK(clarus_model_names(&list) == CLARUS_OK);
    CHECK(contains(list, "enss-s-x2") && contains(list, "bicubic"));
    clarus_list_release(list);
    CHECK(clarus_model_find(CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors", 2, &model) == CLARUS_OK);
    CHECK(strcmp(clarus_model_name(model), "enss_x2_table.model") == 0);
    CHECK(strcmp(clarus_model_pipeline(model), "enss") == 0 && clarus_model_scale(model) == 2);
    CHECK(clarus_model_metadata_keys(model, &list) == CLARUS_OK);
    CHECK(contains(list, "pipeline") && strcmp(clarus_model_metadata(model, "pipeline"), "enss") == 0);
    CHECK(clarus_model_metadata(model, "no such key") == NULL);
    clarus_list_release(list);

    CHECK(clarus_halton_jitter(0, 16, &x, &y) == CLARUS_OK && x == 0 && fabsf(y + 1.0f / 6) < 1e-6f);
    CHECK(clarus_halton_jitter(0, 0, &x, &y) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_mnss_jitter(0, 2, &x, &y) == CLARUS_OK && fabsf(x) == 0.25f && fabsf(y) == 0.25f);
    CHECK(clarus_mnss_jitter(0, 5, &x, &y) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_random_jitter(3, 2, &x, &y) == CLARUS_OK && fabsf(x) == 0.25f && fabsf(y) == 0.25f);

    CHECK(clarus_quality_modes(&list) == CLARUS_OK && contains(list, "performance"));
    clarus_list_release(list);
    CHECK(clarus_quality_scale("quality", &scale) == CLARUS_OK && scale == 1.5);
    CHECK(clarus_quality_scale("best", &scale) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "ultra_performance"));
    CHECK(clarus_quality_render_size(1920, 1080, 1.5, &width, &height) == CLARUS_OK && width == 1280 && height == 720);
    CHECK(clarus_jitter_count(2, &phases) == CLARUS_OK && phases == 32);
    CHECK(clarus_mip_bias(2, &scale) == CLARUS_OK && scale == -1);
    CHECK(clarus_mip_bias(0, &scale) == CLARUS_INVALID_ARGUMENT);

    options.reactive_format.type = CLARUS_F32;
    options.reactive_format.channels = 1;
    options.opaque_format.type = CLARUS_F32;
    options.opaque_format.channels = 3;
    options.ui_format.type = CLARUS_U8;
    options.ui_format.channels = 4;
    options.profile = 1;
    options.views = viewed;
    options.view_count = 1;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    CHECK(clarus_upscaler_needs_depth(upscaler) == 1 && clarus_upscaler_needs_motion(upscaler) == 1);
    CHECK(clarus_upscaler_view_names(upscaler, &list) == CLARUS_OK && contains(list, "alpha"));
    clarus_list_release(list);
    CHECK(clarus_upscaler_prepare_with(upscaler, keep_part, &part) == CLARUS_OK && part == 1);
    CHECK(clarus_device_programs_compiled(device) >= 0);

    frame.color.host = color;
    frame.depth.host = depth;
    frame.motion.host = motion;
    frame.output.host = output;
    frame.color.width = frame.depth.width = frame.motion.width = WIDTH;
    frame.color.height = frame.depth.height = frame.motion.height = HEIGHT;
    frame.output.width = WIDTH * SCALE;
    frame.output.height = HEIGHT * SCALE;
    frame.jitter_x = 0.11f;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "opaque_color"));
    frame.opaque_color = frame.color;
    frame.ui = frame.color;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "frame.ui"));
    frame.ui = frame.output;
    frame.ui.host = ui;
    memset(&camera, 0, sizeof camera);
    frame.camera = &camera;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    motion[0] = NAN;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_upscaler_invalid_motion_vectors(upscaler, &invalid) == CLARUS_OK && invalid == 1);
    CHECK(clarus_upscaler_largest_jitter_distance(upscaler) > 0.01);
    CHECK(clarus_upscaler_view(upscaler, "no such view", &view) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_view(upscaler, "alpha", &view) == CLARUS_OK);
    CHECK(view.width == WIDTH * SCALE && view.height == HEIGHT * SCALE && view.channels == 1);
    CHECK(view.pixels[0] >= 0 && view.pixels[0] <= 1);
    CHECK(clarus_upscaler_take_profile(upscaler, &stages, &count) == CLARUS_OK && count > 1);
    CHECK(strlen(stages[0].name) > 0 && stages[0].seconds > 0);
    CHECK(stages[0].span_count >= 2 && stages[0].spans[0].end > stages[0].spans[0].start);
    /* Masks are checked like other images. */
    frame.reactive_mask.host = depth;
    frame.reactive_mask.width = WIDTH + 1;
    frame.reactive_mask.height = HEIGHT;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "reactive_mask"));
    frame.reactive_mask.width = WIDTH;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    frame.transparency_mask = frame.reactive_mask;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "transparency_format"));
    clarus_upscaler_release(upscaler);
    clarus_model_release(model);
    clarus_device_release(device);
    return EXIT_SUCCESS;
}
