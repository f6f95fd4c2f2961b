/* Work cut into pieces that are independent of each other: tasks where there is a team of threads already,
 * else a team. */
#ifndef LAMBERT_MATRIX_PIECES_H
#define LAMBERT_MATRIX_PIECES_H

#include <omp.h>
#include <stddef.h>

/* run(job, piece) for pieces 0 ... count-1, in any order and by any threads. */
static inline void pieces_run(void (*run)(const void *job, size_t piece), const void *job, size_t count) {
    if (omp_in_parallel()) {
#pragma omp taskloop grainsize(1)
        for (size_t k = 0; k < count; k++) run(job, k);
    } else {
#pragma omp parallel for schedule(dynamic, 1)
        for (size_t k = 0; k < count; k++) run(job, k);
    }
}

#endif
