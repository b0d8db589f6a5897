#ifndef CLARUS_SHARE_LAYOUT_H
#define CLARUS_SHARE_LAYOUT_H

/* What a stream may be, and where everything lies in a slot: computed by each side for itself, so that no offset comes
   from the other. */

#include "share/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

struct share_layout {
    size_t image_offset[CLARUS_SHARE_KINDS]; /* in a slot; 0 where the stream has none */
    size_t slot_bytes, bytes;
};

/* Checks all fields, fills in row pitches that are 0, and lays out. */
clarus_share_status share_lay_out(clarus_share_description* description, struct share_layout* layout);

/* Checks what a frame says of itself, whoever said it. */
clarus_share_status share_check_frame(const clarus_share_description* description, const clarus_share_frame* frame);

/* Points the frame's images and user data into its slot, whose number and sizes are in it. */
void share_point_into_slot(const clarus_share_description* description, const struct share_layout* layout,
                           unsigned char* memory, clarus_share_frame* frame);

void share_describe_to_wire(const clarus_share_description* description, const struct share_layout* layout,
                            struct share_stream_packet* packet);
/* Unchecked: share_lay_out follows. */
clarus_share_description share_description_from_wire(const struct share_stream_packet* packet);

void share_frame_to_wire(const clarus_share_frame* frame, uint64_t index, struct share_frame_header* header);
/* Unchecked: share_check_frame follows. */
void share_frame_from_wire(const struct share_frame_header* header, clarus_share_frame* frame);

/* Whether such an image has the size that frames are rendered at. */
int share_is_of_render_size(clarus_share_kind kind);

/* Bytes of a row without what the pitch adds. */
size_t share_tight_pitch(clarus_format format, int width);

#ifdef __cplusplus
}
#endif

#endif
