/* The renderer's side. It owns the slots, and listens: whoever is to upscale comes and fetches their descriptors. */

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "share/endpoint.h"
#include "share/error.h"
#include "share/events.h"
#include "share/layout.h"
#include "share/memory.h"
#include "share/peer.h"

/* Who connects and says nothing for so long is turned away, so that the next can come. */
enum { HELLO_MS = 1000, MOST_AT_DOOR = 8 };

struct clarus_share_stream {
    clarus_share_description description;
    struct share_layout layout;
    struct share_endpoint endpoint;
    int cancel;
    int cancelled; /* set by any thread */

    int frames;
    void* memory;

    uint64_t ready;    /* frames ended */
    uint64_t released; /* of them; newest frame: as of the last that was released */
    uint64_t newest;   /* newest frame: its word */
    uint64_t taken;    /* newest frame: the reader's word, as last seen */
    uint64_t number;   /* that the next frame has unless told */
    int begun;         /* slot; -1: none */

    int pending; /* connected, and has not said hello */
    int64_t pending_until;
    int reader; /* and what was made for it alone: a stalled reader of old writes where nobody looks */
    int control, ready_event, free_event;
    void* pages;
    char message[SHARE_TEXT_BYTES];
};

static struct share_publisher_page* own_page(const clarus_share_stream* stream) { return stream->pages; }
static const struct share_reader_page* reader_page(const clarus_share_stream* stream) {
    return (const struct share_reader_page*)((const unsigned char*)stream->pages + SHARE_PAGE_BYTES);
}
static int takes_every_frame(const clarus_share_stream* stream) {
    return stream->description.policy == CLARUS_SHARE_EVERY_FRAME;
}

static void disconnect(clarus_share_stream* stream) {
    share_close(&stream->reader);
    share_close(&stream->control);
    share_close(&stream->ready_event);
    share_close(&stream->free_event);
    share_unmap(&stream->pages, 2 * SHARE_PAGE_BYTES);
    stream->taken = 0;
}

static void drop(clarus_share_stream* stream, const char* why) {
    snprintf(stream->message, sizeof stream->message, "%s", why);
    share_leave_word(stream->reader, SHARE_NONSENSE, why);
    disconnect(stream);
}

/* Copies what the reader's page says, checked. */
static void look_at_reader(clarus_share_stream* stream) {
    if (!stream->pages) return;
    const uint64_t released = share_load(&reader_page(stream)->released);
    if (takes_every_frame(stream)) {
        if (released < stream->released || released > stream->ready)
            drop(stream, "it released frames that it cannot have had");
        else
            stream->released = released;
        return;
    }
    const uint64_t taken = share_load(&reader_page(stream)->taken);
    const uint64_t words[] = {taken, released};
    for (int i = 0; i < 2; ++i) {
        if (words[i] == 0 || (words[i] <= stream->newest && words[i] >> SHARE_SLOT_BITS != 0 &&
                              share_word_slot(words[i]) < stream->description.slots))
            continue;
        drop(stream, "it took a frame that there never was");
        return;
    }
    stream->taken = taken;
    if (released != 0) stream->released = share_word_index(released) + 1;
}

static int free_slot(const clarus_share_stream* stream) {
    const int slots = stream->description.slots;
    if (takes_every_frame(stream))
        return stream->ready - stream->released < (uint64_t)slots ? (int)(stream->ready % (uint64_t)slots) : -1;
    for (int slot = 0; slot < slots; ++slot) {
        const int is_newest = stream->newest != 0 && share_word_slot(stream->newest) == slot;
        const int is_taken = stream->taken != 0 && share_word_slot(stream->taken) == slot;
        if (!is_newest && !is_taken) return slot;
    }
    return -1;
}

/* ---- readers come and go ---- */

static clarus_share_status make_connection(clarus_share_stream* stream) {
    const clarus_share_status status =
        share_make_memory("clarus control", 2 * SHARE_PAGE_BYTES, 0, &stream->control, &stream->pages);
    if (status != CLARUS_SHARE_OK) return status;
    stream->ready_event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    stream->free_event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (stream->ready_event < 0 || stream->free_event < 0)
        return share_fail(CLARUS_SHARE_SYSTEM, "cannot make an eventfd: %s", strerror(errno));
    share_store(&own_page(stream)->ready, takes_every_frame(stream) ? stream->ready : stream->newest);
    if (takes_every_frame(stream))
        share_store((uint64_t*)&reader_page(stream)->released, stream->released); /* what the last one released */
    return CLARUS_SHARE_OK;
}

/* The pending one becomes the reader. */
static void welcome(clarus_share_stream* stream) {
    struct share_stream_packet packet;
    memset(&packet, 0, sizeof packet);
    packet.head = share_make_head(SHARE_STREAM, sizeof packet);
    share_describe_to_wire(&stream->description, &stream->layout, &packet);
    clarus_share_status status = make_connection(stream);
    if (status == CLARUS_SHARE_OK) {
        const int descriptors[SHARE_DESCRIPTORS] = {stream->frames, stream->control, stream->ready_event,
                                                    stream->free_event};
        stream->reader = stream->pending;
        stream->pending = -1;
        stream->message[0] = '\0';
        if (share_send(stream->reader, &packet, sizeof packet, descriptors, SHARE_DESCRIPTORS) != 0) disconnect(stream);
        return;
    }
    snprintf(stream->message, sizeof stream->message, "%s", clarus_share_last_error());
    share_leave_word(stream->pending, SHARE_REFUSES, stream->message);
    share_close(&stream->pending);
    disconnect(stream);
}

static void hear_pending(clarus_share_stream* stream) {
    struct share_hello hello;
    const ssize_t came = share_receive(stream->pending, &hello, sizeof hello, NULL, 0, NULL);
    if (came < 0) return;
    const char* why = NULL;
    uint32_t reason = SHARE_NONSENSE;
    if (came > 0) {
        const clarus_share_status status = share_check_head(&hello.head, (size_t)came, SHARE_HELLO, sizeof hello);
        if (status == CLARUS_SHARE_OK && stream->reader < 0) {
            welcome(stream);
            return;
        }
        reason = status == CLARUS_SHARE_OK        ? SHARE_REFUSES
                 : status == CLARUS_SHARE_VERSION ? SHARE_OTHER_VERSION
                                                  : SHARE_NONSENSE;
        why = status == CLARUS_SHARE_OK ? "the stream has an upscaler already" : clarus_share_last_error();
    }
    if (why) share_leave_word(stream->pending, reason, why);
    share_close(&stream->pending);
}

/* Whoever waits at the door, until one has not spoken yet: those that have gone again hold up nobody. */
static void open_door(clarus_share_stream* stream) {
    for (int i = 0; i < MOST_AT_DOOR && stream->pending < 0; ++i) {
        stream->pending = share_accept(stream->endpoint.socket);
        if (stream->pending < 0) return;
        stream->pending_until = share_now() + HELLO_MS;
        hear_pending(stream);
    }
}

static void hear_reader(clarus_share_stream* stream) {
    struct share_leave packet;
    const ssize_t came = share_receive(stream->reader, &packet, sizeof packet, NULL, 0, NULL);
    if (came < 0) return;
    look_at_reader(stream); /* for the last time */
    if (stream->reader < 0) return;
    share_words(&packet, came > 0 ? (size_t)came : 0, stream->message);
    disconnect(stream);
}

/* Handles what has happened, having waited for it as long as `timeout_ms` or the pending reader allows. */
static clarus_share_status attend(clarus_share_stream* stream, int timeout_ms) {
    enum { CANCEL, FREE, READER, PENDING, LISTENER, COUNT };
    struct pollfd events[COUNT] = {{stream->cancel, POLLIN, 0},
                                   {stream->free_event, POLLIN, 0},
                                   {stream->reader, POLLIN, 0},
                                   {stream->pending, POLLIN, 0},
                                   {stream->pending < 0 ? stream->endpoint.socket : -1, POLLIN, 0}};
    if (stream->pending >= 0) {
        const int patience = share_left(stream->pending_until);
        if (timeout_ms < 0 || timeout_ms > patience) timeout_ms = patience;
    }
    if (poll(events, COUNT, timeout_ms) < 0 && errno != EINTR && errno != EAGAIN)
        return share_fail(CLARUS_SHARE_SYSTEM, "cannot wait for the upscaler: %s", strerror(errno));
    if (events[FREE].revents) share_silence(stream->free_event);
    if (events[READER].revents) hear_reader(stream);
    if (events[PENDING].revents)
        hear_pending(stream);
    else if (stream->pending >= 0 && share_left(stream->pending_until) == 0)
        share_close(&stream->pending);
    if (events[LISTENER].revents) open_door(stream);
    if (__atomic_load_n(&stream->cancelled, __ATOMIC_SEQ_CST))
        return share_fail(CLARUS_SHARE_CANCELLED, "the wait for the upscaler was cancelled");
    look_at_reader(stream);
    return CLARUS_SHARE_OK;
}

static clarus_share_status time_is_up(const clarus_share_stream* stream, const char* what) {
    return share_fail(CLARUS_SHARE_TIMED_OUT, "%s in time: %s%s%s", what,
                      stream->reader >= 0 ? "the upscaler is busy" : "there is no upscaler",
                      stream->message[0] ? "; the last one said: " : "", stream->message);
}

/* ---- the interface ---- */

clarus_share_status clarus_share_open(const char* name, const clarus_share_description* description,
                                      clarus_share_stream** result) {
    *result = NULL;
    clarus_share_stream* stream = calloc(1, sizeof *stream);
    if (!stream) return share_fail(CLARUS_SHARE_SYSTEM, "out of memory");
    stream->description = *description;
    stream->cancel = stream->frames = stream->pending = stream->reader = stream->begun = -1;
    stream->control = stream->ready_event = stream->free_event = stream->endpoint.socket = -1;
    clarus_share_status status = share_lay_out(&stream->description, &stream->layout);
    if (status == CLARUS_SHARE_OK)
        status = share_make_memory("clarus frames", stream->layout.bytes, 1, &stream->frames, &stream->memory);
    if (status == CLARUS_SHARE_OK && (stream->cancel = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) < 0)
        status = share_fail(CLARUS_SHARE_SYSTEM, "cannot make an eventfd: %s", strerror(errno));
    if (status == CLARUS_SHARE_OK) status = share_listen(name, SHARE_FRAMES_SUFFIX, &stream->endpoint);
    if (status == CLARUS_SHARE_OK)
        *result = stream;
    else
        clarus_share_close(stream);
    return status;
}

clarus_share_status clarus_share_begin(clarus_share_stream* stream, int timeout_ms, clarus_share_frame* frame) {
    const int64_t deadline = share_deadline(timeout_ms);
    clarus_share_status status = attend(stream, 0);
    for (int slot; status == CLARUS_SHARE_OK; status = attend(stream, share_left(deadline))) {
        if (stream->begun < 0 && (slot = free_slot(stream)) >= 0) stream->begun = slot;
        if (stream->begun >= 0) break;
        if (share_left(deadline) == 0) return time_is_up(stream, "no slot was free");
    }
    if (status != CLARUS_SHARE_OK) return status;
    memset(frame, 0, sizeof *frame);
    frame->slot = stream->begun;
    frame->number = stream->number;
    frame->width = stream->description.resources[CLARUS_SHARE_COLOR].width;
    frame->height = stream->description.resources[CLARUS_SHARE_COLOR].height;
    frame->exposure = 1;
    frame->motion_scale_x = stream->description.motion_scale_x;
    frame->motion_scale_y = stream->description.motion_scale_y;
    share_point_into_slot(&stream->description, &stream->layout, stream->memory, frame);
    return CLARUS_SHARE_OK;
}

clarus_share_status clarus_share_copy(const clarus_share_frame* frame, clarus_share_kind kind, const void* pixels,
                                      size_t row_pitch) {
    if ((int)kind < 0 || (int)kind >= CLARUS_SHARE_KINDS || !frame->images[kind].pixels)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "the stream has no resource %d", (int)kind);
    const clarus_share_image* image = &frame->images[kind];
    const int is_rendered = share_is_of_render_size(kind);
    const int width = is_rendered ? frame->width : image->width, height = is_rendered ? frame->height : image->height;
    if (width < 1 || height < 1 || width > image->width || height > image->height)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "frame size %dx%d; must be from 1x1 to the stream's %dx%d",
                          width, height, image->width, image->height);
    const size_t tight = share_tight_pitch(image->format, width);
    if (row_pitch == 0) row_pitch = tight;
    if (!pixels || row_pitch < tight)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "resource %d: row pitch %zu where a row has %zu bytes",
                          (int)kind, row_pitch, tight);
    if (row_pitch == tight && image->row_pitch == tight) {
        memcpy(image->pixels, pixels, tight * (size_t)height);
        return CLARUS_SHARE_OK;
    }
    for (int y = 0; y < height; ++y)
        memcpy((unsigned char*)image->pixels + (size_t)y * image->row_pitch,
               (const unsigned char*)pixels + (size_t)y * row_pitch, tight);
    return CLARUS_SHARE_OK;
}

clarus_share_status clarus_share_end(clarus_share_stream* stream, const clarus_share_frame* frame) {
    if (stream->begun < 0 || frame->slot != stream->begun)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "clarus_share_end without the frame of clarus_share_begin");
    const clarus_share_status status = share_check_frame(&stream->description, frame);
    if (status != CLARUS_SHARE_OK) return status;

    unsigned char* slot = (unsigned char*)stream->memory + (size_t)stream->begun * stream->layout.slot_bytes;
    share_frame_to_wire(frame, stream->ready, (struct share_frame_header*)slot);
    stream->newest = share_word(stream->ready, stream->begun);
    ++stream->ready;
    stream->number = frame->number + 1;
    stream->begun = -1;
    if (!stream->pages) return CLARUS_SHARE_OK;
    share_store(&own_page(stream)->ready, takes_every_frame(stream) ? stream->ready : stream->newest);
    share_ring(stream->ready_event);
    return CLARUS_SHARE_OK;
}

clarus_share_status clarus_share_drain(clarus_share_stream* stream, int timeout_ms) {
    const int64_t deadline = share_deadline(timeout_ms);
    clarus_share_status status = attend(stream, 0);
    while (status == CLARUS_SHARE_OK && stream->released != stream->ready) {
        if (share_left(deadline) == 0) return time_is_up(stream, "not all frames were taken");
        status = attend(stream, share_left(deadline));
    }
    return status;
}

void clarus_share_cancel(clarus_share_stream* stream) {
    __atomic_store_n(&stream->cancelled, 1, __ATOMIC_SEQ_CST);
    share_ring(stream->cancel);
}

clarus_share_state clarus_share_stream_state(const clarus_share_stream* stream) {
    return (clarus_share_state){stream->reader >= 0, stream->ready, stream->released, 0, stream->message};
}

void clarus_share_close(clarus_share_stream* stream) {
    if (!stream) return;
    if (stream->reader >= 0) share_leave_word(stream->reader, SHARE_ENDS, "the renderer closed the stream");
    disconnect(stream);
    share_close(&stream->pending);
    share_stop_listening(&stream->endpoint);
    share_unmap(&stream->memory, stream->layout.bytes);
    share_close(&stream->frames);
    share_close(&stream->cancel);
    free(stream);
}

void share_stream_events(const clarus_share_stream* stream, int* descriptors) {
    descriptors[0] = stream->free_event;
    descriptors[1] = stream->reader;
    descriptors[2] = stream->pending;
    descriptors[3] = stream->pending < 0 ? stream->endpoint.socket : -1;
}

void share_stream_abandon(clarus_share_stream* stream) {
    if (!stream) return;
    disconnect(stream);
    clarus_share_close(stream);
}
