/* Jobs whose begin cannot go on yet: they keep their turn, their place, and their drop. */
#include "server/queue/batch.h"
#include "support/suite.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <unistd.h>

enum { MOST = 32 };

typedef struct record {
    pthread_mutex_t lock;
    sem_t begun, gate, finished;
    size_t n, ids[MOST]; /* of begins and, plus MOST, of drops */
    batch_queue *queue;
} record;

typedef struct job {
    batch_job job;
    record *record;
    size_t id;
    atomic_size_t n_begun;
    bool blocks, early, holds;
    atomic_bool unwanted, waits; /* waits: seen by the queue among those that wait, after a begin */
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
    job *self = job_of(b);
    (void)workspace;
    note(self->record, self->id);
    b->blocked = self->blocks && atomic_fetch_add(&self->n_begun, 1) == 0;
    if (b->blocked && self->early) batch_unblock(self->record->queue, b);
    sem_post(&self->record->begun);
    if (self->holds) sem_wait(&self->record->gate);
    return false;
}

static void finish(batch_job *b) {
    sem_post(&job_of(b)->record->finished);
}

static bool is_wanted(batch_job *b) {
    job *self = job_of(b);
    if (atomic_load(&self->n_begun) > 0) atomic_store(&self->waits, true);
    return !atomic_load(&self->unwanted);
}

static void drop(batch_job *b) {
    note(job_of(b)->record, MOST + job_of(b)->id);
}

static void start(record *r, size_t most_jobs) {
    lam_error error = {.message = ""};
    pthread_mutex_init(&r->lock, NULL);
    sem_init(&r->begun, 0, 0);
    sem_init(&r->gate, 0, 0);
    sem_init(&r->finished, 0, 0);
    ck_ok(batch_start(1, most_jobs, &r->queue, &error));
}

static void stop(record *r) {
    ck_assert_uint_eq(batch_jobs(r->queue), 0);
    batch_close(r->queue);
    batch_destroy(r->queue);
}

/* The jobs are long, so that the thread for short ones leaves them, and stand in one line of a client. */
static void submit(record *r, job *j, size_t id, uint64_t client) {
    j->record = r;
    j->id = id;
    j->job = (batch_job){
        .begin = begin, .finish = finish, .is_wanted = is_wanted, .drop = drop, .client = client, .cost = 1};
    ck_assert(batch_submit(r->queue, &j->job));
}

static void wait_for(sem_t *what, size_t count) {
    while (count-- > 0) sem_wait(what);
}

static void check_order(const record *r, size_t n, const size_t ids[]) {
    ck_assert_uint_eq(r->n, n);
    for (size_t k = 0; k < n; k++) ck_assert_msg(r->ids[k] == ids[k], "%zu: %zu", k, r->ids[k]);
}

START_TEST(they_keep_their_turn) {
    record r = {.n = 0};
    job jobs[4] = {{.blocks = true}, {.holds = true}, {.blocks = false}, {.blocks = false}};
    start(&r, MOST);
    submit(&r, &jobs[0], 0, 0);
    wait_for(&r.begun, 1);
    submit(&r, &jobs[1], 1, 0);
    wait_for(&r.begun, 1);
    ck_assert_uint_eq(batch_jobs(r.queue), 2);
    submit(&r, &jobs[2], 2, 0);
    submit(&r, &jobs[3], 3, 0);
    batch_unblock(r.queue, &jobs[0].job);
    sem_post(&r.gate);
    wait_for(&r.finished, 4);
    check_order(&r, 5, (const size_t[]){0, 1, 0, 2, 3});
    stop(&r);
}
END_TEST

START_TEST(they_may_be_unblocked_at_once) {
    record r = {.n = 0};
    job j = {.blocks = true, .early = true};
    start(&r, MOST);
    submit(&r, &j, 0, 0);
    wait_for(&r.finished, 1);
    check_order(&r, 2, (const size_t[]){0, 0});
    stop(&r);
}
END_TEST

START_TEST(they_are_dropped) {
    record r = {.n = 0};
    job jobs[2] = {{.blocks = true}, {.blocks = true}};
    start(&r, MOST);
    for (size_t k = 0; k < 2; k++) submit(&r, &jobs[k], k, 0);
    wait_for(&r.begun, 2);
    atomic_store(&jobs[0].unwanted, true);
    wait_for(&r.finished, 1);
    check_order(&r, 3, (const size_t[]){0, 1, MOST});
    /* Also by a queue that is given up. */
    batch_abandon(r.queue);
    wait_for(&r.finished, 1);
    check_order(&r, 4, (const size_t[]){0, 1, MOST, MOST + 1});
    stop(&r);
}
END_TEST

START_TEST(they_give_their_places_away) {
    record r = {.n = 0};
    job jobs[4] = {{.blocks = true}, {.blocks = true}, {.blocks = true}, {.blocks = false}};
    start(&r, 3);
    for (size_t k = 0; k < 3; k++) submit(&r, &jobs[k], k, 7);
    wait_for(&r.begun, 3);
    /* The last begin may not have returned yet. */
    while (!atomic_load(&jobs[2].waits)) usleep(1000);
    submit(&r, &jobs[3], 3, 8);
    wait_for(&r.finished, 2);
    ck_assert_uint_eq(r.n, 5);
    ck_assert((r.ids[3] == 3 && r.ids[4] == MOST + 2) || (r.ids[3] == MOST + 2 && r.ids[4] == 3));
    for (size_t k = 0; k < 2; k++) batch_unblock(r.queue, &jobs[k].job);
    wait_for(&r.finished, 2);
    ck_assert_uint_eq(r.n, 7);
    stop(&r);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("blocked jobs");
    TCase *tests = tcase_create("blocked jobs");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, they_keep_their_turn);
    tcase_add_test(tests, they_may_be_unblocked_at_once);
    tcase_add_test(tests, they_are_dropped);
    tcase_add_test(tests, they_give_their_places_away);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
