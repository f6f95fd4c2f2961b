/* Seconds on a clock that never jumps, for stage times. */
#ifndef LAMBERT_BASE_CLOCK_H
#define LAMBERT_BASE_CLOCK_H

#include <time.h>

static inline double clock_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#endif
