#include "share/layout.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "share/error.h"

_Static_assert(sizeof(struct share_frame_header) <= SHARE_PAGE_BYTES, "user data follow a page after it");

enum { MOST_SIDE = 32768, MOST_SLOTS = 8, MOST_CHANNELS = 4 };
static const size_t most_slot_bytes = (size_t)1 << 30;
static const size_t most_user_bytes = (size_t)1 << 20;

static const struct {
    const char* name;
    int channels; /* at least */
    int is_real;  /* not u8 */
    int as_color; /* of the colour's size */
} kinds[CLARUS_SHARE_KINDS] = {
    [CLARUS_SHARE_COLOR] = {"color", 3, 0, 1},
    [CLARUS_SHARE_DEPTH] = {"depth", 1, 0, 1},
    [CLARUS_SHARE_MOTION] = {"motion", 2, 1, 1},
    [CLARUS_SHARE_REACTIVE_MASK] = {"reactive_mask", 1, 0, 1},
    [CLARUS_SHARE_TRANSPARENCY_MASK] = {"transparency_mask", 1, 0, 1},
    [CLARUS_SHARE_OPAQUE_COLOR] = {"opaque_color", 3, 0, 1},
    [CLARUS_SHARE_HUDLESS_COLOR] = {"hudless_color", 3, 0, 0},
    [CLARUS_SHARE_UI] = {"ui", 4, 0, 0},
    [CLARUS_SHARE_EXPOSURE] = {"exposure", 1, 0, 0},
    [CLARUS_SHARE_DISTORTION] = {"distortion", 4, 1, 0},
};

const char* clarus_share_kind_name(clarus_share_kind kind) {
    return (int)kind >= 0 && kind < CLARUS_SHARE_KINDS ? kinds[kind].name : NULL;
}

clarus_share_description clarus_share_default_description(void) {
    clarus_share_description description;
    memset(&description, 0, sizeof description);
    description.slots = 3;
    description.motion_scale_x = description.motion_scale_y = 1;
    return description;
}

/* Of each clarus_element_type; channels: of a packed one. */
static const struct {
    const char* name;
    size_t bytes; /* of a component, or of a packed pixel */
    int channels;
} elements[] = {
    [CLARUS_U8] = {"u8", 1, 0},   [CLARUS_F16] = {"f16", 2, 0},         [CLARUS_F32] = {"f32", 4, 0},
    [CLARUS_U16] = {"u16", 2, 0}, [CLARUS_RGB10A2] = {"rgb10a2", 4, 4}, [CLARUS_R11G11B10F] = {"r11g11b10f", 4, 3},
    [CLARUS_D24] = {"d24", 4, 1},
};
enum { ELEMENTS = sizeof elements / sizeof *elements };

size_t share_tight_pitch(clarus_format format, int width) {
    const size_t components = elements[format.type].channels ? 1 : (size_t)format.channels;
    return elements[format.type].bytes * components * (size_t)width;
}

static size_t whole_pages(size_t bytes) { return (bytes + SHARE_PAGE_BYTES - 1) / SHARE_PAGE_BYTES * SHARE_PAGE_BYTES; }

int share_is_of_render_size(clarus_share_kind kind) { return kinds[kind].as_color; }

static clarus_share_status check_resource(int kind, clarus_share_resource* resource,
                                          const clarus_share_resource* color) {
    const char* name = kinds[kind].name;
    const int type = (int)resource->format.type;
    if (type < 0 || type >= ELEMENTS)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%s: element type %d; they are from u8 (0) to d24 (%d)", name,
                          type, ELEMENTS - 1);
    if (kinds[kind].is_real && type != CLARUS_F16 && type != CLARUS_F32)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%s: %s; possible are f16 and f32", name, elements[type].name);
    if (resource->format.channels < kinds[kind].channels || resource->format.channels > MOST_CHANNELS)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%s: %d channels; from %d to %d are possible", name,
                          resource->format.channels, kinds[kind].channels, MOST_CHANNELS);
    if (elements[type].channels && resource->format.channels != elements[type].channels)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%s: %d channels; %s has %d", name, resource->format.channels,
                          elements[type].name, elements[type].channels);
    if (resource->width < 1 || resource->height < 1 || resource->width > MOST_SIDE || resource->height > MOST_SIDE)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%s: %dx%d pixels; each side is from 1 to %d", name,
                          resource->width, resource->height, MOST_SIDE);
    if (kinds[kind].as_color && (resource->width != color->width || resource->height != color->height))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%s: %dx%d pixels where the colour has %dx%d", name,
                          resource->width, resource->height, color->width, color->height);
    const size_t tight = share_tight_pitch(resource->format, resource->width);
    if (resource->row_pitch == 0) resource->row_pitch = tight;
    if (resource->row_pitch < tight || resource->row_pitch % elements[type].bytes != 0 ||
        resource->row_pitch > most_slot_bytes)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT,
                          "%s: row pitch %zu; at least a row's %zu bytes, in whole elements, to 1 GiB", name,
                          resource->row_pitch, tight);
    return CLARUS_SHARE_OK;
}

static clarus_share_status check_rest(const clarus_share_description* description) {
    if (description->slots < 2 || description->slots > MOST_SLOTS)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%d slots; from 2 to %d are possible", description->slots,
                          MOST_SLOTS);
    const int policy = (int)description->policy;
    if (policy != CLARUS_SHARE_EVERY_FRAME && policy != CLARUS_SHARE_NEWEST_FRAME)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "policy %d; there are every frame (%d) and newest frame (%d)",
                          policy, CLARUS_SHARE_EVERY_FRAME, CLARUS_SHARE_NEWEST_FRAME);
    const int flags[] = {
        description->linear_color,    description->depth_projective,         description->depth_reversed,
        description->motion_jittered, description->motion_sampled_at_jitter, description->dynamic_resolution};
    static const char* const names[] = {"linear_color",    "depth_projective",         "depth_reversed",
                                        "motion_jittered", "motion_sampled_at_jitter", "dynamic_resolution"};
    for (size_t i = 0; i < sizeof flags / sizeof *flags; ++i)
        if (flags[i] != 0 && flags[i] != 1)
            return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%s is %d; it is 0 or 1", names[i], flags[i]);
    if (!isfinite(description->motion_scale_x) || !isfinite(description->motion_scale_y))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "motion_scale (%g, %g) is not finite",
                          (double)description->motion_scale_x, (double)description->motion_scale_y);
    if (description->scale != 0 && !(description->scale >= 1 && description->scale <= MOST_SIDE))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "scale %g; from 1, or 0 where none is asked for",
                          (double)description->scale);
    const int width = description->output_width, height = description->output_height;
    if ((width != 0 || height != 0) && (width < 1 || height < 1 || width > MOST_SIDE || height > MOST_SIDE))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "output size %dx%d; each side is from 1 to %d, or both are 0",
                          width, height, MOST_SIDE);
    if (description->user_bytes > most_user_bytes)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%zu bytes of user data a frame; at most %zu are possible",
                          description->user_bytes, most_user_bytes);
    return CLARUS_SHARE_OK;
}

clarus_share_status share_lay_out(clarus_share_description* description, struct share_layout* layout) {
    memset(layout, 0, sizeof *layout);
    clarus_share_status status = check_rest(description);
    if (status != CLARUS_SHARE_OK) return status;
    size_t end = SHARE_PAGE_BYTES + whole_pages(description->user_bytes);
    for (int kind = 0; kind < CLARUS_SHARE_KINDS; ++kind) {
        clarus_share_resource* resource = &description->resources[kind];
        if (kind != CLARUS_SHARE_COLOR && resource->width == 0) {
            memset(resource, 0, sizeof *resource);
            continue;
        }
        status = check_resource(kind, resource, &description->resources[CLARUS_SHARE_COLOR]);
        if (status != CLARUS_SHARE_OK) return status;
        layout->image_offset[kind] = end;
        end += whole_pages(resource->row_pitch * (size_t)resource->height);
        if (end > most_slot_bytes)
            return share_fail(CLARUS_SHARE_INVALID_ARGUMENT,
                              "a frame's images up to %s, %dx%d pixels, take %zu MiB; a slot holds at most 1024 MiB",
                              kinds[kind].name, resource->width, resource->height, end >> 20);
    }
    layout->slot_bytes = end;
    layout->bytes = end * (size_t)description->slots;
    return CLARUS_SHARE_OK;
}

static int is_matrix(const float* values) {
    for (int i = 0; i < 16; ++i)
        if (!isfinite(values[i])) return 0;
    return 1;
}

clarus_share_status share_check_frame(const clarus_share_description* description, const clarus_share_frame* frame) {
    const clarus_share_resource* color = &description->resources[CLARUS_SHARE_COLOR];
    const int is_whole = frame->width == color->width && frame->height == color->height;
    if (!is_whole && !description->dynamic_resolution)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT,
                          "frame size %dx%d; the stream's is %dx%d, unless it has dynamic resolution", frame->width,
                          frame->height, color->width, color->height);
    if (frame->width < 1 || frame->height < 1 || frame->width > color->width || frame->height > color->height)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "frame size %dx%d; must be from 1x1 to the stream's %dx%d",
                          frame->width, frame->height, color->width, color->height);
    if (!(fabsf(frame->jitter_x) <= 1 && fabsf(frame->jitter_y) <= 1))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "jitter (%g, %g); each must be from -1 to 1 render pixel",
                          (double)frame->jitter_x, (double)frame->jitter_y);
    if (!(frame->exposure > 0) || !isfinite(frame->exposure))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "exposure %g; must be greater than 0",
                          (double)frame->exposure);
    if (!(frame->near_plane >= 0) || !isfinite(frame->near_plane) || !(frame->far_plane >= 0) ||
        (description->depth_projective && !(frame->near_plane > 0 && frame->far_plane > frame->near_plane)))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "near %g, far %g: must be 0 < near < far",
                          (double)frame->near_plane, (double)frame->far_plane);
    if (!(frame->fov_y >= 0 && frame->fov_y < 3.15f))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "fov_y %g; radians, less than half a turn",
                          (double)frame->fov_y);
    if (!(frame->frame_seconds >= 0) || !isfinite(frame->frame_seconds))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "frame_seconds %g; must not be negative",
                          (double)frame->frame_seconds);
    if (!isfinite(frame->motion_scale_x) || !isfinite(frame->motion_scale_y))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "motion_scale (%g, %g) is not finite",
                          (double)frame->motion_scale_x, (double)frame->motion_scale_y);
    if ((frame->reset != 0 && frame->reset != 1) || (frame->has_matrices != 0 && frame->has_matrices != 1))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "reset %d, has_matrices %d; each is 0 or 1", frame->reset,
                          frame->has_matrices);
    if (frame->has_matrices && !(is_matrix(frame->view) && is_matrix(frame->projection)))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "a matrix holds what is not finite");
    if (frame->user_bytes > description->user_bytes)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%zu bytes of user data; the stream has room for %zu",
                          frame->user_bytes, description->user_bytes);
    return CLARUS_SHARE_OK;
}

void share_point_into_slot(const clarus_share_description* description, const struct share_layout* layout,
                           unsigned char* memory, clarus_share_frame* frame) {
    unsigned char* slot = memory + (size_t)frame->slot * layout->slot_bytes;
    frame->user = description->user_bytes > 0 ? slot + SHARE_PAGE_BYTES : NULL;
    for (int kind = 0; kind < CLARUS_SHARE_KINDS; ++kind) {
        const clarus_share_resource* resource = &description->resources[kind];
        clarus_share_image* image = &frame->images[kind];
        memset(image, 0, sizeof *image);
        if (layout->image_offset[kind] == 0) continue;
        image->pixels = slot + layout->image_offset[kind];
        image->row_pitch = resource->row_pitch;
        image->format = resource->format;
        image->width = kinds[kind].as_color ? frame->width : resource->width;
        image->height = kinds[kind].as_color ? frame->height : resource->height;
    }
}

void share_describe_to_wire(const clarus_share_description* description, const struct share_layout* layout,
                            struct share_stream_packet* packet) {
    for (int kind = 0; kind < CLARUS_SHARE_KINDS; ++kind) {
        const clarus_share_resource* resource = &description->resources[kind];
        packet->resources[kind] =
            (struct share_wire_resource){(uint32_t)resource->format.type, (uint32_t)resource->format.channels,
                                         (uint32_t)resource->width, (uint32_t)resource->height, resource->row_pitch};
    }
    packet->slots = (uint32_t)description->slots;
    packet->policy = (uint32_t)description->policy;
    packet->linear_color = (uint32_t)description->linear_color;
    packet->depth_projective = (uint32_t)description->depth_projective;
    packet->depth_reversed = (uint32_t)description->depth_reversed;
    packet->motion_jittered = (uint32_t)description->motion_jittered;
    packet->motion_sampled_at_jitter = (uint32_t)description->motion_sampled_at_jitter;
    packet->motion_scale_x = description->motion_scale_x;
    packet->motion_scale_y = description->motion_scale_y;
    packet->scale = description->scale;
    packet->output_width = (uint32_t)description->output_width;
    packet->output_height = (uint32_t)description->output_height;
    packet->dynamic_resolution = (uint32_t)description->dynamic_resolution;
    packet->user_bytes = description->user_bytes;
    packet->slot_bytes = layout->slot_bytes;
}

/* What does not fit becomes what no check lets pass. */
static int whole(uint32_t value) { return value > INT_MAX ? -1 : (int)value; }

clarus_share_description share_description_from_wire(const struct share_stream_packet* packet) {
    clarus_share_description description = clarus_share_default_description();
    for (int kind = 0; kind < CLARUS_SHARE_KINDS; ++kind) {
        const struct share_wire_resource* from = &packet->resources[kind];
        description.resources[kind] = (clarus_share_resource){{(clarus_element_type)from->type, whole(from->channels)},
                                                              whole(from->width),
                                                              whole(from->height),
                                                              (size_t)from->row_pitch};
    }
    description.slots = whole(packet->slots);
    description.policy = (clarus_share_policy)packet->policy;
    description.linear_color = whole(packet->linear_color);
    description.depth_projective = whole(packet->depth_projective);
    description.depth_reversed = whole(packet->depth_reversed);
    description.motion_jittered = whole(packet->motion_jittered);
    description.motion_sampled_at_jitter = whole(packet->motion_sampled_at_jitter);
    description.motion_scale_x = packet->motion_scale_x;
    description.motion_scale_y = packet->motion_scale_y;
    description.scale = packet->scale;
    description.output_width = whole(packet->output_width);
    description.output_height = whole(packet->output_height);
    description.dynamic_resolution = whole(packet->dynamic_resolution);
    description.user_bytes = (size_t)packet->user_bytes;
    return description;
}

void share_frame_to_wire(const clarus_share_frame* frame, uint64_t index, struct share_frame_header* header) {
    header->index = index;
    header->number = frame->number;
    header->user_bytes = frame->user_bytes;
    header->width = (uint32_t)frame->width;
    header->height = (uint32_t)frame->height;
    header->jitter_x = frame->jitter_x;
    header->jitter_y = frame->jitter_y;
    header->exposure = frame->exposure;
    header->near_plane = frame->near_plane;
    header->far_plane = frame->far_plane;
    header->fov_y = frame->fov_y;
    header->frame_seconds = frame->frame_seconds;
    header->motion_scale_x = frame->motion_scale_x;
    header->motion_scale_y = frame->motion_scale_y;
    header->reset = (uint32_t)frame->reset;
    header->has_matrices = (uint32_t)frame->has_matrices;
    memcpy(header->view, frame->view, sizeof header->view);
    memcpy(header->projection, frame->projection, sizeof header->projection);
    header->reserved = 0;
}

void share_frame_from_wire(const struct share_frame_header* header, clarus_share_frame* frame) {
    frame->number = header->number;
    frame->user_bytes = (size_t)header->user_bytes;
    frame->width = whole(header->width);
    frame->height = whole(header->height);
    frame->jitter_x = header->jitter_x;
    frame->jitter_y = header->jitter_y;
    frame->exposure = header->exposure;
    frame->near_plane = header->near_plane;
    frame->far_plane = header->far_plane;
    frame->fov_y = header->fov_y;
    frame->frame_seconds = header->frame_seconds;
    frame->motion_scale_x = header->motion_scale_x;
    frame->motion_scale_y = header->motion_scale_y;
    frame->reset = whole(header->reset);
    frame->has_matrices = whole(header->has_matrices);
    memcpy(frame->view, header->view, sizeof frame->view);
    memcpy(frame->projection, header->projection, sizeof frame->projection);
}
