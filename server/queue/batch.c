/* The threads of the queue are here: each asks job_order.c for a job and runs one of its functions, begin,
 * pass, end, drop or finish, without the lock. A spare thread serves short jobs while all others are in long
 * functions. batch_delay() forecasts pace times n_jobs seconds. */
#include "server/queue/batch.h"

#include "server/queue/job_order.h"
#include "server/queue/thread_budget.h"
#include "solver/base/clock.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

/* Seconds after which a function counts as long, whatever was estimated. */
static const double is_slow = 10e-3;

typedef struct worker {
    batch_queue *queue;
    batch_workspace workspace;
    size_t member; /* of the budget */
    bool spare;    /* serves short jobs alone, and helps nobody */
    bool is_long;  /* it is in a function of a long job */
    double since;  /* when the function began; 0: it is in none */
} worker;

/* Of the jobs of one key (one operator) one pass runs at a time, and jobs that arrive meanwhile share the
 * next one. Passes of different keys run in parallel, so that a long one does not delay short ones. */
struct batch_queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    job_order order;
    double (*seconds)(void); /* the clock */
    size_t max_jobs;
    size_t n_brief; /* threads that run a function of a brief job */
    size_t n_idle;  /* threads that wait for `changed` */
    size_t n_woken; /* idle threads that were signalled and have not run yet */
    size_t n_long;  /* threads in a function of a long job, without the spare one */
    bool closed;
    pthread_cond_t spare_changed;
    bool spare_idle, spare_started;
    bool spare_asleep; /* until a job comes */
    pthread_t spare_thread;
    worker spare;
    void (*rest)(void); /* or NULL */
    thread_budget budget;
    size_t n_threads;
    pthread_t *threads; /* [n_threads] */
    worker *workers;    /* [n_threads] */
};

/* True if every thread is in a function of a long job, or in one that has taken long. */
static bool all_are_long(const batch_queue *queue) {
    if (queue->n_long == queue->n_threads) return true;
    if (queue->n_idle > 0) return false;
    const double now = queue->seconds();
    for (size_t t = 0; t < queue->n_threads; t++) {
        const worker *w = &queue->workers[t];
        if (!w->is_long && (w->since == 0 || now - w->since < is_slow)) return false;
    }
    return true;
}

/* Wakes an idle thread, unless one is already woken. A busy thread reads the lists before it waits. If all
 * are in long functions, the spare one. */
static void wake_one(batch_queue *queue) {
    if (queue->n_idle == 0) thread_budget_call(&queue->budget);
    if (queue->n_woken > 0) return;
    if (queue->n_idle > 0) {
        queue->n_woken++;
        pthread_cond_signal(&queue->changed);
    } else if (queue->spare_idle && queue->n_long == queue->n_threads) {
        queue->spare_idle = false;
        pthread_cond_signal(&queue->spare_changed);
    }
}

/* Wakes a thread for the jobs that are left. */
static void hand_over(batch_queue *queue) {
    if (queue->order.n_arrived > 0 || queue->order.computed.first != NULL ||
        order_is_any_ready(&queue->order))
        wake_one(queue);
}

/* Before and after a thread runs a function of a job. While a thread runs a brief one, arriving jobs wake
 * nobody: another thread would be there no sooner than this one, and then compete with a pass for a core. A
 * thread that begins a long one wakes another for the jobs that are left. The spare thread counts for
 * neither, as it takes no long jobs. */
static void enter_function(worker *w, const batch_job *job) {
    batch_queue *queue = w->queue;
    w->since = queue->seconds();
    w->is_long = !order_is_short(job);
    if (w->spare) return;
    queue->n_long += w->is_long;
    if (job->brief)
        queue->n_brief++;
    else
        hand_over(queue);
}

/* Returns the seconds that the function took. */
static double leave_function(worker *w, bool brief) {
    batch_queue *queue = w->queue;
    const double took = queue->seconds() - w->since;
    w->since = 0;
    if (w->spare) return took;
    queue->n_long -= w->is_long;
    if (brief) queue->n_brief--;
    return took;
}

/* The lock is released meanwhile, here and below. */
static void make_pass(worker *w, batch_job *like) {
    batch_queue *queue = w->queue;
    batch_part parts[BATCH_PASS];
    const void *key = like->key;
    const bool brief = like->brief;
    const size_t n_parts = order_choose_parts(&queue->order, like, parts);
    queue->order.passing[queue->order.n_passing++] = key;
    enter_function(w, like);
    pthread_mutex_unlock(&queue->lock);
    like->pass(parts, n_parts, &w->workspace);
    pthread_mutex_lock(&queue->lock);
    const double took = leave_function(w, brief);
    size_t mine = 0;
    while (queue->order.passing[mine] != key) mine++;
    queue->order.passing[mine] = queue->order.passing[--queue->order.n_passing];
    order_sort(&queue->order, parts, n_parts, took);
    /* This thread ends one of the jobs itself: a single one needs no other thread. */
    if (!brief &&
        (queue->order.computed.first != queue->order.computed.last || queue->order.waiting.first != NULL)) {
        thread_budget_call(&queue->budget);
        pthread_cond_broadcast(&queue->changed);
    }
}

static void finish(worker *w, batch_job *job) {
    batch_queue *queue = w->queue;
    const bool brief = job->brief;
    order_count_done(&queue->order);
    enter_function(w, job);
    if (queue->closed && queue->order.n_jobs == 0) {
        pthread_cond_broadcast(&queue->changed);
        pthread_cond_signal(&queue->spare_changed);
    }
    pthread_mutex_unlock(&queue->lock);
    job->finish(job);
    pthread_mutex_lock(&queue->lock);
    (void)leave_function(w, brief);
}

static void drop(worker *w, batch_job *job) {
    batch_queue *queue = w->queue;
    pthread_mutex_unlock(&queue->lock);
    job->drop(job);
    pthread_mutex_lock(&queue->lock);
    finish(w, job);
}

/* The job waits until it is unblocked, which may have been done while begin still ran. */
static void block(batch_queue *queue, batch_job *job) {
    job->blocked = false;
    if (job->unblocked)
        order_return(&queue->order, job);
    else
        order_add(&queue->order.blocked, job);
    job->unblocked = false;
}

static void begin(worker *w, batch_job *job) {
    batch_queue *queue = w->queue;
    const bool brief = job->brief;
    const double cost = job->cost;
    order_begin(&queue->order, job);
    enter_function(w, job);
    pthread_mutex_unlock(&queue->lock);
    const bool waits = job->begin(job, &w->workspace);
    pthread_mutex_lock(&queue->lock);
    order_begun(&queue->order, job, cost, leave_function(w, brief));
    if (waits)
        order_wait(&queue->order, job);
    else if (job->blocked)
        block(queue, job);
    else
        finish(w, job);
}

static void end(worker *w, batch_job *job) {
    batch_queue *queue = w->queue;
    const bool brief = job->brief;
    enter_function(w, job);
    pthread_mutex_unlock(&queue->lock);
    job->end(job, &w->workspace);
    pthread_mutex_lock(&queue->lock);
    queue->order.lines[job->line].charge += leave_function(w, brief);
    finish(w, job);
}

/* Serves one function; false if there is nothing to do. Computed jobs come first, so that their clients can
 * go on. */
static bool work(worker *w) {
    batch_queue *queue = w->queue;
    batch_job *job = NULL;
    order_look(&queue->order);
    if ((job = order_take(&queue->order.unwanted)) != NULL) {
        drop(w, job);
        return true;
    }
    if (w->spare && !all_are_long(queue)) return false;
    if ((job = order_take_computed(&queue->order, w->spare)) != NULL) {
        if (order_is_unwanted(&queue->order, job, clock_seconds()))
            drop(w, job);
        else
            end(w, job);
        return true;
    }
    bool passes;
    job = order_find_next(&queue->order, w->spare, queue->seconds(), &passes);
    if (job == NULL) return false;
    if (passes)
        make_pass(w, job);
    else
        begin(w, job);
    return true;
}

static void *serve(void *argument) {
    worker *w = argument;
    batch_queue *queue = w->queue;
    pthread_mutex_lock(&queue->lock);
    thread_budget_join(&queue->budget, w->member);
    for (;;) {
        if (work(w)) continue;
        if (queue->closed && queue->order.n_jobs == 0) break;
        if (thread_budget_help(&queue->budget, w->member)) continue;
        queue->n_idle++;
        pthread_cond_wait(&queue->changed, &queue->lock);
        queue->n_idle--;
        if (queue->n_woken > 0) queue->n_woken--;
    }
    pthread_mutex_unlock(&queue->lock);
    free(w->workspace.bytes);
    return NULL;
}

/* `seconds` after `t`. */
static struct timespec later(struct timespec t, double seconds) {
    t.tv_nsec += (long)(seconds * 1e9);
    t.tv_sec += t.tv_nsec / 1000000000;
    t.tv_nsec %= 1000000000;
    return t;
}

/* Sleeps until a job comes. Once there was none for BATCH_REST after some, it calls `rest` first. */
static void sleep_without_jobs(batch_queue *queue, uint64_t *rested) {
    if (queue->rest != NULL && *rested != queue->order.n_submitted) {
        const struct timespec end = later(clock_now(), BATCH_REST);
        if (pthread_cond_timedwait(&queue->spare_changed, &queue->lock, &end) != ETIMEDOUT ||
            queue->order.n_jobs > 0)
            return;
        *rested = queue->order.n_submitted;
        pthread_mutex_unlock(&queue->lock);
        queue->rest();
        pthread_mutex_lock(&queue->lock);
        return;
    }
    pthread_cond_wait(&queue->spare_changed, &queue->lock);
}

/* The spare thread. It looks at the jobs also when all others are in functions, or in one that takes longer
 * than was estimated: then as soon as that counts as long. */
static void *serve_short(void *argument) {
    worker *w = argument;
    batch_queue *queue = w->queue;
    uint64_t rested = 0;
    pthread_mutex_lock(&queue->lock);
    thread_budget_join(&queue->budget, 0); /* it asks for help and gives none */
    for (;;) {
        if (work(w)) continue;
        hand_over(queue);
        if (queue->closed && queue->order.n_jobs == 0) break;
        const struct timespec next = later(clock_now(), queue->n_idle > 0 ? BATCH_LOOK : is_slow);
        queue->spare_idle = true;
        queue->spare_asleep = queue->order.n_jobs == 0;
        if (queue->spare_asleep)
            sleep_without_jobs(queue, &rested);
        else
            pthread_cond_timedwait(&queue->spare_changed, &queue->lock, &next);
        queue->spare_idle = queue->spare_asleep = false;
    }
    pthread_mutex_unlock(&queue->lock);
    free(w->workspace.bytes);
    return NULL;
}

/* Threads and processes that the rest of the program starts later. */
enum { BESIDE = 4 };

/* A thread that holds a place for another one until the lock is free. */
static void *hold_place(void *argument) {
    batch_queue *queue = argument;
    pthread_mutex_lock(&queue->lock);
    pthread_mutex_unlock(&queue->lock);
    return NULL;
}

/* The spare one and as many of n_threads as the system allows beside those of the rest of the program. They
 * wait for the lock until their number is known. */
static void start_threads(batch_queue *queue, size_t n_threads) {
    pthread_t beside[BESIDE];
    size_t n_beside = 0;
    pthread_mutex_lock(&queue->lock);
    for (; n_beside < BESIDE; n_beside++)
        if (pthread_create(&beside[n_beside], NULL, hold_place, queue) != 0) break;
    queue->spare = (worker){.queue = queue, .spare = true};
    queue->spare_started = pthread_create(&queue->spare_thread, NULL, serve_short, &queue->spare) == 0;
    for (; queue->n_threads < n_threads; queue->n_threads++) {
        worker *w = &queue->workers[queue->n_threads];
        *w = (worker){.queue = queue, .member = queue->n_threads};
        if (pthread_create(&queue->threads[queue->n_threads], NULL, serve, w) != 0) break;
    }
    thread_budget_init(&queue->budget, queue->n_threads, &queue->lock, &queue->changed);
    pthread_mutex_unlock(&queue->lock);
    for (size_t i = 0; i < n_beside; i++) pthread_join(beside[i], NULL);
}

lam_status batch_start_by(double (*seconds)(void), size_t n_threads, size_t max_jobs, batch_queue **out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    sigset_t all, before;
    pthread_condattr_t monotonic;
    batch_queue *queue = memory_allocate(1, sizeof *queue, "threads", error);
    if (queue == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&queue->lock, NULL);
    pthread_cond_init(&queue->changed, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&queue->spare_changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    queue->max_jobs = max_jobs;
    queue->seconds = seconds;
    queue->order.passing = memory_allocate(n_threads + 1, sizeof *queue->order.passing, "threads", error);
    queue->threads = memory_allocate(n_threads, sizeof *queue->threads, "threads", error);
    queue->workers = memory_allocate(n_threads, sizeof *queue->workers, "threads", error);
    if (queue->order.passing == NULL || queue->threads == NULL || queue->workers == NULL) TRY(LAM_ERR_MEMORY);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    start_threads(queue, n_threads);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (queue->n_threads == 0) FAIL(error, LAM_ERR_MEMORY, "cannot start a thread that solves");
    *out = queue;
    queue = NULL;
done:
    if (queue != NULL) {
        batch_close(queue);
        batch_destroy(queue);
    }
    return status;
}

lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error) {
    return batch_start_by(clock_seconds, n_threads, max_jobs, out, error);
}

/* Wakes a thread that drops the job. */
static bool evict(batch_queue *queue, uint64_t client, const void *key) {
    if (!order_evict(&queue->order, client, key)) return false;
    pthread_cond_signal(&queue->spare_changed);
    return true;
}

bool batch_make_place(batch_queue *queue, uint64_t client, const void *key) {
    pthread_mutex_lock(&queue->lock);
    const bool made = evict(queue, client, key);
    pthread_mutex_unlock(&queue->lock);
    return made;
}

void batch_unblock(batch_queue *queue, batch_job *job) {
    pthread_mutex_lock(&queue->lock);
    order_unblock(&queue->order, job);
    if (queue->n_brief == 0) wake_one(queue);
    pthread_mutex_unlock(&queue->lock);
}

bool batch_submit(batch_queue *queue, batch_job *job) {
    pthread_mutex_lock(&queue->lock);
    const bool full = queue->order.n_jobs >= queue->max_jobs;
    const bool taken = !queue->closed && (!full || evict(queue, job->client, NULL));
    if (taken) {
        job->ticket = queue->order.n_submitted++;
        job->looked = clock_seconds();
        order_enter(&queue->order, job);
        order_add(&queue->order.lines[job->line].arrived, job);
        queue->order.n_arrived++;
        queue->order.n_jobs++;
        if (queue->n_brief == 0) wake_one(queue);
        if (queue->spare_asleep) {
            queue->spare_asleep = false;
            pthread_cond_signal(&queue->spare_changed);
        }
    }
    pthread_mutex_unlock(&queue->lock);
    return taken;
}

size_t batch_jobs(batch_queue *queue) {
    pthread_mutex_lock(&queue->lock);
    size_t n_jobs = queue->order.n_jobs;
    pthread_mutex_unlock(&queue->lock);
    return n_jobs;
}

size_t batch_threads(const batch_queue *queue) {
    return queue->n_threads;
}

void batch_when_resting(batch_queue *queue, void (*rest)(void)) {
    pthread_mutex_lock(&queue->lock);
    queue->rest = rest;
    pthread_mutex_unlock(&queue->lock);
}

void batch_lend(batch_queue *queue) {
    thread_budget_join(&queue->budget, 0);
}

double batch_delay(batch_queue *queue) {
    pthread_mutex_lock(&queue->lock);
    const double delay = queue->order.pace * (double)queue->order.n_jobs;
    pthread_mutex_unlock(&queue->lock);
    return delay;
}

void batch_abandon(batch_queue *queue) {
    pthread_mutex_lock(&queue->lock);
    queue->closed = queue->order.abandoned = true;
    queue->order.next_look = 0;
    pthread_cond_broadcast(&queue->changed);
    pthread_cond_signal(&queue->spare_changed);
    pthread_mutex_unlock(&queue->lock);
}

void batch_leave(batch_queue *queue) {
    for (size_t i = 0; i < queue->n_threads; i++) pthread_detach(queue->threads[i]);
    if (queue->spare_started) pthread_detach(queue->spare_thread);
}

void batch_close(batch_queue *queue) {
    pthread_mutex_lock(&queue->lock);
    queue->closed = true;
    pthread_cond_broadcast(&queue->changed);
    pthread_cond_signal(&queue->spare_changed);
    pthread_mutex_unlock(&queue->lock);
    for (size_t i = 0; i < queue->n_threads; i++) pthread_join(queue->threads[i], NULL);
    if (queue->spare_started) pthread_join(queue->spare_thread, NULL);
}

void batch_destroy(batch_queue *queue) {
    if (queue == NULL) return;
    parallel_join(NULL, 0); /* if batch_lend was called */
    pthread_cond_destroy(&queue->changed);
    pthread_cond_destroy(&queue->spare_changed);
    pthread_mutex_destroy(&queue->lock);
    free(queue->order.passing);
    free(queue->threads);
    free(queue->workers);
    free(queue);
}

void *batch_workspace_get(batch_workspace *workspace, size_t size) {
    if (workspace->size < size) {
        free(workspace->bytes);
        workspace->bytes = malloc(size);
        memory_large_pages(workspace->bytes, size);
        workspace->size = workspace->bytes == NULL ? 0 : size;
    }
    return workspace->bytes;
}
