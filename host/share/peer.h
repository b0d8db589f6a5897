#ifndef CLARUS_SHARE_PEER_H
#define CLARUS_SHARE_PEER_H

/* What both sides do alike. */

#include "share/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Milliseconds that count on, and those left to `deadline` for poll: -1 where that is -1, never less than 0. */
int64_t share_now(void);
int64_t share_deadline(int timeout_ms);
int share_left(int64_t deadline);

/* A packet of this type and version, of `bytes` in all; CLARUS_SHARE_VERSION or PROTOCOL where it is another. */
clarus_share_status share_check_head(const struct share_head* head, size_t came, uint32_t type, size_t bytes);
struct share_head share_make_head(uint32_t type, size_t bytes);

/* Tells the other side, as far as it listens, why this one goes. */
void share_leave_word(int socket, uint32_t reason, const char* text);

/* What was said in a packet, printable. Empty where it is no share_leave. */
void share_words(const struct share_leave* packet, size_t came, char* words);

/* Whether a descriptor that came from the other side is an eventfd; where it is, reading and writing it wait no more.
 */
clarus_share_status share_check_event(int descriptor);

/* One more thing to wake up for; and none any more. Neither waits. */
void share_ring(int event);
void share_silence(int event);

#ifdef __cplusplus
}
#endif

#endif
