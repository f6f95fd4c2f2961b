/* The order of the queue: lines of kinds and costs, their shares, what a job that is ready for its pass waits
 * for, and the thread for short jobs. Costs are what a line is charged, as the functions take no time
 * themselves. */
#include "server/queue/batch.h"
#include "server/queue/job_order.h"
#include "support/suite.h"

#include <math.h>
#include <pthread.h>
#include <semaphore.h>
#include <time.h>

enum { MOST = 400 };

typedef struct record {
    pthread_mutex_t lock;
    sem_t finished, held, gate;
    size_t n;
    size_t ids[MOST]; /* of begins, or of passes plus MOST, in their order */
    batch_queue *queue;
} record;

typedef struct job {
    batch_job job;
    record *record;
    size_t id, wanted;
    double then; /* cost once begun */
} job;

static job *job_of(batch_job *b) {
    return (job *)(void *)b;
}

static void note(record *r, size_t id) {
    pthread_mutex_lock(&r->lock);
    r->ids[r->n++] = id;
    pthread_mutex_unlock(&r->lock);
}

static bool begin(batch_job *b, batch_workspace *workspace) {
    (void)workspace;
    job *self = job_of(b);
    note(self->record, self->id);
    b->key = self->record;
    b->n_vectors = self->wanted;
    b->cost = self->then;
    return self->wanted > 0;
}

static bool begin_held(batch_job *b, batch_workspace *workspace) {
    (void)workspace;
    record *r = job_of(b)->record;
    sem_post(&r->held);
    sem_wait(&r->gate);
    return false;
}

static void pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    (void)workspace;
    for (size_t p = 0; p < n_parts; p++) note(job_of(parts[p].job)->record, MOST + job_of(parts[p].job)->id);
}

static void end(batch_job *b, batch_workspace *workspace) {
    (void)b;
    (void)workspace;
}

static void finish(batch_job *b) {
    sem_post(&job_of(b)->record->finished);
}

static void submit(record *r, job *j, size_t id, unsigned kind, double cost, size_t wanted, double then) {
    *j = (job){.record = r, .id = id, .wanted = wanted, .then = then};
    j->job = (batch_job){
        .begin = begin, .pass = pass, .end = end, .finish = finish, .key = r, .kind = kind, .cost = cost};
    ck_assert(batch_submit(r->queue, &j->job));
}

/* Keeps a thread in a function of this cost until the gate opens. */
static void hold(record *r, job *j, double cost) {
    *j = (job){.record = r};
    j->job = (batch_job){.begin = begin_held, .finish = finish, .kind = 60, .cost = cost};
    ck_assert(batch_submit(r->queue, &j->job));
    sem_wait(&r->held);
}

static void record_open(record *r, size_t n_threads) {
    lam_error error = {.message = ""};
    *r = (record){.n = 0};
    pthread_mutex_init(&r->lock, NULL);
    sem_init(&r->finished, 0, 0);
    sem_init(&r->held, 0, 0);
    sem_init(&r->gate, 0, 0);
    ck_assert_msg(batch_start(n_threads, MOST, &r->queue, &error) == LAM_OK, "%s", error.message);
}

static void record_close(record *r, size_t n_jobs) {
    sem_post(&r->gate);
    for (size_t k = 0; k < n_jobs; k++) sem_wait(&r->finished);
    batch_close(r->queue);
    batch_destroy(r->queue);
    sem_destroy(&r->finished);
    sem_destroy(&r->held);
    sem_destroy(&r->gate);
    pthread_mutex_destroy(&r->lock);
}

/* Two kinds, whose jobs cost 10 and 40 ms: while both have work, what they are charged differs by no more
 * than one job of each, and each kind keeps its order. */
START_TEST(kinds_have_equal_shares) {
    enum { N = 100 };
    static job jobs[2 * N], first;
    static const double costs[2] = {10e-3, 40e-3};
    record r;
    record_open(&r, 1);
    hold(&r, &first, 1);
    for (size_t k = 0; k < N; k++) submit(&r, &jobs[k], k, 1, costs[0], 0, 0);
    for (size_t k = 0; k < N; k++) submit(&r, &jobs[N + k], N + k, 2, costs[1], 0, 0);
    record_close(&r, 2 * N + 1);
    size_t next[2] = {0};
    double charge[2] = {0};
    ck_assert_uint_eq(r.n, 2 * N);
    for (size_t k = 0; k < r.n; k++) {
        const size_t kind = r.ids[k] / N;
        ck_assert_uint_eq(r.ids[k] % N, next[kind]++);
        charge[kind] += costs[kind];
        if (next[0] < N && next[1] < N) ck_assert_double_le(fabs(charge[0] - charge[1]), 50e-3 + 1e-9);
    }
}
END_TEST

/* A pass of .4 s over three vectors of one kind and one of another is charged to them by these. */
START_TEST(a_pass_is_charged_by_vectors) {
    static job_order order;
    batch_job jobs[2] = {{.kind = 1, .n_vectors = 3}, {.kind = 2, .n_vectors = 1}};
    batch_part parts[2];
    double before[2];
    for (size_t k = 0; k < 2; k++) {
        order_enter(&order, &jobs[k]);
        order_add(&order.waiting, &jobs[k]);
        parts[k] = (batch_part){&jobs[k], 0, jobs[k].n_vectors};
    }
    ck_assert_uint_ne(jobs[0].line, jobs[1].line);
    for (size_t k = 0; k < 2; k++) before[k] = order.lines[jobs[k].line].charge;
    const size_t lines[2] = {jobs[0].line, jobs[1].line};
    order_sort(&order, parts, 2, .4);
    ck_assert_double_eq_tol(order.lines[lines[0]].charge - before[0], .3, 1e-12);
    ck_assert_double_eq_tol(order.lines[lines[1]].charge - before[1], .1, 1e-12);
}
END_TEST

/* A job of a kind that had none goes next, behind any number of others. */
START_TEST(a_new_kind_goes_next) {
    enum { N = 200 };
    static job jobs[N], first, last;
    record r;
    record_open(&r, 1);
    hold(&r, &first, 1);
    for (size_t k = 0; k < N; k++) submit(&r, &jobs[k], k, 1, 48e-3, 0, 0);
    submit(&r, &last, N, 2, 5e-3, 0, 0);
    record_close(&r, N + 2);
    size_t at = 0;
    while (r.ids[at] != N) at++;
    ck_assert_uint_le(at, 1);
}
END_TEST

/* Eight jobs that take .3 s to begin, and were estimated at .4 ms, wait beside one of another operator that
 * is ready for its pass: none is begun before that. */
START_TEST(others_are_no_company) {
    static job jobs[8], first, waits;
    record r;
    record_open(&r, 1);
    hold(&r, &first, 1);
    submit(&r, &waits, 0, 1, 5e-3, 1, 6e-3);
    for (size_t k = 1; k <= 8; k++) {
        jobs[k - 1] = (job){.record = &r, .id = k};
        jobs[k - 1].job =
            (batch_job){.begin = begin, .finish = finish, .key = &jobs, .kind = 1, .cost = 5e-3};
        ck_assert(batch_submit(r.queue, &jobs[k - 1].job));
    }
    record_close(&r, 10);
    ck_assert_uint_eq(r.ids[0], 0);
    ck_assert_uint_eq(r.ids[1], MOST);
}
END_TEST

/* A job that was read stands in no line with longer ones of about its cost that are still to be read, however
 * many came before it: it was overtaken by all of them. Costs are above BATCH_SHORT, so that the one ordinary
 * thread serves all, one after the other, and that of its pass is below theirs, so that they do not share it.
 */
START_TEST(a_read_job_waits_for_no_begins_of_its_cost) {
    enum { N = 100 };
    static job jobs[N], first, solve;
    record r;
    record_open(&r, 1);
    hold(&r, &first, 1);
    for (size_t k = 0; k < N; k++) submit(&r, &jobs[k], k, 1, 10e-3, 0, 0);
    submit(&r, &solve, N, 1, 20e-3, 1, 8e-3);
    record_close(&r, N + 2);
    size_t at = 0;
    while (r.ids[at] != MOST + N) at++;
    ck_assert_uint_le(at, 3);
}
END_TEST

/* All threads are in long functions: short jobs are served all the same, with their passes, and long ones
 * wait. */
START_TEST(short_jobs_wait_for_no_long_function) {
    job held[2], briefs[20], lengthy;
    record r;
    record_open(&r, 2);
    hold(&r, &held[0], 1);
    hold(&r, &held[1], .1);
    submit(&r, &lengthy, 99, 1, .1, 0, 0);
    for (size_t k = 0; k < 20; k++) submit(&r, &briefs[k], k, 1, 1e-4, k % 2, 1e-4);
    for (size_t k = 0; k < 20; k++) sem_wait(&r.finished);
    pthread_mutex_lock(&r.lock);
    ck_assert_uint_eq(r.n, 30);
    for (size_t k = 0; k < r.n; k++) ck_assert_uint_ne(r.ids[k], 99);
    pthread_mutex_unlock(&r.lock);
    sem_post(&r.gate);
    record_close(&r, 3);
}
END_TEST

/* The same where the functions were estimated to be short. */
START_TEST(a_wrong_estimate_holds_up_no_short_job) {
    job held, brief;
    record r;
    record_open(&r, 1);
    hold(&r, &held, 1e-4);
    submit(&r, &brief, 0, 1, 1e-4, 1, 1e-4);
    sem_wait(&r.finished);
    record_close(&r, 1);
}
END_TEST

/* The id of a job that is not wanted, in its record. */
enum { DROPPED = 3 * MOST };

static bool is_never_wanted(batch_job *b) {
    (void)b;
    return false;
}

static bool is_always_wanted(batch_job *b) {
    (void)b;
    return true;
}

static void drop(batch_job *b) {
    note(job_of(b)->record, DROPPED + job_of(b)->id);
}

static void submit_with(record *r, job *j, size_t id, bool (*is_wanted)(batch_job *)) {
    *j = (job){.record = r, .id = id, .wanted = 1, .then = 1};
    j->job = (batch_job){.begin = begin,
                         .pass = pass,
                         .end = end,
                         .finish = finish,
                         .is_wanted = is_wanted,
                         .drop = drop,
                         .kind = 1,
                         .cost = 1};
    ck_assert(batch_submit(r->queue, &j->job));
}

/* Jobs that nobody wants are dropped while all threads are in functions; the others are served. */
START_TEST(unwanted_jobs_are_dropped) {
    static job jobs[40], held;
    record r;
    record_open(&r, 1);
    hold(&r, &held, 1);
    for (size_t k = 0; k < 40; k++) submit_with(&r, &jobs[k], k, k % 2 ? is_always_wanted : is_never_wanted);
    for (size_t k = 0; k < 20; k++) sem_wait(&r.finished);
    pthread_mutex_lock(&r.lock);
    ck_assert_uint_eq(r.n, 20);
    for (size_t k = 0; k < 20; k++) ck_assert_uint_eq(r.ids[k], DROPPED + 2 * k);
    pthread_mutex_unlock(&r.lock);
    ck_assert_uint_eq(batch_jobs(r.queue), 21);
    record_close(&r, 21);
    for (size_t k = 20; k < r.n; k++) ck_assert_uint_lt(r.ids[k], DROPPED);
    ck_assert_uint_eq(r.n, 60);
}
END_TEST

/* An abandoned queue drops what waits, and after their function those that have a drop. */
START_TEST(an_abandoned_queue_drops_all) {
    static job jobs[20], held, late;
    record r;
    record_open(&r, 1);
    hold(&r, &held, 1);
    for (size_t k = 0; k < 20; k++) submit_with(&r, &jobs[k], k, is_always_wanted);
    batch_abandon(r.queue);
    for (size_t k = 0; k < 20; k++) sem_wait(&r.finished);
    ck_assert_uint_eq(batch_jobs(r.queue), 1);
    late = jobs[0];
    ck_assert(!batch_submit(r.queue, &late.job));
    record_close(&r, 1);
    for (size_t k = 0; k < r.n; k++) ck_assert_uint_ge(r.ids[k], DROPPED);
}
END_TEST

/* A full queue drops jobs of the client with most of them for others, the last ones first, until these have
 * as many but one; none for a client alone. */
START_TEST(places_are_shared) {
    static job jobs[MOST], others[MOST], held;
    record r;
    record_open(&r, 1);
    hold(&r, &held, 1);
    held.job.client = 1;
    for (size_t k = 0; k < MOST - 1; k++) submit_with(&r, &jobs[k], k, is_always_wanted);
    job one_more = jobs[0];
    ck_assert(!batch_submit(r.queue, &one_more.job));
    size_t n_others = 0;
    for (; n_others < MOST; n_others++) {
        job *j = &others[n_others];
        *j = jobs[0];
        j->id = MOST + n_others;
        j->job.client = 77;
        if (!batch_submit(r.queue, &j->job)) break;
        sem_wait(&r.finished); /* the dropped one */
    }
    ck_assert_uint_eq(n_others, MOST / 2 - 1);
    pthread_mutex_lock(&r.lock);
    ck_assert_uint_eq(r.n, n_others);
    for (size_t k = 0; k < r.n; k++) ck_assert_uint_eq(r.ids[k], DROPPED + MOST - 2 - k);
    r.n = 0;
    pthread_mutex_unlock(&r.lock);
    ck_assert_uint_eq(batch_jobs(r.queue), MOST);
    batch_abandon(r.queue);
    record_close(&r, MOST);
}
END_TEST

/* The delay is the jobs at their pace: one waits behind a function of .6 s. */
START_TEST(the_delay_follows_the_pace) {
    static job held, waits;
    record r;
    record_open(&r, 1);
    ck_assert_double_eq(batch_delay(r.queue), 0);
    hold(&r, &held, 1);
    submit(&r, &waits, 0, 1, 1, 0, 0);
    const struct timespec while_held = {.tv_nsec = 600000000};
    nanosleep(&while_held, NULL);
    ck_assert_double_ge(batch_delay(r.queue), .5);
    record_close(&r, 2);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("batch_order");
    TCase *tests = tcase_create("order");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, kinds_have_equal_shares);
    tcase_add_test(tests, a_pass_is_charged_by_vectors);
    tcase_add_test(tests, a_new_kind_goes_next);
    tcase_add_test(tests, others_are_no_company);
    tcase_add_test(tests, a_read_job_waits_for_no_begins_of_its_cost);
    tcase_add_test(tests, short_jobs_wait_for_no_long_function);
    tcase_add_test(tests, a_wrong_estimate_holds_up_no_short_job);
    tcase_add_test(tests, unwanted_jobs_are_dropped);
    tcase_add_test(tests, an_abandoned_queue_drops_all);
    tcase_add_test(tests, places_are_shared);
    tcase_add_test(tests, the_delay_follows_the_pace);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
