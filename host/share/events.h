#ifndef CLARUS_SHARE_EVENTS_H
#define CLARUS_SHARE_EVENTS_H

/* For a loop that waits for a stream or a reader and for other things at the same time. */

#include "clarus/share.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SHARE_STREAM_EVENTS = 4, SHARE_READER_EVENTS = 2 };

/* Descriptors to poll, -1 among them, until the next call of the stream's: readable where clarus_share_begin has
   something to do, whether a slot is free or not. */
void share_stream_events(const clarus_share_stream* stream, int* descriptors);

/* Likewise, where clarus_share_reader_wait has. */
void share_reader_events(const clarus_share_reader* reader, int* descriptors);

/* Closes a stream as if its renderer had died: the upscaler takes what is ready, and waits for the next stream. */
void share_stream_abandon(clarus_share_stream* stream);

#ifdef __cplusplus
}
#endif

#endif
