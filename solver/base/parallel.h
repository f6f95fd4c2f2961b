/* Work cut into pieces that are independent of each other: tasks where there is a team of threads already,
 * else a team. */
#ifndef LAMBERT_BASE_PARALLEL_H
#define LAMBERT_BASE_PARALLEL_H

#include <stddef.h>

typedef void pieces_function(const void *job, size_t piece);

/* run(job, piece) for pieces 0 ... count-1, in any order and by any threads. */
void pieces_run(pieces_function *run, const void *job, size_t count);

#endif
