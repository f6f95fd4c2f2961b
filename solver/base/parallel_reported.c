#include "solver/base/parallel_reported.h"

#include <stdbool.h>

/* The arguments as one object, because clang 14 crashes on a loop over a parameter that is a function. */
typedef struct shared_loop {
    const reported_loop *of;
    size_t count, at_once;
    reported_pieces *run;
    const void *job;
} shared_loop;

/* True where it was cancelled. */
static bool share(const shared_loop *l) {
    size_t done = 0;
    bool stop = false;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t first = 0; first < l->count; first += l->at_once) {
        bool skip;
#pragma omp atomic read
        skip = stop;
        if (skip) continue;
        const size_t last = l->count - first < l->at_once ? l->count : first + l->at_once;
        l->run(l->job, first, last);
#pragma omp critical(parallel_reported)
        {
            done += last - first;
            progress_report(l->of->progress, l->of->stage,
                            l->of->before + l->of->part * (double)done / (double)l->count);
            if (progress_cancelled(l->of->progress)) {
#pragma omp atomic write
                stop = true;
            }
        }
    }
    return stop;
}

lam_status parallel_reported(const reported_loop *loop, size_t count, size_t at_once, reported_pieces *run,
                             const void *job, lam_error *error) {
    const shared_loop all = {.of = loop, .count = count, .at_once = at_once, .run = run, .job = job};
    return share(&all) ? status_fail(error, LAM_ERR_CANCELLED, "cancelled") : LAM_OK;
}
