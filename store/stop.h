/* A question asked in the middle of long work, from the thread that does it: true once it shall be left. The
 * work then ends with LAM_ERR_CANCELLED. */
#ifndef LAMBERT_STORE_STOP_H
#define LAMBERT_STORE_STOP_H

#include <stdbool.h>
#include <stddef.h>

typedef struct stop_check {
    bool (*asked)(void *context);
    void *context;
} stop_check;

/* stop may be NULL: never. */
static inline bool stop_asked(const stop_check *stop) {
    return stop != NULL && stop->asked(stop->context);
}

#endif
