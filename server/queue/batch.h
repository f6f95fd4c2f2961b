/* The queue of solves and the threads that serve it. Jobs of several clients on one operator share a pass,
 *     (B_1 | B_2 | ...) = M (E_1 | E_2 | ...),
 * which reads M once for up to BATCH_PASS vectors. Knows neither HTTP nor scenes; a job brings its functions.
 */
#ifndef LAMBERT_SERVER_QUEUE_BATCH_H
#define LAMBERT_SERVER_QUEUE_BATCH_H

#include "store/status.h"

typedef struct batch_queue batch_queue;
typedef struct batch_job batch_job;

/* Scratch memory that a thread keeps between jobs. */
typedef struct batch_workspace {
    void *bytes;
    size_t size;
} batch_workspace;

/* Most vectors in a pass: enough to use each number read many times, few enough to stay in the cache. */
#define BATCH_PASS 16

/* Vectors first ... first + count of a job, in a pass. */
typedef struct batch_part {
    batch_job *job;
    size_t first, count;
} batch_part;

/* Embedded in a request. Any thread calls, one after the other:
 *   begin   reads the request. True: it has set key and n_vectors (at least 1), which wait for passes
 *           shared by all jobs of this key and pass function. False: only finish is left.
 *   pass    computes some vectors of one or several jobs, at most BATCH_PASS in all. It is called until
 *           every vector is computed, by one thread at a time for a job.
 *   end     makes the answer.
 *   finish  after the job has left the count of batch_jobs. The job may not exist when it returns. */
struct batch_job {
    bool (*begin)(batch_job *job, batch_workspace *workspace);
    void (*pass)(const batch_part *parts, size_t n_parts, batch_workspace *workspace);
    void (*end)(batch_job *job, batch_workspace *workspace);
    void (*finish)(batch_job *job);
    const void *key;
    size_t n_vectors;
    bool brief; /* set at submission: each of the four functions takes about as long as waking a thread */
    size_t next_vector; /* private to the queue */
    batch_job *next;    /* private to the queue */
};

/* Starts n_threads threads with all signals blocked, or as many as there can be, at least one. At most
 * max_jobs wait or run. An idle thread helps the others with their loops (solver/base/parallel.h). */
lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error);

/* Queues a job; false if there are max_jobs already or the queue is closed. */
bool batch_submit(batch_queue *queue, batch_job *job);

/* The number of jobs that wait or run. */
size_t batch_jobs(batch_queue *queue);

/* The threads that were started. */
size_t batch_threads(const batch_queue *queue);

/* From now on idle threads help the calling one, which is none of the queue, with its loops. */
void batch_lend(batch_queue *queue);

/* Refuses further jobs, finishes those that wait and ends the threads. Once. */
void batch_close(batch_queue *queue);

/* Frees a closed queue. */
void batch_destroy(batch_queue *queue);

/* At least size bytes of undefined content; NULL if memory is short. */
void *batch_workspace_get(batch_workspace *workspace, size_t size);

#endif
