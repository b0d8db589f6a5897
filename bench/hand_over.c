/* How long a frame takes from the renderer's clarus_share_end to the upscaler's return from clarus_share_reader_wait,
   in two processes, and what copying it into its slot takes. Prints medians and 95th percentiles in microseconds.
   Usage: clarus_hand_over [WIDTH HEIGHT [FRAMES]] */

#define _GNU_SOURCE
#include <clarus/share.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return 1e6 * (double)time.tv_sec + 1e-3 * (double)time.tv_nsec;
}

static int ascending(const void* a, const void* b) {
    const double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

static void print(const char* what, double* times, int count) {
    qsort(times, (size_t)count, sizeof *times, ascending);
    printf("%-34s %8.1f %8.1f\n", what, times[count / 2], times[count * 95 / 100]);
    fflush(stdout);
}

static int check(clarus_share_status status) {
    if (status != CLARUS_SHARE_OK) fprintf(stderr, "clarus_hand_over: %s\n", clarus_share_last_error());
    return status == CLARUS_SHARE_OK;
}

static int upscale(const char* name, int frames) {
    clarus_share_reader* reader = NULL;
    clarus_share_frame frame;
    double* latencies = calloc((size_t)frames, sizeof *latencies);
    int ok =
        latencies && check(clarus_share_reader_open(name, &reader)) && check(clarus_share_reader_connect(reader, 5000));
    for (int i = 0; ok && i < frames; ++i) {
        ok = check(clarus_share_reader_wait(reader, 5000, &frame));
        if (!ok) break;
        const double taken = now();
        double ended;
        memcpy(&ended, frame.user, sizeof ended);
        latencies[i] = taken - ended;
        clarus_share_reader_release(reader);
    }
    if (ok) print("from end to wait's return", latencies, frames);
    clarus_share_reader_close(reader);
    free(latencies);
    return !ok;
}

static int render(const char* name, int width, int height, int frames) {
    clarus_share_description description = clarus_share_default_description();
    description.resources[CLARUS_SHARE_COLOR] = (clarus_share_resource){{CLARUS_F16, 4}, width, height, 0};
    description.resources[CLARUS_SHARE_DEPTH] = (clarus_share_resource){{CLARUS_F32, 1}, width, height, 0};
    description.resources[CLARUS_SHARE_MOTION] = (clarus_share_resource){{CLARUS_F16, 2}, width, height, 0};
    description.user_bytes = sizeof(double);
    const size_t most = 8 * (size_t)width * (size_t)height;
    clarus_share_stream* stream = NULL;
    clarus_share_frame frame;
    unsigned char* pixels = malloc(most);
    double* copies = calloc((size_t)frames, sizeof *copies);
    int ok = pixels && copies && check(clarus_share_open(name, &description, &stream));
    if (ok) memset(pixels, 1, most);
    for (int i = 0; ok && i < frames; ++i) {
        ok = check(clarus_share_begin(stream, 5000, &frame));
        if (!ok) break;
        const double begun = now();
        for (int kind = CLARUS_SHARE_COLOR; kind <= CLARUS_SHARE_MOTION; ++kind)
            clarus_share_copy(&frame, (clarus_share_kind)kind, pixels, 0);
        const double ended = now();
        copies[i] = ended - begun;
        memcpy(frame.user, &ended, sizeof ended);
        frame.user_bytes = sizeof ended;
        ok = check(clarus_share_end(stream, &frame)) && check(clarus_share_drain(stream, 5000));
        usleep(4000); /* the reader sleeps again */
    }
    if (ok) print("copy into the slot", copies, frames);
    clarus_share_close(stream);
    free(copies);
    free(pixels);
    return !ok;
}

int main(int argc, char** argv) {
    const int width = argc > 2 ? atoi(argv[1]) : 960, height = argc > 2 ? atoi(argv[2]) : 540;
    const int frames = argc > 3 ? atoi(argv[3]) : 1000;
    char name[32];
    if (width < 1 || height < 1 || frames < 1) {
        fprintf(stderr, "usage: clarus_hand_over [WIDTH HEIGHT [FRAMES]]\n");
        return 2;
    }
    snprintf(name, sizeof name, "hand-over-%d", (int)getpid());
    printf("%d frames of %dx%d, microseconds: median, 95th percentile\n", frames, width, height);
    fflush(stdout);
    const pid_t child = fork();
    if (child == 0) _exit(upscale(name, frames));
    int failed = render(name, width, height, frames), status = 1;
    waitpid(child, &status, 0);
    return failed || status != 0;
}
