/* Follows the progress of long work: within a stage the share rises and ends at 1. */
#ifndef LAMBERT_TESTS_SUPPORT_FOLLOWED_H
#define LAMBERT_TESTS_SUPPORT_FOLLOWED_H

#include "solver/base/progress.h"

typedef struct followed {
    char stage[64];
    double share;     /* the last one of the stage */
    size_t n_stages;  /* in a row, with different names */
    size_t n_reports; /* of all stages */
} followed;

/* The callback of progress; its context is a followed that begins with zeros. */
void followed_report(void *context, const char *stage, double share);

#endif
