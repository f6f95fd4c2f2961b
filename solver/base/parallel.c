#include "solver/base/parallel.h"

#include <omp.h>

/* The arguments as one object, because clang 14 crashes on a taskloop over a parameter that is a function. */
typedef struct parallel_loop {
    parallel_body *run;
    const void *job;
    size_t count;
} parallel_loop;

static void share(const parallel_loop *l) {
    if (omp_in_parallel()) {
#pragma omp taskloop grainsize(1)
        for (size_t k = 0; k < l->count; k++) l->run(l->job, k);
    } else {
#pragma omp parallel for schedule(dynamic, 1)
        for (size_t k = 0; k < l->count; k++) l->run(l->job, k);
    }
}

void parallel_for(parallel_body *run, const void *job, size_t count) {
    const parallel_loop l = {run, job, count};
    share(&l);
}
