/* The C interface from C: a model runs, what it says of errors arrives. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "c_check.h"
#include "clarus/clarus.h"

enum { WIDTH = 13, HEIGHT = 9, SCALE = 2 };

int main(void) {
    static float color[WIDTH * HEIGHT * 3], depth[WIDTH * HEIGHT], motion[WIDTH * HEIGHT * 2];
    static float wide_motion[2 * WIDTH * HEIGHT * 2], exposure = 2;
    static float output[WIDTH * SCALE * HEIGHT * SCALE * 3], between[WIDTH * SCALE * HEIGHT * SCALE * 3];
    clarus_device *device = NULL, *both = NULL;
    const clarus_device* alone[2];
    clarus_placed_part part;
    clarus_model* model = NULL;
    clarus_upscaler* upscaler = NULL;
    clarus_interpolator* interpolator = NULL;
    clarus_options options = clarus_default_options();
    clarus_frame frame = clarus_default_frame();
    int width = 0, height = 0;
    double smallest = 0, largest = 0;
    clarus_option_description described;
    clarus_pipeline_option chosen[1];
    struct {
        clarus_options known;
        int added;
    } newer;
    const void* saved = NULL;
    size_t i, size = 0;

    CHECK(clarus_version() == CLARUS_VERSION && strcmp(clarus_version_string(), CLARUS_VERSION_STRING) == 0);
    CHECK(clarus_device_open("no such device", &device) == CLARUS_NO_DEVICE);
    CHECK(strstr(clarus_last_error(), "no such device"));
    CHECK(clarus_model_find("no-such-model", 2, &model) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_model_find("bicubic", 0.5, &model) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_model_find("bicubic", NAN, &model) == CLARUS_INVALID_ARGUMENT);

    CHECK(clarus_device_open(getenv("CLARUS_TEST_DEVICE"), &device) == CLARUS_OK);
    /* What a pipeline lets choose is listed, set by name, and checked. */
    CHECK(clarus_model_find("fsr1", 2, &model) == CLARUS_OK);
    clarus_model_scales(model, &smallest, &largest);
    CHECK(smallest == 1 && isinf(largest));
    CHECK(clarus_model_option_count(model) == 1);
    described = clarus_model_option(model, 0);
    CHECK(strcmp(described.name, "sharpness") == 0 && described.smallest == 0 && described.largest == 1);
    CHECK(described.usual == 0.87 && !described.whole && strlen(described.help) > 0);
    chosen[0].name = described.name;
    chosen[0].value = 2;
    options.pipeline_options = chosen;
    options.pipeline_option_count = 1;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "from 0 to 1"));
    chosen[0].value = 0.5;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    clarus_upscaler_release(upscaler);
    /* Structs of programs that know less, or more, than the library. */
    options.struct_size = 0;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "clarus_default_options"));
    options.struct_size = offsetof(clarus_options, pipeline_options);
    chosen[0].value = 2;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    clarus_upscaler_release(upscaler);
    clarus_options_init(&newer.known, sizeof newer);
    CHECK(newer.known.struct_size == sizeof newer && newer.added == 0);
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &newer.known, &upscaler) == CLARUS_OK);
    clarus_upscaler_release(upscaler);
    newer.added = 1;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &newer.known, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), CLARUS_VERSION_STRING));
    options.struct_size = sizeof options;
    chosen[0].value = 0.5;
    chosen[0].name = NULL;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_INVALID_ARGUMENT);
    options = clarus_default_options();
    options.output_width = WIDTH + 1;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "output size"));
    options.output_height = HEIGHT;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    clarus_upscaler_output_size(upscaler, &width, &height);
    CHECK(width == WIDTH + 1 && height == HEIGHT);
    clarus_upscaler_release(upscaler);
    options = clarus_default_options();
    clarus_model_release(model);

    CHECK(clarus_model_find(CLARUS_GOLDEN_DIR "/enss_x2_table.model.safetensors", 2, &model) == CLARUS_OK);
    clarus_model_scales(model, &smallest, &largest);
    CHECK(smallest == 2 && largest == 2 && clarus_model_option_count(model) == 0);
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    alone[0] = alone[1] = device;
    CHECK(clarus_device_count(device) == 1 && strlen(clarus_device_selector(device, 0)) > 0);
    CHECK(clarus_device_together(alone, 0, &both) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_device_together(alone, 2, &both) == CLARUS_OK);
    CHECK(clarus_device_count(both) == 2);
    CHECK(clarus_interpolator_create(device, WIDTH, HEIGHT, WIDTH - 1, HEIGHT, &options, &interpolator) ==
          CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_interpolator_create(device, WIDTH, HEIGHT, WIDTH * SCALE, HEIGHT * SCALE, &options, &interpolator) ==
          CLARUS_OK);
    clarus_upscaler_output_size(upscaler, &width, &height);
    CHECK(width == WIDTH * SCALE && height == HEIGHT * SCALE);
    CHECK(clarus_upscaler_memory(upscaler).arena > 0);
    CHECK(clarus_upscaler_prepare(upscaler) == CLARUS_OK);

    for (i = 0; i < WIDTH * HEIGHT * 3; ++i) color[i] = (float)(i % 7) / 7;
    for (i = 0; i < sizeof(output) / sizeof(*output); ++i) output[i] = -1;
    frame.color.host = color;
    frame.depth.host = depth;
    frame.motion.host = motion;
    frame.color.width = frame.depth.width = frame.motion.width = WIDTH;
    frame.color.height = frame.depth.height = frame.motion.height = HEIGHT;
    frame.output.width = width;
    frame.output.height = height;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "output"));
    frame.output.host = output;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_upscaler_wait(upscaler) == CLARUS_OK);
    for (i = 0; i < sizeof(output) / sizeof(*output); ++i) CHECK(output[i] >= 0 && output[i] <= 1);
    CHECK(clarus_upscaler_part_count(upscaler) == 0);

    /* What was saved after a frame is what the next one follows on, once more. */
    CHECK(clarus_upscaler_keeps_history(upscaler) == 1 && clarus_upscaler_keeps_history(NULL) == 0);
    CHECK(clarus_upscaler_save_history(upscaler, NULL, &size) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_save_history(upscaler, &saved, &size) == CLARUS_OK && size > 0);
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_upscaler_wait(upscaler) == CLARUS_OK);
    memcpy(between, output, sizeof(output));
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_upscaler_wait(upscaler) == CLARUS_OK);
    CHECK(memcmp(between, output, sizeof(output)) != 0);
    CHECK(clarus_upscaler_restore_history(upscaler, saved, size) == CLARUS_OK);
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_upscaler_wait(upscaler) == CLARUS_OK);
    CHECK(memcmp(between, output, sizeof(output)) == 0);
    CHECK(clarus_upscaler_restore_history(upscaler, saved, size - 1) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_upscaler_restore_history(upscaler, NULL, size) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "history"));
    CHECK(clarus_interpolator_save_history(interpolator, &saved, &size) == CLARUS_OK && size > 0);
    CHECK(clarus_upscaler_restore_history(upscaler, saved, size) == CLARUS_INVALID_ARGUMENT);
    CHECK(clarus_interpolator_restore_history(interpolator, saved, size) == CLARUS_OK);
    clarus_upscaler_release(upscaler);

    /* Exposure and vectors of another size. */
    options = clarus_default_options();
    options.linear_color = 1;
    options.motion_width = 2 * WIDTH;
    options.motion_height = HEIGHT;
    options.exposure_format.channels = 1;
    options.exposure_format.type = CLARUS_F32;
    options.diagnose = 1;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "frame.motion"));
    frame.motion.host = wide_motion;
    frame.motion.width = 2 * WIDTH;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "frame.exposure_image"));
    frame.exposure_image.host = &exposure;
    frame.exposure_image.width = frame.exposure_image.height = 1;
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_upscaler_wait(upscaler) == CLARUS_OK);
    clarus_upscaler_release(upscaler);
    options.automatic_exposure = 1;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "automatic_exposure"));
    options = clarus_default_options();
    options.alpha = 1;
    CHECK(clarus_upscaler_create(device, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "options.alpha: color_format has 3 channels"));
    CHECK(clarus_default_frame().frame_seconds == 1.0f / 60);
    clarus_device_release(device);
    frame.motion.host = motion;
    frame.motion.width = WIDTH;
    frame.exposure_image.host = NULL;
    options = clarus_default_options();

    /* Two devices, here one twice, share the stages. */
    options.fallback = 1;
    CHECK(clarus_upscaler_create(both, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    clarus_upscaler_release(upscaler);
    options.placement = "blend*=1";
    CHECK(clarus_upscaler_create(both, model, WIDTH, HEIGHT, &options, &upscaler) == CLARUS_OK);
    CHECK(clarus_upscaler_part_count(upscaler) >= 2);
    part = clarus_upscaler_part(upscaler, 0);
    CHECK(part.device == 0 && part.stage_count > 0 && strlen(part.stages[0]) > 0);
    CHECK(clarus_upscaler_seconds_alone(upscaler, 0) == 0); /* rules do not measure */
    CHECK(clarus_upscaler_submit(upscaler, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_upscaler_wait(upscaler) == CLARUS_OK);
    clarus_upscaler_release(upscaler);
    clarus_model_release(model);
    clarus_device_release(both);

    /* What does not move is in between what it is before and after. */
    frame.color.host = output;
    CHECK(clarus_interpolator_submit(interpolator, &frame, NULL) == CLARUS_INVALID_ARGUMENT);
    CHECK(strstr(clarus_last_error(), "color"));
    frame.color.width = width;
    frame.color.height = height;
    frame.output.host = between;
    CHECK(clarus_interpolator_memory(interpolator).arena > 0);
    CHECK(clarus_interpolator_prepare(interpolator) == CLARUS_OK);
    for (i = 0; i < 2; ++i) CHECK(clarus_interpolator_submit(interpolator, &frame, NULL) == CLARUS_OK);
    CHECK(clarus_interpolator_wait(interpolator) == CLARUS_OK);
    CHECK(memcmp(between, output, sizeof(output)) == 0);
    clarus_interpolator_reset(interpolator);
    clarus_interpolator_release(interpolator);
    return EXIT_SUCCESS;
}
