/* The queue of solves and the threads that serve it. Jobs of several clients on one operator share a pass,
 *     (B_1 | B_2 | ...) = M (E_1 | E_2 | ...),
 * which reads M once for up to BATCH_PASS vectors. Knows neither HTTP nor scenes; a job brings its functions.
 *
 * Order. Jobs of one client, one kind and about one cost (within a factor of 4), all to be begun or all to be
 * computed, stand in one line, in the order in which they came: what many long bodies cost to read keeps no
 * solve that was read from its pass. Every line that has work gets an equal share of the threads' time: a
 * line is charged for the time of its jobs, and the least charged one goes on; a line that was empty begins
 * at the charge of the one that is served (start-time fair queuing: Goyal, Vin and Cheng 1996). Hence these
 * bounds:
 *   - Of two lines that both have work neither is charged more than the other by more than the cost of one
 *     job of each. So with k lines a job waits for at most k times what those before it in its line take,
 *     and for the functions that the threads are in.
 *     (Company, below, may put a line ahead by BATCH_AHEAD more.)
 *   - A job that is ready for a pass lets others be begun first, so that they share it: of its own key and
 *     kind, estimated to take no longer than BATCH_GATHER, and of lines that are charged at most BATCH_AHEAD
 *     more than its own. The first of them starts a clock, and none is begun later than BATCH_GATHER. So the
 *     pass waits for BATCH_GATHER and for the one begin that each thread is in, however long that takes.
 *   - When all threads are in functions of long jobs, one more thread serves the short ones (cost up to
 *     BATCH_SHORT), so that these wait for none of those functions; the processor is then shared.
 * The table of lines has 256 places by hash; lines that meet there are one (stochastic fairness queueing:
 * McKenney 1990). */
#ifndef LAMBERT_SERVER_QUEUE_BATCH_H
#define LAMBERT_SERVER_QUEUE_BATCH_H

#include "store/status.h"

#include <stdint.h>

typedef struct batch_queue batch_queue;
typedef struct batch_job batch_job;

/* Scratch memory that a thread keeps between jobs. */
typedef struct batch_workspace {
    void *bytes;
    size_t size;
} batch_workspace;

/* Most vectors in a pass: enough to use each number read many times, few enough to stay in the cache. */
#define BATCH_PASS 16

/* Seconds: the cost of a short job, and the time in which others are begun before a pass, to share it. */
#define BATCH_SHORT 4e-3
#define BATCH_GATHER 2e-3

/* Seconds of charge. Estimates are larger than what most begins take: with a quarter of it, passes of 47 KB
 * bodies were shared by half as many. */
#define BATCH_AHEAD 8e-3

/* Seconds between two looks at a job that waits. */
#define BATCH_LOOK 50e-3

/* Seconds without a job after which a queue rests. */
#define BATCH_REST 1.0

/* Vectors first ... first + count of a job, in a pass. */
typedef struct batch_part {
    batch_job *job;
    size_t first, count;
} batch_part;

/* Embedded in a request. Any thread calls, one after the other:
 *   begin   reads the request. True: it has set key and n_vectors (at least 1), which wait for passes
 *           shared by all jobs of this key and pass function, and cost. False: only finish is left.
 *   pass    computes some vectors of one or several jobs, at most BATCH_PASS in all. It is called until
 *           every vector is computed, by one thread at a time for a job. It may set n_vectors of a job that
 *           shares its key with no other: to what has been computed, or beyond that where more is left to do.
 *           Or it sets `blocked` and returns false: it is called again, in the turn that the job had, once
 *           batch_unblock was called, which may be before it returns.
 *   end     makes the answer.
 *   finish  after the job has left the count of batch_jobs. The job may not exist when it returns.
 * Jobs that wait are looked at every BATCH_LOOK seconds, others before their next function if no
 * look has seen them for as long:
 *   is_wanted  False: nobody needs the answer any more. Called with the lock of the queue: it
 *              neither waits nor calls the queue. NULL: it always is.
 *   drop       makes an answer in place of the functions that are left but finish, which follows.
 *              Also of jobs that batch_abandon ends, and of those that give their place away.
 *              Needed with is_wanted. */
struct batch_job {
    bool (*begin)(batch_job *job, batch_workspace *workspace);
    void (*pass)(const batch_part *parts, size_t n_parts, batch_workspace *workspace);
    void (*end)(batch_job *job, batch_workspace *workspace);
    void (*finish)(batch_job *job);
    bool (*is_wanted)(batch_job *job);
    void (*drop)(batch_job *job);
    const void *key; /* at submission the one that it is likely to get, if it shares passes; or NULL */
    size_t n_vectors;
    double cost;     /* estimated seconds of begin; once begun, of the longest function that is left */
    uint64_t client; /* whose it is */
    unsigned kind;   /* of work; jobs of one kind take similar steps */
    bool blocked;    /* set by begin: it cannot go on before batch_unblock */
    bool brief; /* set at submission: each of the four functions takes about as long as waking a thread */
    size_t next_vector;   /* here and below: private to the queue */
    uint64_t ticket;      /* number of its submission */
    bool was_read;        /* its begin has returned, and passes are left */
    double gathers_until; /* the end of the time in which others are begun before its next pass; 0: not yet */
    bool passing;         /* a thread computes some of its vectors */
    bool unblocked;       /* while begin still ran */
    bool evicted;         /* it is unwanted once it has left its pass */
    double looked;        /* when it was last looked at, or came */
    size_t line;
    batch_job *next;
};

/* Starts n_threads threads and the one for short jobs, with all signals blocked, or as many as there can be,
 * at least one. At most max_jobs wait or run. An idle thread helps the others with their loops
 * (solver/base/parallel.h). */
lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error);

/* The same, where `seconds` tells the time that functions take and gathering ends at, above 0: of tests that
 * count what goes together. Any thread calls it. */
lam_status batch_start_by(double (*seconds)(void), size_t n_threads, size_t max_jobs, batch_queue **out,
                          lam_error *error);

/* Queues a job; false if there are max_jobs already or the queue is closed. When it is full, a job of the
 * client with most jobs that wait is dropped for one of a client that has fewer (longest queue drop: Suter et
 * al. 1998), so that nobody has all places while others come, and one alone may. */
bool batch_submit(batch_queue *queue, batch_job *job);

/* The same among the jobs that have begun with this key: drops one of the client that has most for one of
 * `client`; false if it has not two fewer. */
bool batch_make_place(batch_queue *queue, uint64_t client, const void *key);

/* Lets a job go on whose begin blocked it. The job must not have come to its drop yet, or its drop must wait
 * for this call. */
void batch_unblock(batch_queue *queue, batch_job *job);

/* The number of jobs that wait or run. */
size_t batch_jobs(batch_queue *queue);

/* Seconds, about, until a job that is submitted now would be done: the jobs that wait or run, at the pace of
 * the last ones. 0 until some are done. */
double batch_delay(batch_queue *queue);

/* The threads that were started, without the one for short jobs. */
size_t batch_threads(const batch_queue *queue);

/* From now on a thread of the queue calls `rest` whenever there was no job for BATCH_REST, once after the
 * last one; jobs may come meanwhile. Before any is submitted. */
void batch_when_resting(batch_queue *queue, void (*rest)(void));

/* From now on idle threads help the calling one, which is none of the queue, with its loops. */
void batch_lend(batch_queue *queue);

/* Refuses further jobs and drops those that wait, also those that return from a function; of jobs without
 * `drop` none. Returns at once. */
void batch_abandon(batch_queue *queue);

/* Gives up the threads, some of which may still run, as the process ends at once: nobody waits for them. The
 * queue is never closed. */
void batch_leave(batch_queue *queue);

/* Refuses further jobs, finishes those that wait and ends the threads. Once. */
void batch_close(batch_queue *queue);

/* Frees a closed queue. */
void batch_destroy(batch_queue *queue);

/* At least size bytes of undefined content; NULL if memory is short. */
void *batch_workspace_get(batch_workspace *workspace, size_t size);

#endif
