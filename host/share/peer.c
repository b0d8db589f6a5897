#include "share/peer.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "share/endpoint.h"
#include "share/error.h"

int64_t share_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

int64_t share_deadline(int timeout_ms) {
    if (timeout_ms < 0) return -1;
    return share_now() + timeout_ms + (timeout_ms > 0); /* a millisecond has begun already */
}

int share_left(int64_t deadline) {
    if (deadline < 0) return -1;
    const int64_t left = deadline - share_now();
    return left < 0 ? 0 : (int)left;
}

struct share_head share_make_head(uint32_t type, size_t bytes) {
    return (struct share_head){SHARE_MAGIC, SHARE_VERSION, type, (uint32_t)bytes};
}

clarus_share_status share_check_head(const struct share_head* head, size_t came, uint32_t type, size_t bytes) {
    if (came < sizeof *head || head->magic != SHARE_MAGIC)
        return share_fail(CLARUS_SHARE_PROTOCOL, "the other side does not speak Clarus's protocol");
    if (head->version != SHARE_VERSION)
        return share_fail(CLARUS_SHARE_VERSION, "the other side speaks version %u of the protocol, this one version %d",
                          head->version, SHARE_VERSION);
    if (head->type != type || head->bytes != bytes || came != bytes)
        return share_fail(CLARUS_SHARE_PROTOCOL, "a packet of type %u with %zu bytes where type %u with %zu was due",
                          head->type, came, type, bytes);
    return CLARUS_SHARE_OK;
}

void share_leave_word(int connection, uint32_t reason, const char* text) {
    struct share_leave packet;
    memset(&packet, 0, sizeof packet);
    packet.head = share_make_head(SHARE_LEAVE, sizeof packet);
    packet.reason = reason;
    snprintf(packet.text, sizeof packet.text, "%s", text);
    share_send(connection, &packet, sizeof packet, NULL, 0);
}

void share_words(const struct share_leave* packet, size_t came, char* words) {
    words[0] = '\0';
    if (came != sizeof *packet || packet->head.magic != SHARE_MAGIC || packet->head.type != SHARE_LEAVE) return;
    memcpy(words, packet->text, SHARE_TEXT_BYTES);
    words[SHARE_TEXT_BYTES - 1] = '\0';
    for (char* letter = words; *letter; ++letter)
        if ((unsigned char)*letter < ' ' || *letter == 127) *letter = '?';
}

/* Others would be read for ever, or end this process by a signal. */
clarus_share_status share_check_event(int descriptor) {
    static const char expected[] = "anon_inode:[eventfd]";
    char link[32], target[sizeof expected];
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    const ssize_t length = readlink(link, target, sizeof target);
    if (length != (ssize_t)sizeof expected - 1 || memcmp(target, expected, sizeof expected - 1) != 0)
        return share_fail(CLARUS_SHARE_PROTOCOL, "a descriptor to wake up by that is no eventfd");
    const int flags = fcntl(descriptor, F_GETFL);
    if (flags < 0 || fcntl(descriptor, F_SETFL, flags | O_NONBLOCK) != 0)
        return share_fail(CLARUS_SHARE_SYSTEM, "cannot set an eventfd's flags: %s", strerror(errno));
    return CLARUS_SHARE_OK;
}

void share_ring(int event) {
    const uint64_t one = 1;
    if (write(event, &one, sizeof one) < 0) return; /* full of wake-ups that were not seen yet */
}

void share_silence(int event) {
    uint64_t count;
    if (read(event, &count, sizeof count) < 0) return; /* nothing to take */
}
