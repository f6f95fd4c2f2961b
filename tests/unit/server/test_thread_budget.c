/* Loops of a queue's threads: idle ones help, none of more than there are, and jobs go before help. */
#include "server/queue/batch.h"
#include "solver/base/parallel.h"
#include "support/suite.h"

#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <string.h>
#include <time.h>

enum { JOBS = 24, PIECES = 500, THREADS_MOST = 70, LONG = 200000 };

/* A loop of a job, and what became of its pieces. */
typedef struct loop_job {
    batch_job job;
    size_t count, at_once, n_threads;
    atomic_int taken[PIECES];
    atomic_bool busy[THREADS_MOST];
    atomic_size_t *running, *most_running; /* threads inside loops, of all jobs */
    atomic_size_t wrong;
    sem_t *finished;
} loop_job;

static bool begin(batch_job *job, batch_workspace *workspace) {
    (void)workspace;
    job->key = job; /* all jobs at once */
    job->n_vectors = 3;
    job->cost = 1;
    return true;
}

static void end(batch_job *job, batch_workspace *workspace) {
    (void)job;
    (void)workspace;
}

static void count_pieces(const void *context, size_t thread, size_t first, size_t last) {
    loop_job *j = *(loop_job *const *)context;
    const size_t running = atomic_fetch_add(j->running, 1) + 1;
    size_t most = atomic_load(j->most_running);
    while (most < running && !atomic_compare_exchange_weak(j->most_running, &most, running)) continue;
    if (thread >= j->n_threads || atomic_exchange(&j->busy[thread], true)) atomic_fetch_add(&j->wrong, 1);
    for (size_t k = first; k < last; k++) atomic_fetch_add(&j->taken[k], 1);
    sched_yield();
    atomic_store(&j->busy[thread], false);
    atomic_fetch_sub(j->running, 1);
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    (void)workspace;
    for (size_t p = 0; p < n_parts; p++) {
        loop_job *j = (loop_job *)(void *)parts[p].job;
        parallel_share(j->n_threads, j->count, j->at_once, count_pieces, &j);
    }
}

static void finish(batch_job *job) {
    sem_post(((loop_job *)(void *)job)->finished);
}

START_TEST(each_piece_once_and_no_thread_more) {
    static const size_t counts[] = {0, 1, 2, 63, PIECES}, threads[] = {1, 2, 3, THREADS_MOST};
    const size_t n_threads = (size_t)_i;
    lam_error error = {.message = ""};
    batch_queue *queue;
    static loop_job jobs[JOBS];
    atomic_size_t running, most_running;
    sem_t finished;
    atomic_init(&running, 0);
    atomic_init(&most_running, 0);
    sem_init(&finished, 0, 0);
    ck_ok(batch_start(n_threads, JOBS, &queue, &error));
    ck_assert_uint_eq(batch_threads(queue), n_threads);
    for (size_t round = 0; round < 20; round++) {
        memset(jobs, 0, sizeof jobs);
        for (size_t k = 0; k < JOBS; k++) {
            /* The thread for short jobs, which would be one more, leaves long jobs. */
            jobs[k].job = (batch_job){.begin = begin, .pass = pass, .end = end, .finish = finish, .cost = 1};
            jobs[k].count = counts[(k + round) % 5];
            jobs[k].n_threads = threads[k % 4];
            jobs[k].at_once = 1 + k % 3 * 5;
            jobs[k].running = &running;
            jobs[k].most_running = &most_running;
            jobs[k].finished = &finished;
            ck_assert(batch_submit(queue, &jobs[k].job));
        }
        for (size_t k = 0; k < JOBS; k++) sem_wait(&finished);
        for (size_t k = 0; k < JOBS; k++) {
            ck_assert_uint_eq(atomic_load(&jobs[k].wrong), 0);
            for (size_t q = 0; q < PIECES; q++) /* one pass for all vectors */
                ck_assert_int_eq(atomic_load(&jobs[k].taken[q]), q < jobs[k].count);
        }
    }
    ck_assert_uint_le(atomic_load(&most_running), n_threads);
    batch_close(queue);
    batch_destroy(queue);
    sem_destroy(&finished);
}
END_TEST

/* Two pieces that wait for each other need two threads. */
typedef struct meeting {
    sem_t came[2];
    bool helped;
} meeting;

static void meet(const void *job, size_t thread, size_t first, size_t last) {
    meeting *m = *(meeting *const *)job;
    (void)thread;
    for (size_t k = first; k < last; k++) {
        sem_post(&m->came[k]);
        sem_wait(&m->came[1 - k]);
    }
}

typedef struct meeting_job {
    batch_job job;
    meeting *meeting;
    sem_t *finished;
} meeting_job;

static void meet_in_pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    meeting *m = ((meeting_job *)(void *)parts[0].job)->meeting;
    (void)n_parts;
    (void)workspace;
    parallel_share(2, 2, 1, meet, &m);
    m->helped = true;
}

static void finish_meeting(batch_job *job) {
    sem_post(((meeting_job *)(void *)job)->finished);
}

/* From a thread of the queue, and from one that only asks for help. */
START_TEST(idle_threads_help) {
    lam_error error = {.message = ""};
    batch_queue *queue;
    meeting m = {.helped = false}, *of_main = &m;
    sem_t finished;
    meeting_job j = {.job = {.begin = begin, .pass = meet_in_pass, .end = end, .finish = finish_meeting},
                     .meeting = &m,
                     .finished = &finished};
    sem_init(&finished, 0, 0);
    for (size_t k = 0; k < 2; k++) sem_init(&m.came[k], 0, 0);
    ck_ok(batch_start(2, JOBS, &queue, &error));
    ck_assert(batch_submit(queue, &j.job));
    sem_wait(&finished);
    ck_assert(m.helped);
    batch_lend(queue);
    ck_assert_uint_eq(parallel_threads(), 2);
    parallel_share(2, 2, 1, meet, &of_main);
    batch_close(queue);
    batch_destroy(queue);
}
END_TEST

/* A long loop, and a job that comes while the second thread helps with it. */
typedef struct long_loop {
    batch_job job;
    sem_t helping, finished;
    atomic_bool served;
    atomic_size_t before; /* pieces that the helper took before the job was served */
    size_t own;           /* the number of the thread that opened it, plus 1 */
} long_loop;

static void wait_for_job(const void *job, size_t thread, size_t first, size_t last) {
    long_loop *l = *(long_loop *const *)job;
    (void)last;
    if (first == 0 || first == LONG / 2) { /* either thread begins with one of these */
        size_t none = 0;
        if (!__atomic_compare_exchange_n(&l->own, &none, thread + 1, false, __ATOMIC_SEQ_CST,
                                         __ATOMIC_SEQ_CST))
            sem_post(&l->helping);
    }
    if (atomic_load(&l->served)) return;
    atomic_fetch_add(&l->before, 1);
    const struct timespec pause = {.tv_nsec = 100000};
    nanosleep(&pause, NULL);
}

static void long_pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    long_loop *l = (long_loop *)(void *)parts[0].job;
    (void)n_parts;
    (void)workspace;
    parallel_share(2, LONG, 1, wait_for_job, &l);
}

static void finish_long(batch_job *job) {
    sem_post(&((long_loop *)(void *)job)->finished);
}

typedef struct short_job {
    batch_job job;
    long_loop *beside;
} short_job;

static bool begin_short(batch_job *job, batch_workspace *workspace) {
    (void)job;
    (void)workspace;
    return false;
}

static void finish_short(batch_job *job) {
    long_loop *l = ((short_job *)(void *)job)->beside;
    atomic_store(&l->served, true);
    sem_post(&l->finished);
}

START_TEST(jobs_go_before_help) {
    lam_error error = {.message = ""};
    batch_queue *queue;
    static long_loop l;
    short_job quick = {.job = {.begin = begin_short, .finish = finish_short}, .beside = &l};
    l.job = (batch_job){.begin = begin, .pass = long_pass, .end = end, .finish = finish_long};
    sem_init(&l.helping, 0, 0);
    sem_init(&l.finished, 0, 0);
    ck_ok(batch_start(2, JOBS, &queue, &error));
    ck_assert(batch_submit(queue, &l.job));
    sem_wait(&l.helping);
    ck_assert(batch_submit(queue, &quick.job));
    sem_wait(&l.finished);
    sem_wait(&l.finished);
    ck_assert(atomic_load(&l.served));
    ck_assert_uint_lt(atomic_load(&l.before), LONG / 2);
    batch_close(queue);
    batch_destroy(queue);
}
END_TEST

/* Two pieces of a loop, in two threads at once, of which the helper's ends last. */
typedef struct slow_help {
    batch_job job;
    sem_t came[2];
    pthread_t caller;
    atomic_bool done[2];
    bool is_whole; /* both pieces were done when the loop returned */
    sem_t *finished;
} slow_help;

static void help_slowly(const void *context, size_t thread, size_t first, size_t last) {
    slow_help *s = *(slow_help *const *)context;
    (void)thread;
    for (size_t k = first; k < last; k++) {
        sem_post(&s->came[k]);
        sem_wait(&s->came[1 - k]);
        if (!pthread_equal(pthread_self(), s->caller))
            nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
        atomic_store(&s->done[k], true);
    }
}

static void wait_in_pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    slow_help *s = (slow_help *)(void *)parts[0].job;
    (void)n_parts;
    (void)workspace;
    s->caller = pthread_self();
    parallel_share(2, 2, 1, help_slowly, &s);
    s->is_whole = atomic_load(&s->done[0]) && atomic_load(&s->done[1]);
}

static void finish_slowly(batch_job *job) {
    sem_post(((slow_help *)(void *)job)->finished);
}

/* The loop, and all that it uses, lies on the stack of its thread. */
START_TEST(helpers_are_waited_for) {
    lam_error error = {.message = ""};
    batch_queue *queue;
    sem_t finished;
    static slow_help s;
    s.job = (batch_job){.begin = begin, .pass = wait_in_pass, .end = end, .finish = finish_slowly, .cost = 1};
    s.finished = &finished;
    sem_init(&finished, 0, 0);
    for (size_t k = 0; k < 2; k++) sem_init(&s.came[k], 0, 0);
    ck_ok(batch_start(2, JOBS, &queue, &error));
    ck_assert(batch_submit(queue, &s.job));
    sem_wait(&finished);
    ck_assert(s.is_whole);
    batch_close(queue);
    batch_destroy(queue);
    for (size_t k = 0; k < 2; k++) sem_destroy(&s.came[k]);
    sem_destroy(&finished);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("thread budget");
    TCase *tests = tcase_create("thread budget");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, each_piece_once_and_no_thread_more, 1, 6);
    tcase_add_test(tests, idle_threads_help);
    tcase_add_test(tests, jobs_go_before_help);
    tcase_add_test(tests, helpers_are_waited_for);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
