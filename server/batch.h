/* The queue of solves and the threads that serve it. Knows neither HTTP nor scenes: a job is a function.
 * Here is where solves of several clients can come to share one pass over an operator. */
#ifndef LAMBERT_SERVER_BATCH_H
#define LAMBERT_SERVER_BATCH_H

#include "store/status.h"

typedef struct batch_queue batch_queue;

/* Memory that a thread keeps from one job to the next. */
typedef struct batch_workspace {
    void *bytes;
    size_t size;
} batch_workspace;

/* Embedded in what the job is about. A thread calls run, and finish once the job is counted no more: whoever
 * finish wakes finds the place free. The job may be gone when finish returns. */
typedef struct batch_job {
    void (*run)(struct batch_job *job, batch_workspace *workspace);
    void (*finish)(struct batch_job *job);
    struct batch_job *next;
} batch_job;

/* Starts n_threads threads (with all signals blocked); at most max_jobs wait or run. */
lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error);

/* Queues a job; false when there are max_jobs already or the queue is closed. */
bool batch_submit(batch_queue *queue, batch_job *job);

/* Jobs that wait or run. */
size_t batch_jobs(batch_queue *queue);

/* Takes no further job, runs those that wait, and ends the threads. Once. */
void batch_close(batch_queue *queue);

/* Frees a closed queue. */
void batch_destroy(batch_queue *queue);

/* At least size bytes, their content undefined; NULL when memory is short. */
void *batch_workspace_get(batch_workspace *workspace, size_t size);

#endif
