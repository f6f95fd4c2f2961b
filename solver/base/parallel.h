/* Loops over independent pieces of work: OpenMP tasks inside a team of threads, a new team elsewhere. */
#ifndef LAMBERT_BASE_PARALLEL_H
#define LAMBERT_BASE_PARALLEL_H

#include <stddef.h>

typedef void parallel_body(const void *job, size_t piece);

/* Calls run(job, piece) for pieces 0 ... count-1, in any order and by any threads. */
void parallel_for(parallel_body *run, const void *job, size_t count);

#endif
