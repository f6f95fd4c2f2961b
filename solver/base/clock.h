/* The monotonic clock of both programs, which never jumps, and spans of time as text. */
#ifndef LAMBERT_BASE_CLOCK_H
#define LAMBERT_BASE_CLOCK_H

#include <time.h>

static inline struct timespec clock_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t;
}

static inline double clock_seconds(void) {
    const struct timespec t = clock_now();
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds that all threads of the process have computed; waiting for other processes does not count. */
static inline double clock_processor_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The same of the calling thread. */
static inline double clock_thread_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static inline double clock_ms(void) {
    return 1e3 * clock_seconds();
}

/* A span of time for people: "4.2 s", "42 s", "3 min 20 s" or "2 h 5 min". */
void clock_format_seconds(double seconds, char text[32]);

#endif
