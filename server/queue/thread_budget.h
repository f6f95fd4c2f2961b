/* The threads of a queue as the only ones that compute: a loop of one of them is helped by those that are
 * idle, so that T threads are never more than T, whatever runs, and none is made or ended while the program
 * serves. Knows neither jobs nor what a loop computes. */
#ifndef LAMBERT_SERVER_QUEUE_THREAD_BUDGET_H
#define LAMBERT_SERVER_QUEUE_THREAD_BUDGET_H

#include "solver/base/parallel.h"

#include <pthread.h>
#include <stdatomic.h>

typedef struct open_loop open_loop;

/* Embedded in the queue, whose lock and condition of idle threads it shares. */
typedef struct thread_budget {
    parallel_pool pool; /* first, as its functions get the pool */
    pthread_mutex_t *lock;
    pthread_cond_t *idle;
    open_loop *first;   /* loops that run and may be helped */
    atomic_bool called; /* helpers should look for a job */
} thread_budget;

/* A budget of n_threads; lock and idle are the caller's and outlive it. */
void thread_budget_init(thread_budget *budget, size_t n_threads, pthread_mutex_t *lock, pthread_cond_t *idle);

/* From now on the loops of the calling thread are shared with the idle ones. member: its number, from 0 on; a
 * thread that only asks for help and gives none (the one that loads stores) may have that of another. */
void thread_budget_join(thread_budget *budget, size_t member);

/* Helps a loop until nothing is left of it or a job calls. The caller holds the lock, which is released
 * meanwhile. False, at once, when no loop wants help. */
bool thread_budget_help(thread_budget *budget, size_t member);

/* Has helpers return after the piece at hand, since a job waits and no thread is idle. */
void thread_budget_call(thread_budget *budget);

#endif
