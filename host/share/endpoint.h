#ifndef CLARUS_SHARE_ENDPOINT_H
#define CLARUS_SHARE_ENDPOINT_H

/* Sockets in the user's runtime folder: SOCK_SEQPACKET, mode 0600, one a stream and one for `clarus control`. */

#include <sys/types.h>
#include <sys/un.h>

#include "clarus/share.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A stream `game` listens on game.frames, the upscaler that serves it on game.control. */
#define SHARE_FRAMES_SUFFIX ".frames"
#define SHARE_CONTROL_SUFFIX ".control"

struct share_endpoint {
    int socket; /* -1: none */
    struct sockaddr_un address;
    dev_t device; /* of the socket's file, and */
    ino_t inode;
};

clarus_share_status share_check_name(const char* name);

/* Where sockets are: $XDG_RUNTIME_DIR/clarus, else /tmp/clarus-UID; made where it is missing. Refused where others than
   the user could use it. `size` of `path` is at least that of a sockaddr_un's. */
clarus_share_status share_runtime_folder(char* path, size_t size);

/* A file left by a process that died is replaced; NAME_IN_USE where one listens. */
clarus_share_status share_listen(const char* name, const char* suffix, struct share_endpoint* endpoint);
void share_stop_listening(struct share_endpoint* endpoint);

/* Does not wait. NO_STREAM where nobody listens. */
clarus_share_status share_connect(const char* name, const char* suffix, int* socket);

/* The next connection of a process of this user; -1 where there is none, others being turned away. */
int share_accept(int listener);

/* One packet, without waiting; 0 where it went. Its descriptors go along. */
int share_send(int socket, const void* packet, size_t bytes, const int* descriptors, int descriptor_count);

/* One packet, without waiting. Its length, which may be more than `size`; 0 where the other side is gone; -1 where
   there is none yet. Of descriptors that come along, up to `most_descriptors` are put there, and the others closed. */
ssize_t share_receive(int socket, void* packet, size_t size, int* descriptors, int most_descriptors,
                      int* descriptor_count);

void share_close(int* descriptor); /* and makes it -1 */

#ifdef __cplusplus
}
#endif

#endif
