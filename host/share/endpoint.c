#include "share/endpoint.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "share/error.h"

enum { MOST_NAME = 64, BACKLOG = 64, MOST_DESCRIPTORS = 16 };

void share_close(int* descriptor) {
    if (*descriptor >= 0) close(*descriptor);
    *descriptor = -1;
}

clarus_share_status share_runtime_folder(char* path, size_t size) {
    const char* base = getenv("XDG_RUNTIME_DIR");
    const int is_said = base && base[0] == '/';
    const int length = is_said ? snprintf(path, size, "%s/clarus", base)
                               : snprintf(path, size, "/tmp/clarus-%lu", (unsigned long)geteuid());
    if (length < 0 || (size_t)length >= size)
        return share_fail(CLARUS_SHARE_SYSTEM, "XDG_RUNTIME_DIR %s is too long for a socket's path", base);
    if (mkdir(path, 0700) != 0 && errno != EEXIST)
        return share_fail(CLARUS_SHARE_SYSTEM, "cannot make the folder %s: %s%s", path, strerror(errno),
                          is_said ? "; XDG_RUNTIME_DIR must name a folder of yours" : "");
    struct stat status;
    if (lstat(path, &status) != 0)
        return share_fail(CLARUS_SHARE_SYSTEM, "cannot look at %s: %s", path, strerror(errno));
    if (!S_ISDIR(status.st_mode) || status.st_uid != geteuid() || (status.st_mode & 077) != 0)
        return share_fail(CLARUS_SHARE_SYSTEM,
                          "%s must be a folder that belongs to you and is closed to others (mode 0700)", path);
    return CLARUS_SHARE_OK;
}

clarus_share_status share_check_name(const char* name) {
    static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    const size_t length = name ? strlen(name) : 0;
    if (length < 1 || length > MOST_NAME || name[0] == '.' || strspn(name, allowed) != length)
        return share_fail(CLARUS_SHARE_INVALID_ARGUMENT,
                          "the stream name \"%.80s\": 1 to %d letters, digits, '.', '_' and '-', not beginning with "
                          "'.'",
                          name ? name : "", MOST_NAME);
    return CLARUS_SHARE_OK;
}

static clarus_share_status find_address(const char* name, const char* suffix, struct sockaddr_un* address,
                                        char* folder) {
    clarus_share_status status = share_check_name(name);
    if (status == CLARUS_SHARE_OK) status = share_runtime_folder(folder, sizeof address->sun_path);
    if (status != CLARUS_SHARE_OK) return status;
    memset(address, 0, sizeof *address);
    address->sun_family = AF_UNIX;
    const int length = snprintf(address->sun_path, sizeof address->sun_path, "%s/%s%s", folder, name, suffix);
    if (length < 0 || (size_t)length >= sizeof address->sun_path)
        return share_fail(CLARUS_SHARE_SYSTEM, "%s/%s%s is longer than a socket's path may be; take a shorter name",
                          folder, name, suffix);
    return CLARUS_SHARE_OK;
}

/* Who makes and removes sockets in the folder takes turns. The kernel ends a turn whose process dies. */
static clarus_share_status lock_folder(const char* folder, int* lock) {
    *lock = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (*lock < 0) return share_fail(CLARUS_SHARE_SYSTEM, "cannot open %s: %s", folder, strerror(errno));
    for (int tries = 0; tries < 200; ++tries) {
        if (flock(*lock, LOCK_EX | LOCK_NB) == 0) return CLARUS_SHARE_OK;
        const struct timespec pause = {0, 10 * 1000 * 1000};
        nanosleep(&pause, NULL);
    }
    share_close(lock);
    return share_fail(CLARUS_SHARE_SYSTEM, "%s stays locked by another process, for two seconds now", folder);
}

static int new_socket(void) { return socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0); }

static int is_of_this_user(int socket) {
    struct ucred peer;
    socklen_t size = sizeof peer;
    return getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && size == sizeof peer &&
           peer.uid == geteuid();
}

/* The folder is locked. Connecting tells whether somebody listens: a dead process's socket refuses. */
static clarus_share_status remove_leftover(const char* name, const struct sockaddr_un* address) {
    struct stat status;
    if (lstat(address->sun_path, &status) != 0) return CLARUS_SHARE_OK;
    if (!S_ISSOCK(status.st_mode))
        return share_fail(CLARUS_SHARE_NAME_IN_USE, "%s is in the way, and is no socket", address->sun_path);
    int probe = new_socket();
    if (probe < 0) return share_fail(CLARUS_SHARE_SYSTEM, "cannot make a socket: %s", strerror(errno));
    const int connected = connect(probe, (const struct sockaddr*)address, sizeof *address) == 0;
    const int cause = errno;
    share_close(&probe);
    if (connected || cause == EAGAIN)
        return share_fail(CLARUS_SHARE_NAME_IN_USE,
                          "the name %s is in use by another process: end that, or choose another name", name);
    if (cause != ECONNREFUSED && cause != ENOENT)
        return share_fail(CLARUS_SHARE_NAME_IN_USE, "%s is in the way: %s", address->sun_path, strerror(cause));
    unlink(address->sun_path);
    return CLARUS_SHARE_OK;
}

static clarus_share_status bind_endpoint(struct share_endpoint* endpoint) {
    struct stat status;
    endpoint->socket = new_socket();
    /* The file's mode is that of the socket, from its first moment on. */
    if (endpoint->socket >= 0 && fchmod(endpoint->socket, 0600) == 0 &&
        bind(endpoint->socket, (const struct sockaddr*)&endpoint->address, sizeof endpoint->address) == 0 &&
        listen(endpoint->socket, BACKLOG) == 0 && lstat(endpoint->address.sun_path, &status) == 0) {
        endpoint->device = status.st_dev;
        endpoint->inode = status.st_ino;
        return CLARUS_SHARE_OK;
    }
    const int cause = errno;
    share_close(&endpoint->socket);
    return share_fail(CLARUS_SHARE_SYSTEM, "cannot listen on %s: %s", endpoint->address.sun_path, strerror(cause));
}

clarus_share_status share_listen(const char* name, const char* suffix, struct share_endpoint* endpoint) {
    char folder[sizeof endpoint->address.sun_path];
    endpoint->socket = -1;
    clarus_share_status status = find_address(name, suffix, &endpoint->address, folder);
    int lock = -1;
    if (status == CLARUS_SHARE_OK) status = lock_folder(folder, &lock);
    if (status == CLARUS_SHARE_OK) status = remove_leftover(name, &endpoint->address);
    if (status == CLARUS_SHARE_OK) status = bind_endpoint(endpoint);
    share_close(&lock);
    return status;
}

void share_stop_listening(struct share_endpoint* endpoint) {
    if (endpoint->socket < 0) return;
    char folder[sizeof endpoint->address.sun_path];
    snprintf(folder, sizeof folder, "%s", endpoint->address.sun_path);
    *strrchr(folder, '/') = '\0';
    int lock = -1;
    lock_folder(folder, &lock);
    struct stat status; /* another's, where this one's was removed by hand */
    if (lstat(endpoint->address.sun_path, &status) == 0 && status.st_dev == endpoint->device &&
        status.st_ino == endpoint->inode)
        unlink(endpoint->address.sun_path);
    share_close(&endpoint->socket);
    share_close(&lock);
}

clarus_share_status share_connect(const char* name, const char* suffix, int* connection) {
    struct sockaddr_un address;
    char folder[sizeof address.sun_path];
    *connection = -1;
    const clarus_share_status status = find_address(name, suffix, &address, folder);
    if (status != CLARUS_SHARE_OK) return status;
    *connection = new_socket();
    if (*connection < 0) return share_fail(CLARUS_SHARE_SYSTEM, "cannot make a socket: %s", strerror(errno));
    if (connect(*connection, (const struct sockaddr*)&address, sizeof address) == 0) {
        if (is_of_this_user(*connection)) return CLARUS_SHARE_OK;
        share_close(connection);
        return share_fail(CLARUS_SHARE_REFUSED, "%s belongs to another user's process", address.sun_path);
    }
    const int cause = errno;
    share_close(connection);
    if (cause == EAGAIN)
        return share_fail(CLARUS_SHARE_TIMED_OUT, "too many connect to %s at once; try again", address.sun_path);
    if (cause == ENOENT || cause == ECONNREFUSED)
        return share_fail(CLARUS_SHARE_NO_STREAM, "nobody listens on %s", address.sun_path);
    return share_fail(CLARUS_SHARE_SYSTEM, "cannot connect to %s: %s", address.sun_path, strerror(cause));
}

int share_accept(int listener) {
    int connection = accept4(listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (connection >= 0 && !is_of_this_user(connection)) share_close(&connection);
    return connection;
}

int share_send(int connection, const void* packet, size_t bytes, const int* descriptors, int descriptor_count) {
    union {
        struct cmsghdr head;
        char bytes[CMSG_SPACE(sizeof(int) * MOST_DESCRIPTORS)];
    } control;
    memset(&control, 0, sizeof control);
    struct iovec part = {(void*)packet, bytes};
    struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1};
    if (descriptor_count > 0) {
        const size_t size = sizeof(int) * (size_t)descriptor_count;
        message.msg_control = control.bytes;
        message.msg_controllen = CMSG_SPACE(size);
        struct cmsghdr* head = CMSG_FIRSTHDR(&message);
        head->cmsg_level = SOL_SOCKET;
        head->cmsg_type = SCM_RIGHTS;
        head->cmsg_len = CMSG_LEN(size);
        memcpy(CMSG_DATA(head), descriptors, size);
    }
    return sendmsg(connection, &message, MSG_NOSIGNAL | MSG_DONTWAIT) == (ssize_t)bytes ? 0 : -1;
}

static int take_descriptors(struct msghdr* message, int* descriptors, int most) {
    int count = 0;
    for (struct cmsghdr* head = CMSG_FIRSTHDR(message); head; head = CMSG_NXTHDR(message, head)) {
        if (head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_RIGHTS) continue;
        const size_t came = (head->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (size_t i = 0; i < came; ++i) {
            int descriptor;
            memcpy(&descriptor, CMSG_DATA(head) + i * sizeof(int), sizeof descriptor);
            if (count < most)
                descriptors[count++] = descriptor;
            else
                share_close(&descriptor);
        }
    }
    return count;
}

ssize_t share_receive(int connection, void* packet, size_t size, int* descriptors, int most_descriptors,
                      int* descriptor_count) {
    union {
        struct cmsghdr head;
        char bytes[CMSG_SPACE(sizeof(int) * MOST_DESCRIPTORS)];
    } control;
    struct iovec part = {packet, size};
    struct msghdr message = {
        .msg_iov = &part, .msg_iovlen = 1, .msg_control = control.bytes, .msg_controllen = sizeof control.bytes};
    const ssize_t bytes = recvmsg(connection, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC | MSG_TRUNC);
    const int cause = errno;
    if (descriptor_count) *descriptor_count = 0;
    if (bytes < 0) return cause == EAGAIN || cause == EINTR ? -1 : 0;
    const int count = take_descriptors(&message, descriptors, most_descriptors);
    if (descriptor_count) *descriptor_count = count;
    return bytes;
}
