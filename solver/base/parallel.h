/* Loops over independent pieces of work. OpenMP shares them in a program on its own; in a server, whose
 * threads belong to a pool, the pool does, so that no thread is ever made for a loop. */
#ifndef LAMBERT_BASE_PARALLEL_H
#define LAMBERT_BASE_PARALLEL_H

#include "solver/base/work_shares.h"

#include <stddef.h>

typedef void parallel_body(const void *job, size_t piece);

/* Calls run(job, piece) for pieces 0 ... count-1, in any order and by any threads: tasks inside a team of
 * OpenMP, a new team elsewhere. */
void parallel_for(parallel_body *run, const void *job, size_t count);

/* Does pieces first ... last-1 of a loop. At a time no other thread runs the same loop with this number
 * `thread`, which is below the n_threads of the loop. */
typedef void parallel_pieces(const void *job, size_t thread, size_t first, size_t last);

/* Calls run for pieces 0 ... count-1, some at a time: a multiple of at_once, fewer at the end of a part. At
 * most n_threads threads take part, fewer where fewer are free; the result must not depend on them. */
void parallel_share(size_t n_threads, size_t count, size_t at_once, parallel_pieces *run, const void *job);

/* The threads that a loop of the calling thread has at most: those of its pool, or of OpenMP. */
size_t parallel_threads(void);

/* A loop while it runs. */
typedef struct parallel_loop {
    parallel_pieces *run;
    const void *job;
    size_t n_threads;
    work_shares shares;
} parallel_loop;

/* Takes pieces of a loop once, as its thread number `thread`, and does them; false: all are taken. *tried: 0
 * at first. */
bool parallel_take(parallel_loop *loop, size_t thread, size_t *tried);

/* Threads that help each other. share does a loop to its end, with the calling thread, the pool's member, and
 * others; it never fails. */
typedef struct parallel_pool {
    void (*share)(struct parallel_pool *pool, size_t member, parallel_loop *loop);
    size_t n_threads;
} parallel_pool;

/* From now on the loops of the calling thread are shared by this pool, of which it is a member of this
 * number. NULL: by OpenMP. The pool is the caller's and must exist for as long. */
void parallel_join(parallel_pool *pool, size_t member);

#endif
