#include "solver/base/parallel.h"

#include <omp.h>

/* A thread's pool is part of what it is, as its team is in OpenMP: kernels need not hand it on. */
static _Thread_local parallel_pool *own_pool;
static _Thread_local size_t own_member;

/* The arguments as one object, because clang 14 crashes on a taskloop over a parameter that is a function. */
typedef struct simple_loop {
    parallel_body *run;
    const void *job;
    size_t count;
} simple_loop;

static void share(const simple_loop *l) {
    if (omp_in_parallel()) {
#pragma omp taskloop grainsize(1)
        for (size_t k = 0; k < l->count; k++) l->run(l->job, k);
    } else {
#pragma omp parallel for schedule(dynamic, 1)
        for (size_t k = 0; k < l->count; k++) l->run(l->job, k);
    }
}

void parallel_for(parallel_body *run, const void *job, size_t count) {
    const simple_loop l = {run, job, count};
    share(&l);
}

bool parallel_take(parallel_loop *loop, size_t thread, size_t *tried) {
    size_t first, last;
    if (!work_shares_take(&loop->shares, thread, tried, &first, &last)) return false;
    loop->run(loop->job, thread, first, last);
    return true;
}

void parallel_share(size_t n_threads, size_t count, size_t at_once, parallel_pieces *run, const void *job) {
    parallel_loop loop = {.run = run, .job = job, .n_threads = n_threads};
    if (own_pool != NULL && loop.n_threads > own_pool->n_threads) loop.n_threads = own_pool->n_threads;
    if (loop.n_threads < 2 || count <= at_once) {
        if (count > 0) run(job, 0, 0, count);
        return;
    }
    work_shares_begin(&loop.shares, count, at_once, loop.n_threads);
    if (own_pool != NULL) {
        own_pool->share(own_pool, own_member, &loop);
        return;
    }
#pragma omp parallel num_threads((int)loop.n_threads)
    {
        size_t tried = 0;
        while (parallel_take(&loop, (size_t)omp_get_thread_num(), &tried)) continue;
    }
}

size_t parallel_threads(void) {
    return own_pool != NULL ? own_pool->n_threads : (size_t)omp_get_max_threads();
}

void parallel_join(parallel_pool *pool, size_t member) {
    own_pool = pool;
    own_member = member;
}
