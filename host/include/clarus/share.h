#ifndef CLARUS_SHARE_H
#define CLARUS_SHARE_H

/* Frames shared with an upscaler in another process of the same user and machine (docs/sharing.md). A renderer links
   libclarus_share, which needs libc alone:

       clarus_share_open      once: the stream's name and what a frame holds
       clarus_share_begin     waits for a free slot and tells where its images lie
       clarus_share_copy      into them, where the renderer cannot draw there itself
       clarus_share_end       with the camera's parameters: the frame is ready
       clarus_share_close

   and an upscaler takes frames by the functions clarus_share_reader_… Either side may start first, die and come back.

   Functions that return clarus_share_status return CLARUS_SHARE_OK or what went wrong, and clarus_share_last_error()
   then tells it in words. Time limits are in milliseconds; 0 does not wait, CLARUS_SHARE_NO_LIMIT waits for ever. A
   stream or reader is used by one thread at a time, except for its cancel function. */

#include <stddef.h>
#include <stdint.h>

#include "clarus/format.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CLARUS_SHARE_NO_LIMIT (-1)

#if defined(__GNUC__)
#pragma GCC visibility push(default)
#endif

typedef enum clarus_share_status {
    CLARUS_SHARE_OK,
    CLARUS_SHARE_INVALID_ARGUMENT,
    CLARUS_SHARE_NAME_IN_USE, /* another renderer has a stream of this name */
    CLARUS_SHARE_NO_STREAM,   /* nobody has a stream of this name */
    CLARUS_SHARE_REFUSED,     /* the other side does not want this one, and said why */
    CLARUS_SHARE_VERSION,     /* the other side speaks another version of the protocol */
    CLARUS_SHARE_TIMED_OUT,
    CLARUS_SHARE_CANCELLED,
    CLARUS_SHARE_ENDED,    /* the renderer closed the stream, and all its frames were taken */
    CLARUS_SHARE_GONE,     /* the renderer died, and all frames that it had said to be ready were taken */
    CLARUS_SHARE_PROTOCOL, /* the other side said what cannot be; it was left */
    CLARUS_SHARE_SYSTEM    /* memory, descriptors, the runtime folder */
} clarus_share_status;

/* What the last failed call of this thread was about. */
const char* clarus_share_last_error(void);

/* What a frame may hold: the union of what upscalers ask for. */
typedef enum clarus_share_kind {
    CLARUS_SHARE_COLOR,             /* at least 3 channels; the one that every stream has */
    CLARUS_SHARE_DEPTH,             /* 1 */
    CLARUS_SHARE_MOTION,            /* 2, f16 or f32 */
    CLARUS_SHARE_REACTIVE_MASK,     /* 1 */
    CLARUS_SHARE_TRANSPARENCY_MASK, /* 1; transparency and composition */
    CLARUS_SHARE_OPAQUE_COLOR,      /* 3; colour before what is transparent */
    CLARUS_SHARE_HUDLESS_COLOR,     /* 3; colour before the user interface; of any size, as are those below */
    CLARUS_SHARE_UI,                /* 4; the user interface and its alpha */
    CLARUS_SHARE_EXPOSURE,          /* 1 */
    CLARUS_SHARE_DISTORTION,        /* 4; bidirectional distortion field, f16 or f32 */
    CLARUS_SHARE_KINDS              /* how many there are */
} clarus_share_kind;

/* "color", "depth", "motion", … ; NULL of what is none. */
const char* clarus_share_kind_name(clarus_share_kind kind);

/* An image that every frame of the stream brings. Width 0: none does. */
typedef struct clarus_share_resource {
    clarus_format format; /* at most 4 channels */
    int width, height;    /* pixels, from 1 to 32768; those from depth to opaque colour have the colour's */
    size_t row_pitch;     /* bytes from row to row; 0: rows follow each other without a gap */
} clarus_share_resource;

typedef enum clarus_share_policy {
    CLARUS_SHARE_EVERY_FRAME, /* the renderer waits rather than lose one */
    CLARUS_SHARE_NEWEST_FRAME /* the renderer does not wait, given 3 slots; the upscaler skips what is older */
} clarus_share_policy;

/* What holds for the whole stream. Start from clarus_share_default_description(). */
typedef struct clarus_share_description {
    clarus_share_resource resources[CLARUS_SHARE_KINDS];
    int slots; /* 2 to 8; 3 unless told */
    clarus_share_policy policy;
    int linear_color; /* 0: display-encoded sRGB, 1: linear HDR */
    /* As in clarus/stream.h, DepthEncoding and MotionEncoding. */
    int depth_projective, depth_reversed;
    float motion_scale_x, motion_scale_y;
    int motion_jittered, motion_sampled_at_jitter;
    float scale; /* output over render size that the renderer asks for, from 1; 0: it does not say */
    int output_width, output_height; /* the display's, where that is not the render size times scale; else 0, 0 */
    int dynamic_resolution;          /* 1: frames may be rendered smaller than the colour is */
    size_t user_bytes;               /* the most that a frame brings of the renderer's own data; to 1 MiB */
} clarus_share_description;

clarus_share_description clarus_share_default_description(void);

typedef struct clarus_share_image {
    void* pixels; /* NULL where the stream has none; for the renderer to write, for the upscaler only to read */
    size_t row_pitch;
    clarus_format format;
    int width, height; /* of this frame */
} clarus_share_image;

/* One frame. clarus_share_begin fills all of it in; the renderer changes what is otherwise. */
typedef struct clarus_share_frame {
    clarus_share_image images[CLARUS_SHARE_KINDS];
    void* user; /* user_bytes of the description, of which this frame brings: */
    size_t user_bytes;
    int slot; /* from 0: a slot's images lie at the same addresses as long as the stream, or connection, lasts */

    /* The renderer counts frames, those that it does not share, too: where the number before is not that of the last
       frame shared, motion spans more than one frame and history is dropped. begin: one more than the last. */
    uint64_t number;
    int width, height;                    /* rendered; with dynamic resolution at most the colour's, in its corner */
    float jitter_x, jitter_y;             /* render pixels, from -1 to 1, as in clarus/stream.h, FrameParameters */
    float exposure;                       /* > 0; 1 unless told */
    float near_plane, far_plane;          /* view distances, needed where depth is projective; far may be infinite */
    float fov_y;                          /* radians; 0: not said */
    float frame_seconds;                  /* since the frame before; 0: not said */
    float motion_scale_x, motion_scale_y; /* the description's unless told: uv vectors of a smaller frame need theirs */
    int reset;                            /* a cut: history is dropped before the frame */
    int has_matrices;                     /* whether the two that follow are said */
    float view[16], projection[16];       /* row-major, without jitter */
} clarus_share_frame;

typedef struct clarus_share_state {
    int connected;
    uint64_t ready;      /* frames that were said to be ready */
    uint64_t released;   /* of those, how many the upscaler is done with, those that it skipped included */
    uint64_t skipped;    /* by the upscaler's newest-frame policy; told on its side */
    const char* message; /* why the other side left, in its words; empty where it said nothing. Until the next call */
} clarus_share_state;

/* ---- the renderer's side ---- */

typedef struct clarus_share_stream clarus_share_stream;

/* Opens a stream that upscalers of the same user find by `name`: letters, digits, '.', '_' and '-', to 64, not
   beginning with '.'. All its memory is taken here. */
clarus_share_status clarus_share_open(const char* name, const clarus_share_description* description,
                                      clarus_share_stream** stream);

/* Waits for a free slot. Also lets upscalers connect: it is called once a frame. Where it is called again without
   clarus_share_end, the same slot is begun anew. */
clarus_share_status clarus_share_begin(clarus_share_stream* stream, int timeout_ms, clarus_share_frame* frame);

/* Copies an image of the frame's width and height, which are set before, into the slot; `row_pitch` of the source, 0
 * where its rows have no gap. */
clarus_share_status clarus_share_copy(const clarus_share_frame* frame, clarus_share_kind kind, const void* pixels,
                                      size_t row_pitch);

/* The frame is ready. Where a parameter is out of range the slot stays begun. */
clarus_share_status clarus_share_end(clarus_share_stream* stream, const clarus_share_frame* frame);

/* Waits until an upscaler is done with all frames, or with the newest: before a renderer that ends closes. */
clarus_share_status clarus_share_drain(clarus_share_stream* stream, int timeout_ms);

/* Lets every wait, this one and later ones, end with CLARUS_SHARE_CANCELLED. From any thread or signal handler. */
void clarus_share_cancel(clarus_share_stream* stream);

clarus_share_state clarus_share_stream_state(const clarus_share_stream* stream);

/* NULL is allowed. An upscaler still takes the frames that are ready. */
void clarus_share_close(clarus_share_stream* stream);

/* ---- the upscaler's side ---- */

typedef struct clarus_share_reader clarus_share_reader;

/* Connects to nobody yet. */
clarus_share_status clarus_share_reader_open(const char* name, clarus_share_reader** reader);

/* Waits for the stream and connects, again after CLARUS_SHARE_GONE, ENDED or PROTOCOL; frames of an earlier connection
   are released. The renderer answers in its clarus_share_begin; after CLARUS_SHARE_TIMED_OUT the next call goes on
   waiting for that. The first frame resets. */
clarus_share_status clarus_share_reader_connect(clarus_share_reader* reader, int timeout_ms);

/* Of the stream connected to last, row pitches filled in. */
const clarus_share_description* clarus_share_reader_description(const clarus_share_reader* reader);

/* Where the slots of this connection lie, and how many bytes each has: memory that is only to be read. */
const void* clarus_share_reader_memory(const clarus_share_reader* reader, size_t* slot_bytes);

/* Whether clarus_share_reader_wait would return at once. */
int clarus_share_reader_ready(const clarus_share_reader* reader);

/* The next frame, or the newest. It stays as it is until it is released. Of EVERY_FRAME several may be held, to as many
   as there are slots; of NEWEST_FRAME one. */
clarus_share_status clarus_share_reader_wait(clarus_share_reader* reader, int timeout_ms, clarus_share_frame* frame);

/* Gives the oldest frame that is held back to the renderer. */
clarus_share_status clarus_share_reader_release(clarus_share_reader* reader);

/* Leaves the stream and tells the renderer why, in at most 255 bytes. */
void clarus_share_reader_refuse(clarus_share_reader* reader, const char* why);

/* As clarus_share_cancel. */
void clarus_share_reader_cancel(clarus_share_reader* reader);

clarus_share_state clarus_share_reader_state(const clarus_share_reader* reader);

/* NULL is allowed. */
void clarus_share_reader_close(clarus_share_reader* reader);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#ifdef __cplusplus
}
#endif

#endif
