/* The queue of requests and the threads that serve it, and where several clients come to share one pass over
 * an operator. Knows neither HTTP nor scenes: what a job does is in its functions. */
#ifndef LAMBERT_SERVER_QUEUE_BATCH_H
#define LAMBERT_SERVER_QUEUE_BATCH_H

#include "store/status.h"

typedef struct batch_queue batch_queue;
typedef struct batch_job batch_job;

/* Memory that a thread keeps from one job to the next. */
typedef struct batch_workspace {
    void *bytes;
    size_t size;
} batch_workspace;

/* Vectors of one pass: enough to use each number read many times, few enough that they stay in the cache. */
#define BATCH_PASS 16

/* Vectors first ... first + count of a job, in a pass. */
typedef struct batch_part {
    batch_job *job;
    size_t first, count;
} batch_part;

/* Embedded in what the job is about. Any thread calls, one after the other:
 *   begin   reads what is asked. True: n_vectors (at least 1) wait for passes with all that have the same key
 *           and pass; both are set by it. False: there is nothing left to do but finish.
 *   pass    computes some vectors of one or several jobs, at most BATCH_PASS; called until each had its turn,
 *           never twice at once for a job.
 *   end     makes the answer of them.
 *   finish  once the job is counted no more: whoever it wakes finds the place free. The job may be gone when
 *           it returns. */
struct batch_job {
    bool (*begin)(batch_job *job, batch_workspace *workspace);
    void (*pass)(const batch_part *parts, size_t n_parts, batch_workspace *workspace);
    void (*end)(batch_job *job, batch_workspace *workspace);
    void (*finish)(batch_job *job);
    const void *key;
    size_t n_vectors;
    bool brief;         /* set at submission: none of the four takes much longer than to wake a thread */
    size_t next_vector; /* the queue's */
    batch_job *next;    /* the queue's */
};

/* Starts n_threads threads (with all signals blocked); at most max_jobs wait or run. */
lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error);

/* Queues a job; false when there are max_jobs already or the queue is closed. */
bool batch_submit(batch_queue *queue, batch_job *job);

/* Jobs that wait or run. */
size_t batch_jobs(batch_queue *queue);

/* Takes no further job, finishes those that wait, and ends the threads. Once. */
void batch_close(batch_queue *queue);

/* Frees a closed queue. */
void batch_destroy(batch_queue *queue);

/* At least size bytes, their content undefined; NULL when memory is short. */
void *batch_workspace_get(batch_workspace *workspace, size_t size);

#endif
