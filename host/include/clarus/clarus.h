#ifndef CLARUS_H
#define CLARUS_H

/* The library for C, and for whatever calls C. It says what the C++ headers beside it say, which document every field:
   device.h, model.h, stream.h, upscaler.h, interpolator.h, types.h. Functions that return clarus_status return
   CLARUS_OK or what went wrong, and clarus_last_error() then tells it in words. Start structs from
   clarus_default_options() and clarus_default_frame().
   A pointer that is NULL where it may not be is CLARUS_INVALID_ARGUMENT; functions without a status return 0 or NULL
   then, or do nothing, as they do for an index that is too large.
 */

#include <stddef.h>

#include "clarus/format.h"
#include "clarus/version.h"

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#pragma GCC visibility push(default)
#endif

typedef struct _cl_context* cl_context;
typedef struct _cl_device_id* cl_device_id;
typedef struct _cl_command_queue* cl_command_queue;
typedef struct _cl_mem* cl_mem;
typedef struct _cl_event* cl_event;

typedef struct clarus_device clarus_device;
typedef struct clarus_model clarus_model;
typedef struct clarus_upscaler clarus_upscaler;
typedef struct clarus_interpolator clarus_interpolator;
typedef struct clarus_list clarus_list; /* of words */

typedef enum clarus_status {
    CLARUS_OK,
    CLARUS_INVALID_ARGUMENT,
    CLARUS_FILE,
    CLARUS_NO_DEVICE,
    CLARUS_BUILD,
    CLARUS_OUT_OF_MEMORY,
    CLARUS_DEVICE,
    CLARUS_INTERNAL
} clarus_status;

typedef enum clarus_precision { CLARUS_FP32, CLARUS_FP16, CLARUS_AUTOMATIC, CLARUS_BF16 } clarus_precision;
typedef enum clarus_tuning { CLARUS_STORED, CLARUS_MEASURE, CLARUS_FIXED, CLARUS_OBVIOUS } clarus_tuning;
typedef enum clarus_log_level { CLARUS_LOG_DEBUG, CLARUS_LOG_INFO, CLARUS_LOG_WARNING } clarus_log_level;

/* A setting of the model's pipeline (clarus_model_option) and what it is to be. */
typedef struct clarus_pipeline_option {
    const char* name;
    double value;
} clarus_pipeline_option;

/* This one and clarus_frame grow with versions, at their ends. `struct_size` is how much of it the program knows: the
   library takes what lies beyond to have its usual value, and refuses what it does not know itself and is set. */
typedef struct clarus_options {
    size_t struct_size;
    clarus_precision precision;
    clarus_tuning tuning;
    int linear_color; /* 0: display-encoded sRGB, 1: linear HDR */
    int depth_projective, depth_reversed;
    float motion_scale_x, motion_scale_y;
    int motion_jittered, motion_sampled_at_jitter;
    clarus_format color_format, depth_format, motion_format, output_format;
    int antialias_input, antialias; /* 0: none, 1: morphological, of the model's input and output */
    float sharpen;                  /* of the output, from 0 (off) to 1 */
    const clarus_pipeline_option* pipeline_options;
    size_t pipeline_option_count;
    int output_width, output_height; /* 0: the render size times the model's scale; set both or neither */
    int dynamic_resolution;          /* 1: frames may be rendered smaller, see clarus_frame */
    const char* placement;           /* of stages on several devices; NULL: "auto" */
    int fallback;                    /* 1: where a device fails, others go on */
    int profile;                     /* 1: time every stage, see clarus_upscaler_take_profile */
    int band_rows;                   /* 0: 32, where whole images would be large for the device */
    const char* const* views;        /* of clarus_upscaler_view_names: to keep readable */
    size_t view_count;
    clarus_format reactive_format, transparency_format; /* 0 channels: frames bring no such mask */
    clarus_format opaque_format, ui_format;             /* likewise of opaque_color and ui */
    int motion_width, motion_height; /* of motion images; 0: the frame's render size; set both or neither */
    clarus_format exposure_format;   /* 0 channels: frames bring no exposure_image */
    int automatic_exposure;
    int diagnose; /* 1: an upscaler's first frames are held against what is declared of them, see
                     UpscalerOptions::diagnose */
    int alpha;    /* 1: an upscaler's output has colour's alpha, see UpscalerOptions::alpha */
} clarus_options;

typedef struct clarus_option_description {
    const char *name, *help;
    double smallest, largest;
    double usual; /* its value unless told */
    int whole;    /* 1: whole numbers only */
} clarus_option_description;

/* One of `host`, `buffer` and `image` (an image object) is set. */
typedef struct clarus_image {
    void* host;
    cl_mem buffer, image;
    size_t offset, row_pitch;
    int width, height;
    int origin_x, origin_y; /* within a larger image, that of row_pitch or `image` */
} clarus_image;

/* Row-major matrices, without jitter. */
typedef struct clarus_camera {
    float view[16], projection[16];
    float near_plane, far_plane, fov_y;
} clarus_camera;

typedef struct clarus_frame {
    size_t struct_size;
    clarus_image color, depth, motion;
    float jitter_x, jitter_y;
    float exposure;
    float near_plane, far_plane;
    int reset;
    clarus_image output;
    int render_width, render_height;      /* of this frame; 0: the upscaler's */
    float motion_scale_x, motion_scale_y; /* of this frame; 0, 0: the options' */
    const cl_event* wait_for;
    size_t wait_for_count;
    clarus_image reactive_mask, transparency_mask, opaque_color, ui;
    const clarus_camera* camera; /* NULL: not told */
    clarus_image exposure_image;
    float frame_seconds; /* since the frame before */
} clarus_frame;

typedef struct clarus_memory {
    size_t weights, arena, peak_live_bytes, staging;
} clarus_memory;

/* Stages that one of several devices runs one after the other. */
typedef struct clarus_placed_part {
    int device; /* its number */
    const char* const* stages;
    size_t stage_count;
    double seconds;  /* a frame, as "auto" has measured; 0 where rules placed it */
    size_t bytes_in; /* a frame, of what other devices made */
} clarus_placed_part;

/* A stage's share of the frames since the profile was last taken. */
typedef struct clarus_span {
    int frame;
    double start, end; /* in seconds on the host's steady clock */
} clarus_span;

typedef struct clarus_stage_profile {
    const char *name, *kernel;
    int device; /* its number; -1: a transfer between two */
    double seconds, operations, bytes;
    const clarus_span* spans; /* one a launch */
    size_t span_count;
} clarus_stage_profile;

/* An intermediate of the last submitted frame: rows of interleaved floats. */
typedef struct clarus_view {
    int width, height, channels;
    int maps; /* 1: each channel is a picture of its own */
    const float* pixels;
} clarus_view;

typedef enum clarus_device_class { CLARUS_GPU, CLARUS_CPU, CLARUS_DSP } clarus_device_class;

/* DeviceProfile, which device.h documents. Its words live as long as the device. It grows as clarus_options does. */
typedef struct clarus_device_profile {
    size_t struct_size;
    const char *selector, *name, *vendor, *platform, *driver_version, *opencl_version;
    clarus_device_class device_class;
    int simulator, compute_units, clock_mhz, float_vector_width;
    size_t max_work_group_size, global_memory, max_allocation, local_memory, memory_alignment;
    int local_memory_is_dedicated, unified_memory, images, half_storage, half_arithmetic, int8_dot_product, vnni;
    int fast_fma, subgroups, sub_devices, gl_sharing, external_memory, bf16;
} clarus_device_profile;

/* What the last failed call of this thread was about. */
const char* clarus_last_error(void);

void clarus_set_log_callback(void (*callback)(clarus_log_level level, const char* message, void* user), void* user);

size_t clarus_list_count(const clarus_list* list);
/* `index` from 0 to less than the count. Lives as long as the list. */
const char* clarus_list_item(const clarus_list* list, size_t index);
void clarus_list_release(clarus_list* list);

/* The folder of compiled programs and measurements, as device.h tells; lives until the thread's next call. */
const char* clarus_cache_directory(void);

/* The selectors of every device of every platform. */
clarus_status clarus_list_devices(clarus_list** selectors);
clarus_status clarus_device_open(const char* selector, clarus_device** device);
clarus_status clarus_device_adopt(cl_context context, cl_device_id id, cl_command_queue queue, clarus_device** device);
/* Devices that work on networks together, in this order. */
clarus_status clarus_device_together(const clarus_device* const* devices, size_t count, clarus_device** device);
size_t clarus_device_count(const clarus_device* device);
/* What clarus_device_open takes to get this one again; `index` from 0 to less than the count. Lives as long as it. */
const char* clarus_device_selector(const clarus_device* device, size_t index);
/* `profile->struct_size` is to be set: sizeof *profile. */
clarus_status clarus_device_read_profile(const clarus_device* device, size_t index, clarus_device_profile* profile);
/* 1 where all devices are of one OpenCL context. */
int clarus_device_is_one_context(const clarus_device* device);
/* How many programs were compiled from source: 0 where the cache had them all. */
int clarus_device_programs_compiled(const clarus_device* device);
void clarus_device_release(clarus_device* device);

/* Of shipped models and of filters. */
clarus_status clarus_model_names(clarus_list** names);
/* A shipped model's or filter's name, or a file. `scale` is used by filters and by models of any scale. */
clarus_status clarus_model_find(const char* name_or_path, double scale, clarus_model** model);
/* The scales that it can be found with: one for a model that has its own; the largest of filters is infinite. */
void clarus_model_scales(const clarus_model* model, double* smallest, double* largest);
/* The options that the model's pipeline has of its own; `index` from 0 to less than the count. Their words live as long
   as the model. */
size_t clarus_model_option_count(const clarus_model* model);
clarus_option_description clarus_model_option(const clarus_model* model, size_t index);
/* These live as long as the model, as do the words of its metadata; NULL of a key that there is not. */
const char* clarus_model_name(const clarus_model* model);
const char* clarus_model_pipeline(const clarus_model* model);
double clarus_model_scale(const clarus_model* model);
clarus_status clarus_model_metadata_keys(const clarus_model* model, clarus_list** keys);
const char* clarus_model_metadata(const clarus_model* model, const char* key);
void clarus_model_release(clarus_model* model);

/* In render pixels, as jitter.h tells. */
clarus_status clarus_halton_jitter(int frame, int count, float* x, float* y);
clarus_status clarus_mnss_jitter(int frame, int scale, float* x, float* y);
clarus_status clarus_random_jitter(int frame, int scale, float* x, float* y);

/* As quality.h tells. */
clarus_status clarus_quality_modes(clarus_list** names);
clarus_status clarus_quality_scale(const char* mode, double* scale);
clarus_status clarus_quality_render_size(int output_width, int output_height, double scale, int* width, int* height);
clarus_status clarus_jitter_count(double scale, int* count);
clarus_status clarus_mip_bias(double scale, double* bias);

/* For what does not compile this header: `struct_size` bytes with their usual values, the size among them. */
void clarus_options_init(clarus_options* options, size_t struct_size);
void clarus_frame_init(clarus_frame* frame, size_t struct_size);

static inline clarus_options clarus_default_options(void) {
    clarus_options options;
    clarus_options_init(&options, sizeof options);
    return options;
}

static inline clarus_frame clarus_default_frame(void) {
    clarus_frame frame;
    clarus_frame_init(&frame, sizeof frame);
    return frame;
}

/* Device and model may be released afterwards. */
clarus_status clarus_upscaler_create(const clarus_device* device, const clarus_model* model, int render_width,
                                     int render_height, const clarus_options* options, clarus_upscaler** upscaler);
void clarus_upscaler_release(clarus_upscaler* upscaler);

void clarus_upscaler_output_size(const clarus_upscaler* upscaler, int* width, int* height);
/* Of a frame rendered at this size. */
clarus_status clarus_upscaler_output_size_of(const clarus_upscaler* upscaler, int render_width, int render_height,
                                             int* width, int* height);
clarus_memory clarus_upscaler_memory(const clarus_upscaler* upscaler);
/* 1 where frames must bring them. */
int clarus_upscaler_needs_depth(const clarus_upscaler* upscaler);
int clarus_upscaler_needs_motion(const clarus_upscaler* upscaler);
clarus_status clarus_upscaler_prepare(clarus_upscaler* upscaler);
/* `progress` is called with 0 to 1. */
clarus_status clarus_upscaler_prepare_with(clarus_upscaler* upscaler, void (*progress)(double part, void* user),
                                           void* user);

/* How several devices share the stages, after clarus_upscaler_prepare; 0 parts where there is one device. */
size_t clarus_upscaler_part_count(clarus_upscaler* upscaler);
/* Its words live until the parts are next counted. */
clarus_placed_part clarus_upscaler_part(const clarus_upscaler* upscaler, size_t index);
/* What a frame's stages would take on one of the devices alone; 0 where "auto" has not measured it. */
double clarus_upscaler_seconds_alone(const clarus_upscaler* upscaler, size_t device);

/* `done` may be NULL; else it receives an event that the caller releases with clReleaseEvent. */
clarus_status clarus_upscaler_submit(clarus_upscaler* upscaler, const clarus_frame* frame, cl_event* done);
/* Waits for the last submitted frame, for ever where an event of `wait_for` never completes. */
clarus_status clarus_upscaler_wait(clarus_upscaler* upscaler);
/* The same for so many seconds at most; `done` receives 1, or 0 where the frame is still under way. */
clarus_status clarus_upscaler_wait_for(clarus_upscaler* upscaler, double seconds, int* done);
void clarus_upscaler_reset(clarus_upscaler* upscaler);

/* 1 where the model keeps anything of earlier frames. */
int clarus_upscaler_keeps_history(const clarus_upscaler* upscaler);
/* What it keeps of them for the next, which lives until the next call. Waits for the frames that were submitted. */
clarus_status clarus_upscaler_save_history(clarus_upscaler* upscaler, const void** history, size_t* size);
/* Goes on after the frame that was the last when another upscaler of the same model, options and size, in another
   process, too, saved it: to the last bit on the same device. Prepares. */
clarus_status clarus_upscaler_restore_history(clarus_upscaler* upscaler, const void* history, size_t size);

/* Invalid motion vectors of the last submitted frame. Waits. */
clarus_status clarus_upscaler_invalid_motion_vectors(const clarus_upscaler* upscaler, unsigned* count);
/* The most that a frame's jitter was away from the nearest that the model has kernels for, in render pixels. */
double clarus_upscaler_largest_jitter_distance(const clarus_upscaler* upscaler);

clarus_status clarus_upscaler_view_names(const clarus_upscaler* upscaler, clarus_list** names);
/* Waits. The pixels live until the next view. */
clarus_status clarus_upscaler_view(clarus_upscaler* upscaler, const char* name, clarus_view* view);

/* Stages with their times since the last call, which live until the next; none unless options.profile. */
clarus_status clarus_upscaler_take_profile(clarus_upscaler* upscaler, const clarus_stage_profile** stages,
                                           size_t* count);

/* Makes the frame between each frame and the one before it, to be given what an upscaler made. Of the options, those of
   InterpolatorOptions count. The device may be released afterwards. */
clarus_status clarus_interpolator_create(const clarus_device* device, int render_width, int render_height,
                                         int output_width, int output_height, const clarus_options* options,
                                         clarus_interpolator** interpolator);
void clarus_interpolator_release(clarus_interpolator* interpolator);

clarus_memory clarus_interpolator_memory(const clarus_interpolator* interpolator);
clarus_status clarus_interpolator_prepare(clarus_interpolator* interpolator);
clarus_status clarus_interpolator_prepare_with(clarus_interpolator* interpolator,
                                               void (*progress)(double part, void* user), void* user);

/* `color` is the frame as it is shown, at output resolution. `done` as of clarus_upscaler_submit. */
clarus_status clarus_interpolator_submit(clarus_interpolator* interpolator, const clarus_frame* frame, cl_event* done);
/* As those of the upscaler. */
clarus_status clarus_interpolator_wait(clarus_interpolator* interpolator);
clarus_status clarus_interpolator_wait_for(clarus_interpolator* interpolator, double seconds, int* done);
void clarus_interpolator_reset(clarus_interpolator* interpolator);
clarus_status clarus_interpolator_save_history(clarus_interpolator* interpolator, const void** history, size_t* size);
clarus_status clarus_interpolator_restore_history(clarus_interpolator* interpolator, const void* history, size_t size);
clarus_status clarus_interpolator_take_profile(clarus_interpolator* interpolator, const clarus_stage_profile** stages,
                                               size_t* count);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#ifdef __cplusplus
}
#endif

#endif
