#include "server/queue/batch.h"

#include "server/queue/thread_budget.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

typedef struct job_list {
    batch_job *first, *last;
} job_list;

/* A job is in one of the three lists, or a thread runs one of its functions. Of the jobs of one key (one
 * operator) one pass runs at a time, and jobs that arrive meanwhile share the next one. Passes of different
 * keys run in parallel, so that a long one does not delay short ones. */
struct batch_queue {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    job_list arrived, waiting, computed; /* before begin, before or between passes, before end */
    size_t n_waiting;                    /* jobs */
    size_t n_jobs;                       /* from submit to finish */
    size_t max_jobs;
    size_t n_brief; /* threads that run a function of a brief job */
    size_t n_idle;  /* threads that wait for `changed` */
    size_t n_woken; /* idle threads that were signalled and have not run yet */
    bool closed;
    const void **passing; /* [n_threads] keys of the passes that run */
    size_t n_passing;
    thread_budget budget;
    size_t n_threads, n_numbered;
    pthread_t threads[];
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

/* With the lock: wakes an idle thread, unless one is already woken. A busy thread reads the lists before it
 * waits. */
static void wake_one(batch_queue *queue) {
    if (queue->n_idle == 0) thread_budget_call(&queue->budget);
    if (queue->n_woken > 0 || queue->n_idle == 0) return;
    queue->n_woken++;
    pthread_cond_signal(&queue->changed);
}

static size_t left_of(const batch_job *job) {
    return job->n_vectors - job->next_vector;
}

static bool is_passing(const batch_queue *queue, const void *key) {
    for (size_t k = 0; k < queue->n_passing; k++)
        if (queue->passing[k] == key) return true;
    return false;
}

/* The longest waiting job whose key has no pass now, or NULL. */
static batch_job *find_ready(const batch_queue *queue) {
    batch_job *job = queue->waiting.first;
    while (job != NULL && is_passing(queue, job->key)) job = job->next;
    return job;
}

/* With the lock, before and after a thread runs a function of a job. While a thread runs a brief one,
 * arriving jobs wake nobody: another thread would be there no sooner than this one, and then compete with a
 * pass for a core. A thread that begins a long one wakes another for the jobs that are left. */
static void enter_function(batch_queue *queue, const batch_job *job) {
    if (job->brief)
        queue->n_brief++;
    else if (queue->arrived.first != NULL || queue->computed.first != NULL || find_ready(queue) != NULL)
        wake_one(queue);
}

static void leave_function(batch_queue *queue, bool brief) {
    if (brief) queue->n_brief--;
}

/* The most jobs in the next pass. The round trip of a brief job to its client takes about as long as a pass.
 * If the waiting ones do not fill a pass, it takes half of BATCH_PASS: the others travel meanwhile, and
 * passes stay evenly filled. Without this limit passes of most jobs would alternate with passes of the few
 * that came too late. */
static size_t most_together(const batch_queue *queue, const batch_job *like) {
    return like->brief && queue->n_waiting < BATCH_PASS ? BATCH_PASS / 2 : BATCH_PASS;
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
        if (computed) queue->n_waiting--;
    }
    for (batch_job *job; (job = list_take(&again)) != NULL;) list_add(&queue->waiting, job);
}

/* With the lock, which is released meanwhile. */
static void make_pass(batch_queue *queue, batch_job *like, batch_workspace *workspace) {
    batch_part parts[BATCH_PASS];
    const void *key = like->key;
    const bool brief = like->brief;
    const size_t n_parts = choose_parts(like, most_together(queue, like), parts);
    queue->passing[queue->n_passing++] = key;
    enter_function(queue, like);
    pthread_mutex_unlock(&queue->lock);
    like->pass(parts, n_parts, workspace);
    pthread_mutex_lock(&queue->lock);
    leave_function(queue, brief);
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

/* With the lock, which is released meanwhile. */
static void finish(batch_queue *queue, batch_job *job) {
    const bool brief = job->brief;
    queue->n_jobs--;
    enter_function(queue, job);
    if (queue->closed && queue->n_jobs == 0) pthread_cond_broadcast(&queue->changed);
    pthread_mutex_unlock(&queue->lock);
    job->finish(job);
    pthread_mutex_lock(&queue->lock);
    leave_function(queue, brief);
}

/* With the lock, which is released meanwhile. */
static void begin(batch_queue *queue, batch_job *job, batch_workspace *workspace) {
    const bool brief = job->brief;
    enter_function(queue, job);
    pthread_mutex_unlock(&queue->lock);
    const bool waits = job->begin(job, workspace);
    pthread_mutex_lock(&queue->lock);
    leave_function(queue, brief);
    if (!waits) {
        finish(queue, job);
        return;
    }
    job->next_vector = 0;
    list_add(&queue->waiting, job);
    queue->n_waiting++;
}

/* With the lock, which is released meanwhile. */
static void end(batch_queue *queue, batch_job *job, batch_workspace *workspace) {
    const bool brief = job->brief;
    enter_function(queue, job);
    pthread_mutex_unlock(&queue->lock);
    job->end(job, workspace);
    pthread_mutex_lock(&queue->lock);
    leave_function(queue, brief);
    finish(queue, job);
}

/* A thread of the queue. Computed jobs come first, so that their clients can go on. A pass begins when no job
 * is left to begin or a full pass waits: jobs that arrived during one pass share the next, and none waits for
 * jobs that have not arrived. */
static void *serve(void *argument) {
    batch_queue *queue = argument;
    batch_workspace workspace = {0};
    pthread_mutex_lock(&queue->lock);
    const size_t member = queue->n_numbered++;
    thread_budget_join(&queue->budget, member);
    for (batch_job *job;;) {
        batch_job *ready = find_ready(queue);
        if ((job = list_take(&queue->computed)) != NULL)
            end(queue, job, &workspace);
        else if (ready != NULL && queue->n_waiting >= BATCH_PASS)
            make_pass(queue, ready, &workspace);
        else if ((job = list_take(&queue->arrived)) != NULL)
            begin(queue, job, &workspace);
        else if (ready != NULL)
            make_pass(queue, ready, &workspace);
        else if (queue->closed && queue->n_jobs == 0)
            break;
        else if (!thread_budget_help(&queue->budget, member)) {
            queue->n_idle++;
            pthread_cond_wait(&queue->changed, &queue->lock);
            queue->n_idle--;
            if (queue->n_woken > 0) queue->n_woken--;
        }
    }
    pthread_mutex_unlock(&queue->lock);
    free(workspace.bytes);
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

/* As many of n_threads as the system allows beside those of the rest of the program. They wait for the lock
 * until their number is known. */
static void start_threads(batch_queue *queue, size_t n_threads) {
    pthread_t beside[BESIDE];
    size_t n_beside = 0;
    pthread_mutex_lock(&queue->lock);
    for (; n_beside < BESIDE; n_beside++)
        if (pthread_create(&beside[n_beside], NULL, hold_place, queue) != 0) break;
    for (; queue->n_threads < n_threads; queue->n_threads++)
        if (pthread_create(&queue->threads[queue->n_threads], NULL, serve, queue) != 0) break;
    thread_budget_init(&queue->budget, queue->n_threads, &queue->lock, &queue->changed);
    pthread_mutex_unlock(&queue->lock);
    for (size_t i = 0; i < n_beside; i++) pthread_join(beside[i], NULL);
}

lam_status batch_start(size_t n_threads, size_t max_jobs, batch_queue **out, lam_error *error) {
    lam_status status = LAM_OK;
    sigset_t all, before;
    batch_queue *queue = memory_allocate(1, sizeof *queue + n_threads * sizeof(pthread_t), "threads", error);
    if (queue == NULL) return LAM_ERR_MEMORY;
    pthread_mutex_init(&queue->lock, NULL);
    pthread_cond_init(&queue->changed, NULL);
    queue->passing = memory_allocate(n_threads, sizeof *queue->passing, "threads", error);
    if (queue->passing == NULL) TRY(LAM_ERR_MEMORY);
    queue->max_jobs = max_jobs;
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
        list_add(&queue->arrived, job);
        queue->n_jobs++;
        if (queue->n_brief == 0) wake_one(queue);
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
    pthread_mutex_unlock(&queue->lock);
    for (size_t i = 0; i < queue->n_threads; i++) pthread_join(queue->threads[i], NULL);
}

void batch_destroy(batch_queue *queue) {
    if (queue == NULL) return;
    parallel_join(NULL, 0); /* if batch_lend was called */
    pthread_cond_destroy(&queue->changed);
    pthread_mutex_destroy(&queue->lock);
    free(queue->passing);
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
