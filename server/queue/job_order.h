/* The jobs of a queue that wait: their lines, which of them goes on, which share a pass, and which are not
 * wanted any more. batch.h states the rules. Private to server/queue; the queue holds its lock in every call.
 */
#ifndef LAMBERT_SERVER_QUEUE_JOB_ORDER_H
#define LAMBERT_SERVER_QUEUE_JOB_ORDER_H

#include "server/queue/batch.h"

typedef struct job_list {
    batch_job *first, *last;
} job_list;

enum { ORDER_LINES = 256 };

/* Jobs of one client, kind and class of cost. */
typedef struct job_line {
    job_list arrived; /* before begin */
    size_t n_jobs;    /* not computed yet */
    double charge;    /* seconds */
    batch_job *ready; /* set by order_find_next: the first that waits for a pass which may begin */
} job_line;

/* A job is in one of the lists, or a thread runs one of its functions; during a pass it stays in `waiting`.
 */
typedef struct job_order {
    job_list waiting, computed; /* before or between passes; before end */
    job_list blocked;           /* until batch_unblock; in no line */
    job_list unwanted;          /* before drop */
    size_t n_arrived, n_jobs;   /* jobs before begin; from submit to finish */
    uint64_t n_submitted;
    bool abandoned; /* all that have a drop are unwanted */
    double next_look;
    size_t n_done;     /* jobs since pace_since */
    double pace_since; /* 0: no job waits or runs */
    double pace;       /* seconds a job; 0: not known yet */
    double now_served; /* the charge of the line that was served last */
    job_line lines[ORDER_LINES];
    size_t active[ORDER_LINES], n_active; /* the lines that have jobs */
    const void **passing;                 /* keys of the passes that run; as many places as threads */
    size_t n_passing;
} job_order;

void order_add(job_list *list, batch_job *job);
batch_job *order_take(job_list *list); /* NULL: it is empty */

bool order_is_short(const batch_job *job);

/* A job stands in the line of its client, kind and cost from its submission until it is computed. */
void order_enter(job_order *order, batch_job *job);
void order_leave(job_order *order, const batch_job *job);

/* A job whose begin is to be called again stands in its line, before those that came after it. */
void order_return(job_order *order, batch_job *job);

/* The same for one in `blocked`; of others it is noted. */
void order_unblock(job_order *order, batch_job *job);

/* True if a pass may begin. */
bool order_is_any_ready(const job_order *order);

/* The job that goes on: the first of the least charged line, for a pass (*passes) or to be begun, or one that
 * is begun to share that pass; NULL if there is none. spare: of the short ones. */
batch_job *order_find_next(job_order *order, bool spare, double now, bool *passes);

/* Before and after the begin of a job that order_find_next gave: takes it out of its line. The line is
 * charged for the estimate at once, so that other threads do not all take it meanwhile, and for what begin
 * took beyond that later: `cost` is the one that the job had before. */
void order_begin(job_order *order, batch_job *job);
void order_begun(job_order *order, batch_job *job, double cost, double took);

/* A job that has begun waits for its first pass. */
void order_wait(job_order *order, batch_job *job);

/* The vectors of the next pass with `like`. Returns the number of parts. */
size_t order_choose_parts(const job_order *order, batch_job *like, batch_part parts[BATCH_PASS]);

/* After a pass that took so many seconds: charges each job for its vectors; those that are computed move on.
 */
void order_sort(job_order *order, const batch_part *parts, size_t n_parts, double took);

/* A job before its end, or NULL. */
batch_job *order_take_computed(job_order *order, bool spare);

/* A job is done. */
void order_count_done(job_order *order);

/* Moves unwanted jobs to `unwanted`, if BATCH_LOOK seconds have passed since the last look, and measures the
 * pace. */
void order_look(job_order *order);

/* Moves to `unwanted` the job that came last of the client with most jobs that wait, if these are more than
 * the jobs of `client` and one. Only the jobs of the key that have begun count; with NULL all jobs do. False
 * if there is none. O(jobs). */
bool order_evict(job_order *order, uint64_t client, const void *key);

/* Looks at one job that was not looked at for BATCH_LOOK seconds. */
bool order_is_unwanted(const job_order *order, batch_job *job, double now);

#endif
