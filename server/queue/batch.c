#include "server/queue/batch.h"

#include "server/queue/thread_budget.h"
#include "solver/base/clock.h"

#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

typedef struct job_list {
    batch_job *first, *last;
} job_list;

enum { LINES = 256, CLASSES = 12 };

/* Seconds that a line which had no thread for its work may be ahead of the others when it has one. */
static const double most_credit = 1.0;

/* Seconds after which a function counts as long, whatever was estimated; how often this is looked at. */
static const double is_slow = 10e-3, look_every = 50e-3;

/* Jobs of one client, kind and class of cost. */
typedef struct line {
    job_list arrived; /* before begin */
    size_t n_jobs;    /* not computed yet */
    double charge;    /* seconds */
    batch_job *ready; /* scratch of choose: the first that waits for a pass which may begin */
} line;

typedef struct worker {
    batch_queue *queue;
    batch_workspace workspace;
    size_t member; /* of the budget */
    bool spare;    /* serves short jobs alone, and helps nobody */
    bool is_long;  /* it is in a function of a long job */
    double since;  /* when the function began; 0: it is in none */
} worker;

/* A job is in one of the lists, or a thread runs one of its functions. Of the jobs of one key (one operator)
 * one pass runs at a time, and jobs that arrive meanwhile share the next one. Passes of different keys run in
 * parallel, so that a long one does not delay short ones. */
struct batch_queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    job_list waiting, computed; /* before or between passes, before end */
    size_t n_arrived, n_jobs;   /* jobs in `arrived`; from submit to finish */
    size_t max_jobs;
    uint64_t n_submitted, n_begun;
    size_t n_brief; /* threads that run a function of a brief job */
    size_t n_idle;  /* threads that wait for `changed` */
    size_t n_woken; /* idle threads that were signalled and have not run yet */
    size_t n_long;  /* threads in a function of a long job, without the spare one */
    bool closed;
    double now_served; /* the charge of the line that was served last */
    line lines[LINES];
    size_t active[LINES], n_active; /* the lines that have jobs */
    const void **passing;           /* [n_threads + 1] keys of the passes that run */
    size_t n_passing;
    pthread_cond_t spare_changed;
    bool spare_idle, spare_started;
    bool spare_asleep; /* until a job comes */
    pthread_t spare_thread;
    worker spare;
    thread_budget budget;
    size_t n_threads;
    pthread_t *threads; /* [n_threads] */
    worker *workers;    /* [n_threads] */
};

static void list_add(job_list *list, batch_job *job) {
    job->next = NULL;
    if (list->last == NULL)
        list->first = job;
    else
        list->last->next = job;
    list->last = job;
}

static batch_job *list_take(job_list *list) {
    batch_job *job = list->first;
    if (job == NULL) return NULL;
    list->first = job->next;
    if (list->first == NULL) list->last = NULL;
    return job;
}

static bool is_short(const batch_job *job) {
    return job->cost <= BATCH_SHORT;
}

/* 0 below a millisecond, then one more for every factor of 4. */
static unsigned class_of(double cost) {
    int exponent = 0;
    (void)frexp(cost / 1e-3, &exponent);
    const int class = (exponent + 1) / 2;
    return class < 0 ? 0 : class < CLASSES ? (unsigned)class : CLASSES - 1;
}

static size_t find_line(const batch_job *job) {
    const uint64_t place = job->client * CLASSES * 64 + job->kind * CLASSES + class_of(job->cost);
    return (size_t)(place * UINT64_C(0x9E3779B97F4A7C15) >> 56);
}

/* With the lock, as all below. */
static void enter_line(batch_queue *queue, batch_job *job) {
    job->line = find_line(job);
    line *l = &queue->lines[job->line];
    if (l->n_jobs++ > 0) return;
    queue->active[queue->n_active++] = job->line;
    l->charge = fmax(l->charge, queue->now_served);
}

static void leave_line(batch_queue *queue, const batch_job *job) {
    size_t a = 0;
    if (--queue->lines[job->line].n_jobs > 0) return;
    while (queue->active[a] != job->line) a++;
    queue->active[a] = queue->active[--queue->n_active];
}

/* True if every thread is in a function of a long job, or in one that has taken long. */
static bool all_are_long(const batch_queue *queue) {
    if (queue->n_long == queue->n_threads) return true;
    if (queue->n_idle > 0) return false;
    const double now = clock_seconds();
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

static size_t left_of(const batch_job *job) {
    return job->n_vectors - job->next_vector;
}

static bool is_passing(const batch_queue *queue, const void *key) {
    for (size_t k = 0; k < queue->n_passing; k++)
        if (queue->passing[k] == key) return true;
    return false;
}

static bool is_any_ready(const batch_queue *queue) {
    for (const batch_job *job = queue->waiting.first; job != NULL; job = job->next)
        if (!is_passing(queue, job->key)) return true;
    return false;
}

/* The jobs that wait for a pass with `like`, at most BATCH_PASS. */
static size_t count_alike(const batch_queue *queue, const batch_job *like) {
    size_t count = 0;
    for (const batch_job *job = queue->waiting.first; job != NULL && count < BATCH_PASS; job = job->next)
        count += job->key == like->key && job->pass == like->pass;
    return count;
}

/* Wakes a thread for the jobs that are left. */
static void hand_over(batch_queue *queue) {
    if (queue->n_arrived > 0 || queue->computed.first != NULL || is_any_ready(queue)) wake_one(queue);
}

/* Before and after a thread runs a function of a job. While a thread runs a brief one, arriving jobs wake
 * nobody: another thread would be there no sooner than this one, and then compete with a pass for a core. A
 * thread that begins a long one wakes another for the jobs that are left. The spare thread counts for
 * neither, as it takes no long jobs. */
static void enter_function(worker *w, const batch_job *job) {
    batch_queue *queue = w->queue;
    w->since = clock_seconds();
    w->is_long = !is_short(job);
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
    const double took = clock_seconds() - w->since;
    w->since = 0;
    if (w->spare) return took;
    queue->n_long -= w->is_long;
    if (brief) queue->n_brief--;
    return took;
}

/* The most jobs in the next pass. The round trip of a brief job to its client takes about as long as a pass.
 * If the waiting ones do not fill a pass, it takes half of BATCH_PASS: the others travel meanwhile, and
 * passes stay evenly filled. Without this limit passes of most jobs would alternate with passes of the few
 * that came too late. */
static size_t most_together(const batch_queue *queue, const batch_job *like) {
    return like->brief && count_alike(queue, like) < BATCH_PASS ? BATCH_PASS / 2 : BATCH_PASS;
}

/* The vectors of the next pass, from all jobs with the key and pass of `like`: first one of each job, so that
 * a long request delays no short one, then the rest in their order. Returns the number of parts. */
static size_t choose_parts(batch_job *like, size_t most, batch_part parts[BATCH_PASS]) {
    size_t n_parts = 0, room = BATCH_PASS;
    for (batch_job *job = like; job != NULL && n_parts < most; job = job->next) {
        if (job->key != like->key || job->pass != like->pass) continue;
        parts[n_parts++] = (batch_part){job, job->next_vector, 1};
        room--;
    }
    for (size_t p = 0; p < n_parts && room > 0; p++) {
        const size_t more = left_of(parts[p].job) - 1 < room ? left_of(parts[p].job) - 1 : room;
        parts[p].count += more;
        room -= more;
    }
    return n_parts;
}

/* After a pass: its jobs move to `computed` if all their vectors are, otherwise to the end of `waiting`. */
static void sort_waiting(batch_queue *queue, const batch_part *parts, size_t n_parts) {
    job_list before = queue->waiting, again = {0};
    queue->waiting = (job_list){0};
    for (size_t p = 0; p < n_parts; p++) parts[p].job->next_vector += parts[p].count;
    for (batch_job *job; (job = list_take(&before)) != NULL;) {
        bool served = false;
        for (size_t p = 0; p < n_parts; p++) served = served || parts[p].job == job;
        const bool computed = served && left_of(job) == 0;
        list_add(computed ? &queue->computed : served ? &again : &queue->waiting, job);
        if (computed) leave_line(queue, job);
    }
    for (batch_job *job; (job = list_take(&again)) != NULL;) {
        job->begun = queue->n_begun;
        list_add(&queue->waiting, job);
    }
}

/* Each job of a pass is charged for its vectors. */
static void charge_parts(batch_queue *queue, const batch_part *parts, size_t n_parts, double took) {
    size_t count = 0;
    for (size_t p = 0; p < n_parts; p++) count += parts[p].count;
    for (size_t p = 0; p < n_parts; p++)
        queue->lines[parts[p].job->line].charge += took * (double)parts[p].count / (double)count;
}

/* The lock is released meanwhile, here and below. */
static void make_pass(worker *w, batch_job *like) {
    batch_queue *queue = w->queue;
    batch_part parts[BATCH_PASS];
    const void *key = like->key;
    const bool brief = like->brief;
    const size_t n_parts = choose_parts(like, most_together(queue, like), parts);
    queue->passing[queue->n_passing++] = key;
    enter_function(w, like);
    pthread_mutex_unlock(&queue->lock);
    like->pass(parts, n_parts, &w->workspace);
    pthread_mutex_lock(&queue->lock);
    charge_parts(queue, parts, n_parts, leave_function(w, brief));
    size_t mine = 0;
    while (queue->passing[mine] != key) mine++;
    queue->passing[mine] = queue->passing[--queue->n_passing];
    sort_waiting(queue, parts, n_parts);
    /* This thread ends one of the jobs itself: a single one needs no other thread. */
    if (!brief && (queue->computed.first != queue->computed.last || queue->waiting.first != NULL)) {
        thread_budget_call(&queue->budget);
        pthread_cond_broadcast(&queue->changed);
    }
}

static void finish(worker *w, batch_job *job) {
    batch_queue *queue = w->queue;
    const bool brief = job->brief;
    queue->n_jobs--;
    enter_function(w, job);
    if (queue->closed && queue->n_jobs == 0) {
        pthread_cond_broadcast(&queue->changed);
        pthread_cond_signal(&queue->spare_changed);
    }
    pthread_mutex_unlock(&queue->lock);
    job->finish(job);
    pthread_mutex_lock(&queue->lock);
    (void)leave_function(w, brief);
}

/* The line is charged for the estimate at once, so that other threads do not all take it meanwhile, and for
 * what the function took beyond that later. */
static void begin(worker *w, batch_job *job) {
    batch_queue *queue = w->queue;
    const bool brief = job->brief;
    const double cost = job->cost;
    line *l = &queue->lines[job->line];
    queue->n_begun++;
    l->charge += cost;
    enter_function(w, job);
    pthread_mutex_unlock(&queue->lock);
    const bool waits = job->begin(job, &w->workspace);
    pthread_mutex_lock(&queue->lock);
    l->charge += fmax(leave_function(w, brief) - cost, 0);
    leave_line(queue, job);
    if (!waits) {
        finish(w, job);
        return;
    }
    job->next_vector = 0;
    job->begun = queue->n_begun;
    enter_line(queue, job);
    list_add(&queue->waiting, job);
}

static void end(worker *w, batch_job *job) {
    batch_queue *queue = w->queue;
    const bool brief = job->brief;
    enter_function(w, job);
    pthread_mutex_unlock(&queue->lock);
    job->end(job, &w->workspace);
    pthread_mutex_lock(&queue->lock);
    queue->lines[job->line].charge += leave_function(w, brief);
    finish(w, job);
}

static batch_job *take_computed(batch_queue *queue, bool spare) {
    batch_job *before = NULL, *job = queue->computed.first;
    for (; spare && job != NULL && !is_short(job); job = job->next) before = job;
    if (job == NULL || before == NULL) return job == NULL ? NULL : list_take(&queue->computed);
    before->next = job->next;
    if (job->next == NULL) queue->computed.last = before;
    return job;
}

/* Sets `ready` of every line with jobs. */
static void find_ready(batch_queue *queue, bool spare) {
    for (size_t a = 0; a < queue->n_active; a++) queue->lines[queue->active[a]].ready = NULL;
    for (batch_job *job = queue->waiting.first; job != NULL; job = job->next) {
        line *l = &queue->lines[job->line];
        if (l->ready == NULL && !is_passing(queue, job->key) && (!spare || is_short(job))) l->ready = job;
    }
}

/* The job of a line that goes on: the one that came first. */
static batch_job *next_of(const line *l, bool spare) {
    batch_job *arrived = l->arrived.first;
    if (arrived != NULL && spare && !is_short(arrived)) arrived = NULL;
    if (arrived == NULL || l->ready == NULL) return arrived == NULL ? l->ready : arrived;
    return arrived->ticket < l->ready->ticket ? arrived : l->ready;
}

/* The next of the least charged line, and of equal ones the one that came first; NULL if nothing can go on.
 */
static batch_job *find_next(const batch_queue *queue, bool spare) {
    batch_job *best = NULL;
    for (size_t a = 0; a < queue->n_active; a++) {
        const line *l = &queue->lines[queue->active[a]];
        batch_job *job = next_of(l, spare);
        if (job == NULL) continue;
        const double charge = best == NULL ? INFINITY : queue->lines[best->line].charge;
        if (l->charge < charge || (l->charge == charge && job->ticket < best->ticket)) best = job;
    }
    return best;
}

/* The longest waiting job that may be begun before a pass of `ready`, to share it, or NULL. */
static batch_job *find_company(const batch_queue *queue, const batch_job *ready) {
    batch_job *best = NULL;
    if (queue->n_arrived == 0 || queue->n_begun - ready->begun >= BATCH_PASS ||
        count_alike(queue, ready) >= BATCH_PASS)
        return NULL;
    for (size_t a = 0; a < queue->n_active; a++) {
        batch_job *job = queue->lines[queue->active[a]].arrived.first;
        if (job == NULL || job->kind != ready->kind || job->cost > fmax(ready->cost, BATCH_GATHER)) continue;
        if (best == NULL || job->ticket < best->ticket) best = job;
    }
    return best;
}

/* Serves one function; false if there is nothing to do. Computed jobs come first, so that their clients can
 * go on. */
static bool work(worker *w) {
    batch_queue *queue = w->queue;
    batch_job *job = NULL;
    if (w->spare && !all_are_long(queue)) return false;
    if ((job = take_computed(queue, w->spare)) != NULL) {
        end(w, job);
        return true;
    }
    find_ready(queue, w->spare);
    job = find_next(queue, w->spare);
    if (job == NULL) return false;
    line *l = &queue->lines[job->line];
    l->charge = fmax(l->charge, queue->now_served - most_credit);
    queue->now_served = fmax(queue->now_served, l->charge);
    if (job == l->ready) {
        batch_job *company = find_company(queue, job);
        if (company == NULL) {
            make_pass(w, job);
            return true;
        }
        job = company;
    }
    (void)list_take(&queue->lines[job->line].arrived);
    queue->n_arrived--;
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
        if (queue->closed && queue->n_jobs == 0) break;
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

/* The spare thread. While there are jobs it looks every 50 ms, as a function may take longer than was
 * estimated. */
static void *serve_short(void *argument) {
    worker *w = argument;
    batch_queue *queue = w->queue;
    pthread_mutex_lock(&queue->lock);
    thread_budget_join(&queue->budget, 0); /* it asks for help and gives none */
    for (;;) {
        if (work(w)) continue;
        hand_over(queue);
        if (queue->closed && queue->n_jobs == 0) break;
        const struct timespec next = later(clock_now(), look_every);
        queue->spare_idle = true;
        queue->spare_asleep = queue->n_jobs == 0;
        if (queue->spare_asleep)
            pthread_cond_wait(&queue->spare_changed, &queue->lock);
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

lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error) {
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
    queue->passing = memory_allocate(n_threads + 1, sizeof *queue->passing, "threads", error);
    queue->threads = memory_allocate(n_threads, sizeof *queue->threads, "threads", error);
    queue->workers = memory_allocate(n_threads, sizeof *queue->workers, "threads", error);
    if (queue->passing == NULL || queue->threads == NULL || queue->workers == NULL) TRY(LAM_ERR_MEMORY);
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

bool batch_submit(batch_queue *queue, batch_job *job) {
    pthread_mutex_lock(&queue->lock);
    const bool taken = !queue->closed && queue->n_jobs < queue->max_jobs;
    if (taken) {
        job->ticket = queue->n_submitted++;
        enter_line(queue, job);
        list_add(&queue->lines[job->line].arrived, job);
        queue->n_arrived++;
        queue->n_jobs++;
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
    size_t n_jobs = queue->n_jobs;
    pthread_mutex_unlock(&queue->lock);
    return n_jobs;
}

size_t batch_threads(const batch_queue *queue) {
    return queue->n_threads;
}

void batch_lend(batch_queue *queue) {
    thread_budget_join(&queue->budget, 0);
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
    free(queue->passing);
    free(queue->threads);
    free(queue->workers);
    free(queue);
}

void *batch_workspace_get(batch_workspace *workspace, size_t size) {
    if (workspace->size < size) {
        free(workspace->bytes);
        workspace->bytes = malloc(size);
        workspace->size = workspace->bytes == NULL ? 0 : size;
    }
    return workspace->bytes;
}
