/* Callbacks through which long work reports progress and is cancelled. Nothing here prints. */
#ifndef LAMBERT_BASE_PROGRESS_H
#define LAMBERT_BASE_PROGRESS_H

#include "store/status.h"

/* Any member may be NULL. report is called from one thread at a time, share runs from 0 to 1 in a stage. */
typedef struct progress {
    void (*report)(void *context, const char *stage, double share);
    bool (*cancelled)(void *context);
    void *context;
} progress;

static inline void progress_report(const progress *p, const char *stage, double share) {
    if (p != NULL && p->report != NULL) p->report(p->context, stage, share);
}

static inline bool progress_cancelled(const progress *p) {
    return p != NULL && p->cancelled != NULL && p->cancelled(p->context);
}

#endif
