/* Counters of refused requests by cause, as Prometheus text. Any thread. */
#ifndef LAMBERT_SERVER_QUEUE_PROBLEM_COUNTS_H
#define LAMBERT_SERVER_QUEUE_PROBLEM_COUNTS_H

#include "solver/codec/problem.h"

#include <stdatomic.h>

/* Statuses by which the HTTP library refuses what it cannot read as a request; the last counts all others. */
enum { LIBRARY_STATUSES = 7 };

/* Zero at the start. */
typedef struct problem_counts {
    atomic_uint_fast64_t by_kind[PROBLEM_COUNT];       /* requests that were answered by a problem */
    atomic_uint_fast64_t unread[LIBRARY_STATUSES + 1]; /* heads that never became a request */
} problem_counts;

void problem_counts_add(problem_counts *c, problem_kind kind);
void problem_counts_add_unread(problem_counts *c, unsigned status);

/* Appends both counters. False when memory is short. */
bool problem_counts_write(const problem_counts *c, buffer *b);

#endif
