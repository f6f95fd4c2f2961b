#include "solver/base/parallel.h"

#include <omp.h>

/* One thing for the tasks to share: clang 14 does not survive a taskloop over a parameter that is a function.
 */
typedef struct pieces {
    pieces_function *run;
    const void *job;
    size_t count;
} pieces;

static void share(const pieces *p) {
    if (omp_in_parallel()) {
#pragma omp taskloop grainsize(1)
        for (size_t k = 0; k < p->count; k++) p->run(p->job, k);
    } else {
#pragma omp parallel for schedule(dynamic, 1)
        for (size_t k = 0; k < p->count; k++) p->run(p->job, k);
    }
}

void pieces_run(pieces_function *run, const void *job, size_t count) {
    const pieces p = {run, job, count};
    share(&p);
}
