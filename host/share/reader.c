/* The upscaler's side. Nothing that the renderer wrote is used before it was copied and checked. */

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

/* How often it is looked whether somebody listens now: nothing tells when a socket appears. */
enum { LOOK_MS = 20 };

struct clarus_share_reader {
    char name[128];
    int cancel;
    int cancelled; /* set by any thread */

    clarus_share_description description;
    struct share_layout layout;
    int has_greeted;          /* and waits for the answer */
    int socket;               /* -1 once the renderer has left, or was left; what it made ready can still be taken */
    clarus_share_status left; /* then: ENDED, GONE, PROTOCOL or REFUSED */
    int ready_event, free_event;
    void* memory;
    void* pages;

    uint64_t next;     /* every frame: the index of the next frame to take */
    uint64_t seen;     /* every frame: ready, as last seen. Newest frame: the word taken last */
    uint64_t released; /* every frame: how many. Newest frame: as of the last */
    uint64_t skipped;
    uint64_t number; /* of the frame taken last */
    int is_first;    /* the next frame is the connection's first */
    int held;
    char message[SHARE_TEXT_BYTES];
};

static const struct share_publisher_page* publisher_page(const clarus_share_reader* reader) { return reader->pages; }
static struct share_reader_page* own_page(const clarus_share_reader* reader) {
    return (struct share_reader_page*)((unsigned char*)reader->pages + SHARE_PAGE_BYTES);
}
static int takes_every_frame(const clarus_share_reader* reader) {
    return reader->description.policy == CLARUS_SHARE_EVERY_FRAME;
}

static void disconnect(clarus_share_reader* reader) {
    share_close(&reader->socket);
    share_close(&reader->ready_event);
    share_close(&reader->free_event);
    share_unmap(&reader->memory, reader->layout.bytes);
    share_unmap(&reader->pages, 2 * SHARE_PAGE_BYTES);
    reader->held = 0;
}

/* Tells the renderer; the last error says what it did. */
static clarus_share_status leave_liar(clarus_share_reader* reader) {
    share_leave_word(reader->socket, SHARE_NONSENSE, clarus_share_last_error());
    share_close(&reader->socket);
    return reader->left = CLARUS_SHARE_PROTOCOL;
}

/* A number from the renderer was out of range; what it was is the last error. */
static clarus_share_status as_protocol_error(const char* what) {
    return share_fail(CLARUS_SHARE_PROTOCOL, "%s that cannot be: %s", what, clarus_share_last_error());
}

/* ---- connecting ---- */

/* Waits for the socket, or nothing where it is -1, and for being cancelled. */
static clarus_share_status wait_for(clarus_share_reader* reader, int socket, int timeout_ms) {
    struct pollfd events[] = {{reader->cancel, POLLIN, 0}, {socket, POLLIN, 0}};
    if (poll(events, 2, timeout_ms) < 0 && errno != EINTR && errno != EAGAIN)
        return share_fail(CLARUS_SHARE_SYSTEM, "cannot wait for the renderer: %s", strerror(errno));
    if (__atomic_load_n(&reader->cancelled, __ATOMIC_SEQ_CST))
        return share_fail(CLARUS_SHARE_CANCELLED, "the wait for the renderer was cancelled");
    return CLARUS_SHARE_OK;
}

static clarus_share_status accept_stream(clarus_share_reader* reader, const struct share_stream_packet* packet,
                                         size_t came, int* descriptors, int descriptor_count) {
    clarus_share_status status = share_check_head(&packet->head, came, SHARE_STREAM, sizeof *packet);
    if (status != CLARUS_SHARE_OK) return status;
    if (descriptor_count != SHARE_DESCRIPTORS)
        return share_fail(CLARUS_SHARE_PROTOCOL, "a stream with %d descriptors where %d are due", descriptor_count,
                          SHARE_DESCRIPTORS);
    reader->description = share_description_from_wire(packet);
    status = share_lay_out(&reader->description, &reader->layout);
    if (status != CLARUS_SHARE_OK) return as_protocol_error("a stream");
    if (packet->slot_bytes != reader->layout.slot_bytes || packet->reserved != 0)
        return share_fail(CLARUS_SHARE_PROTOCOL, "a stream whose slots have %llu bytes where %zu follow from it",
                          (unsigned long long)packet->slot_bytes, reader->layout.slot_bytes);
    status = share_map_memory("frames", descriptors[0], reader->layout.bytes, 0, &reader->memory);
    if (status == CLARUS_SHARE_OK)
        status = share_map_memory("control pages", descriptors[1], 2 * SHARE_PAGE_BYTES, 1, &reader->pages);
    if (status == CLARUS_SHARE_OK) status = share_check_event(descriptors[2]);
    if (status == CLARUS_SHARE_OK) status = share_check_event(descriptors[3]);
    if (status != CLARUS_SHARE_OK) return status;
    reader->ready_event = descriptors[2];
    reader->free_event = descriptors[3];
    descriptors[2] = descriptors[3] = -1;

    reader->next = reader->seen = reader->released = 0;
    if (takes_every_frame(reader))
        reader->next = reader->seen = reader->released = share_load(&own_page(reader)->released);
    reader->is_first = 1;
    reader->left = CLARUS_SHARE_OK;
    reader->message[0] = '\0';
    return CLARUS_SHARE_OK;
}

/* The answer to hello. GONE where the renderer died meanwhile. */
static clarus_share_status hear_answer(clarus_share_reader* reader) {
    union {
        struct share_stream_packet stream;
        struct share_leave leave;
    } packet;
    int descriptors[SHARE_DESCRIPTORS] = {-1, -1, -1, -1}, count = 0;
    const ssize_t came = share_receive(reader->socket, &packet, sizeof packet, descriptors, SHARE_DESCRIPTORS, &count);
    if (came < 0) return CLARUS_SHARE_TIMED_OUT;
    if (came == 0) return share_fail(CLARUS_SHARE_GONE, "the renderer of the stream %s has gone", reader->name);
    clarus_share_status status;
    share_words(&packet.leave, (size_t)came, reader->message);
    const int is_leave = (size_t)came == sizeof packet.leave && packet.leave.head.magic == SHARE_MAGIC &&
                         packet.leave.head.type == SHARE_LEAVE;
    if (is_leave && packet.leave.reason != SHARE_OTHER_VERSION)
        status = share_fail(CLARUS_SHARE_REFUSED, "the renderer of the stream %s refuses: %s", reader->name,
                            reader->message);
    else
        status = accept_stream(reader, &packet.stream, (size_t)came, descriptors, count);
    if (status == CLARUS_SHARE_PROTOCOL) share_leave_word(reader->socket, SHARE_NONSENSE, clarus_share_last_error());
    for (int i = 0; i < SHARE_DESCRIPTORS; ++i) share_close(&descriptors[i]);
    return status;
}

static clarus_share_status greet(clarus_share_reader* reader) {
    const struct share_hello hello = {share_make_head(SHARE_HELLO, sizeof hello)};
    if (share_send(reader->socket, &hello, sizeof hello, NULL, 0) != 0)
        return share_fail(CLARUS_SHARE_GONE, "the renderer of the stream %s has gone", reader->name);
    reader->has_greeted = 1;
    return CLARUS_SHARE_OK;
}

static clarus_share_status await_answer(clarus_share_reader* reader, int64_t deadline) {
    for (;;) {
        clarus_share_status status = wait_for(reader, reader->socket, share_left(deadline));
        if (status == CLARUS_SHARE_OK) status = hear_answer(reader);
        if (status != CLARUS_SHARE_TIMED_OUT) return status;
        if (share_left(deadline) == 0)
            return share_fail(CLARUS_SHARE_TIMED_OUT, "the renderer of the stream %s does not answer", reader->name);
    }
}

clarus_share_status clarus_share_reader_connect(clarus_share_reader* reader, int timeout_ms) {
    const int64_t deadline = share_deadline(timeout_ms);
    /* A renderer that takes long for a frame answers when it is done: a greeting stands until then. */
    if (!reader->has_greeted) disconnect(reader);
    for (;;) {
        clarus_share_status status = CLARUS_SHARE_OK;
        if (!reader->has_greeted) {
            status = share_connect(reader->name, SHARE_FRAMES_SUFFIX, &reader->socket);
            if (status == CLARUS_SHARE_OK) status = greet(reader);
        }
        if (status == CLARUS_SHARE_OK) status = await_answer(reader, deadline);
        if (status == CLARUS_SHARE_TIMED_OUT && reader->has_greeted) return status;
        reader->has_greeted = 0;
        if (status == CLARUS_SHARE_OK) return status;
        disconnect(reader);
        const int left = share_left(deadline);
        const int passes = status == CLARUS_SHARE_NO_STREAM || status == CLARUS_SHARE_GONE ||
                           status == CLARUS_SHARE_TIMED_OUT; /* too many connected at once */
        if (!passes || left == 0) return status;
        const clarus_share_status waited = wait_for(reader, -1, left < 0 || left > LOOK_MS ? LOOK_MS : left);
        if (waited != CLARUS_SHARE_OK) return waited;
    }
}

/* ---- frames ---- */

/* What there is to take: 1, 0, or -1 where the renderer's number cannot be. */
static int look(clarus_share_reader* reader, uint64_t* ready) {
    *ready = share_load(&publisher_page(reader)->ready);
    const uint64_t slots = (uint64_t)reader->description.slots;
    if (takes_every_frame(reader)) {
        if (*ready < reader->seen || *ready - reader->released > slots) {
            share_fail(CLARUS_SHARE_PROTOCOL, "%llu frames ready after %llu, of which %llu are released: of %d slots",
                       (unsigned long long)*ready, (unsigned long long)reader->seen,
                       (unsigned long long)reader->released, reader->description.slots);
            return -1;
        }
        reader->seen = *ready;
        return reader->next < *ready;
    }
    if (*ready == reader->seen || *ready == 0) return 0;
    if (*ready >> SHARE_SLOT_BITS <= reader->seen >> SHARE_SLOT_BITS ||
        share_word_slot(*ready) >= reader->description.slots) {
        share_fail(CLARUS_SHARE_PROTOCOL, "a newest frame %llx that cannot be, after %llx", (unsigned long long)*ready,
                   (unsigned long long)reader->seen);
        return -1;
    }
    return 1;
}

/* Newest frame: says that it is being read, and then makes sure that it was not overwritten before that was said. */
static int claim(clarus_share_reader* reader, uint64_t* word) {
    for (;;) {
        share_store(&own_page(reader)->taken, *word);
        if (share_load(&publisher_page(reader)->ready) == *word) return 1;
        const int found = look(reader, word);
        if (found < 0) return -1;
        if (found == 0) return 0; /* it went back to what was seen: the next look tells */
    }
}

static clarus_share_status read_slot(clarus_share_reader* reader, uint64_t index, int slot, clarus_share_frame* frame) {
    struct share_frame_header header;
    const unsigned char* at = (const unsigned char*)reader->memory + (size_t)slot * reader->layout.slot_bytes;
    memcpy(&header, at, sizeof header);
    memset(frame, 0, sizeof *frame);
    frame->slot = slot;
    share_frame_from_wire(&header, frame);
    if (header.index != index || header.reserved != 0)
        return share_fail(CLARUS_SHARE_PROTOCOL, "frame %llu in the slot of frame %llu",
                          (unsigned long long)header.index, (unsigned long long)index);
    if (share_check_frame(&reader->description, frame) != CLARUS_SHARE_OK) return as_protocol_error("a frame");
    share_point_into_slot(&reader->description, &reader->layout, reader->memory, frame);
    if (reader->is_first || frame->number != reader->number + 1) frame->reset = 1;
    reader->number = frame->number;
    reader->is_first = 0;
    ++reader->held;
    return CLARUS_SHARE_OK;
}

static clarus_share_status take(clarus_share_reader* reader, uint64_t ready, clarus_share_frame* frame) {
    if (takes_every_frame(reader)) {
        const uint64_t index = reader->next++;
        return read_slot(reader, index, (int)(index % (uint64_t)reader->description.slots), frame);
    }
    const uint64_t index = share_word_index(ready);
    const uint64_t before = reader->seen == 0 ? index : share_word_index(reader->seen) + 1;
    reader->skipped += index - before;
    reader->seen = ready;
    return read_slot(reader, index, share_word_slot(ready), frame);
}

/* A renderer that left may have ended frames before. */
static void hear_renderer(clarus_share_reader* reader) {
    struct share_leave packet;
    const ssize_t came = share_receive(reader->socket, &packet, sizeof packet, NULL, 0, NULL);
    if (came < 0) return;
    reader->left = CLARUS_SHARE_GONE;
    share_words(&packet, came > 0 ? (size_t)came : 0, reader->message);
    if ((size_t)came == sizeof packet && packet.head.magic == SHARE_MAGIC && packet.head.type == SHARE_LEAVE)
        reader->left = packet.reason == SHARE_ENDS ? CLARUS_SHARE_ENDED : CLARUS_SHARE_REFUSED;
    share_close(&reader->socket);
}

static clarus_share_status tell_left(const clarus_share_reader* reader) {
    switch (reader->left) {
        case CLARUS_SHARE_ENDED:
            return share_fail(CLARUS_SHARE_ENDED, "the renderer closed the stream %s", reader->name);
        case CLARUS_SHARE_REFUSED:
            return share_fail(CLARUS_SHARE_REFUSED, "the renderer of the stream %s left this upscaler: %s",
                              reader->name, reader->message);
        case CLARUS_SHARE_PROTOCOL:
            return share_fail(CLARUS_SHARE_PROTOCOL, "the renderer of the stream %s was left, for what it said",
                              reader->name);
        default:
            return share_fail(CLARUS_SHARE_GONE, "the renderer of the stream %s has gone", reader->name);
    }
}

static clarus_share_status wait_events(clarus_share_reader* reader, int timeout_ms) {
    enum { CANCEL, READY, SOCKET, COUNT };
    struct pollfd events[COUNT] = {
        {reader->cancel, POLLIN, 0}, {reader->ready_event, POLLIN, 0}, {reader->socket, POLLIN, 0}};
    if (poll(events, COUNT, timeout_ms) < 0 && errno != EINTR && errno != EAGAIN)
        return share_fail(CLARUS_SHARE_SYSTEM, "cannot wait for the renderer: %s", strerror(errno));
    if (events[READY].revents) share_silence(reader->ready_event);
    if (events[SOCKET].revents) hear_renderer(reader);
    return CLARUS_SHARE_OK;
}

clarus_share_status clarus_share_reader_wait(clarus_share_reader* reader, int timeout_ms, clarus_share_frame* frame) {
    if (!reader->pages) return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "the reader is not connected");
    if (reader->held >= (takes_every_frame(reader) ? reader->description.slots : 1))
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "%d frames are held; release one before the next",
                          reader->held);
    const int64_t deadline = share_deadline(timeout_ms);
    for (;;) {
        if (__atomic_load_n(&reader->cancelled, __ATOMIC_SEQ_CST))
            return share_fail(CLARUS_SHARE_CANCELLED, "the wait for the renderer was cancelled");
        if (reader->left == CLARUS_SHARE_PROTOCOL || reader->left == CLARUS_SHARE_REFUSED) return tell_left(reader);
        const clarus_share_status left = reader->left; /* before the last look */
        uint64_t ready = 0;
        int found = look(reader, &ready);
        if (found > 0 && !takes_every_frame(reader)) found = claim(reader, &ready);
        if (found < 0) return leave_liar(reader);
        if (found > 0) {
            const clarus_share_status status = take(reader, ready, frame);
            return status == CLARUS_SHARE_PROTOCOL ? leave_liar(reader) : status;
        }
        if (left != CLARUS_SHARE_OK) return tell_left(reader);
        const int remaining = share_left(deadline);
        const clarus_share_status status = wait_events(reader, remaining);
        if (status != CLARUS_SHARE_OK) return status;
        if (remaining == 0 && reader->left == CLARUS_SHARE_OK && look(reader, &ready) == 0)
            return share_fail(CLARUS_SHARE_TIMED_OUT, "no frame of the stream %s came in time", reader->name);
    }
}

int clarus_share_reader_ready(const clarus_share_reader* reader) {
    if (!reader->pages || reader->left != CLARUS_SHARE_OK) return 1;
    const uint64_t ready = share_load(&publisher_page(reader)->ready);
    return takes_every_frame(reader) ? ready != reader->next : ready != 0 && ready != reader->seen;
}

clarus_share_status clarus_share_reader_release(clarus_share_reader* reader) {
    if (reader->held == 0) return share_fail(CLARUS_SHARE_INVALID_ARGUMENT, "no frame is held");
    --reader->held;
    if (takes_every_frame(reader)) {
        share_store(&own_page(reader)->released, ++reader->released);
    } else {
        reader->released = share_word_index(reader->seen) + 1;
        share_store(&own_page(reader)->released, reader->seen);
        share_store(&own_page(reader)->taken, 0);
    }
    share_ring(reader->free_event);
    return CLARUS_SHARE_OK;
}

/* ---- the rest ---- */

clarus_share_status clarus_share_reader_open(const char* name, clarus_share_reader** result) {
    *result = NULL;
    clarus_share_reader* reader = calloc(1, sizeof *reader);
    if (!reader) return share_fail(CLARUS_SHARE_SYSTEM, "out of memory");
    reader->socket = reader->ready_event = reader->free_event = -1;
    clarus_share_status status = share_check_name(name);
    if (status == CLARUS_SHARE_OK) snprintf(reader->name, sizeof reader->name, "%s", name);
    reader->cancel = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (status == CLARUS_SHARE_OK && reader->cancel < 0)
        status = share_fail(CLARUS_SHARE_SYSTEM, "cannot make an eventfd: %s", strerror(errno));
    if (status == CLARUS_SHARE_OK)
        *result = reader;
    else
        clarus_share_reader_close(reader);
    return status;
}

const clarus_share_description* clarus_share_reader_description(const clarus_share_reader* reader) {
    return &reader->description;
}

const void* clarus_share_reader_memory(const clarus_share_reader* reader, size_t* slot_bytes) {
    *slot_bytes = reader->layout.slot_bytes;
    return reader->memory;
}

void clarus_share_reader_refuse(clarus_share_reader* reader, const char* why) {
    if (reader->socket < 0) return;
    share_leave_word(reader->socket, SHARE_REFUSES, why);
    share_close(&reader->socket);
    reader->left = CLARUS_SHARE_GONE;
}

void clarus_share_reader_cancel(clarus_share_reader* reader) {
    __atomic_store_n(&reader->cancelled, 1, __ATOMIC_SEQ_CST);
    share_ring(reader->cancel);
}

clarus_share_state clarus_share_reader_state(const clarus_share_reader* reader) {
    const uint64_t newest = reader->seen == 0 ? 0 : share_word_index(reader->seen) + 1;
    return (clarus_share_state){reader->socket >= 0, takes_every_frame(reader) ? reader->seen : newest,
                                reader->released, reader->skipped, reader->message};
}

void clarus_share_reader_close(clarus_share_reader* reader) {
    if (!reader) return;
    if (reader->socket >= 0) share_leave_word(reader->socket, SHARE_ENDS, "");
    disconnect(reader);
    share_close(&reader->cancel);
    free(reader);
}

void share_reader_events(const clarus_share_reader* reader, int* descriptors) {
    descriptors[0] = reader->ready_event;
    descriptors[1] = reader->socket;
}
