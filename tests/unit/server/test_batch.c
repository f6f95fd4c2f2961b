/* The queue of requests: what shares a pass, who goes first, and that everybody is served once. */
#include "server/queue/batch.h"
#include "support/suite.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PASSES = 64, MOST_JOBS = 64 };

/* State that the test and the queue's threads share. */
typedef struct stage {
    pthread_mutex_t lock;
    sem_t entered; /* posted by every pass that begins */
    sem_t gate;    /* every pass waits for it */
    sem_t finished;
    size_t n_passes, n_parts[MOST_PASSES];
    size_t ids[MOST_PASSES][BATCH_PASS], firsts[MOST_PASSES][BATCH_PASS], counts[MOST_PASSES][BATCH_PASS];
    size_t at_once, most_at_once;
    batch_queue *queue;
} stage;

typedef struct job {
    batch_job job;
    stage *stage;
    size_t id, wanted;
    const void *key;
    size_t begun, computed, ended, jobs_seen;
} job;

static job *job_of(batch_job *b) {
    return (job *)(void *)b;
}

static bool job_begin(batch_job *b, batch_workspace *workspace) {
    job *self = job_of(b);
    memset(batch_workspace_get(workspace, 100), 1, 100);
    self->begun++;
    self->job.key = self->key;
    self->job.n_vectors = self->wanted;
    return self->wanted > 0;
}

static void job_pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    stage *s = job_of(parts[0].job)->stage;
    (void)workspace;
    pthread_mutex_lock(&s->lock);
    const size_t p = s->n_passes++;
    s->n_parts[p] = n_parts;
    for (size_t k = 0; k < n_parts; k++) {
        s->ids[p][k] = job_of(parts[k].job)->id;
        s->firsts[p][k] = parts[k].first;
        s->counts[p][k] = parts[k].count;
        job_of(parts[k].job)->computed += parts[k].count;
    }
    s->at_once++;
    if (s->at_once > s->most_at_once) s->most_at_once = s->at_once;
    pthread_mutex_unlock(&s->lock);
    sem_post(&s->entered);
    sem_wait(&s->gate);
    pthread_mutex_lock(&s->lock);
    s->at_once--;
    pthread_mutex_unlock(&s->lock);
}

static void job_end(batch_job *b, batch_workspace *workspace) {
    (void)workspace;
    job_of(b)->ended++;
}

static void job_finish(batch_job *b) {
    job *self = job_of(b);
    self->jobs_seen = batch_jobs(self->stage->queue);
    sem_post(&self->stage->finished);
}

/* Functions that take no time: what is begun before a pass depends on nothing but what has come. */
static double frozen(void) {
    return 1;
}

static void stage_open(stage *s, size_t n_threads, size_t max_jobs) {
    lam_error error = {.message = ""};
    *s = (stage){.n_passes = 0};
    pthread_mutex_init(&s->lock, NULL);
    sem_init(&s->entered, 0, 0);
    sem_init(&s->gate, 0, 0);
    sem_init(&s->finished, 0, 0);
    ck_assert_msg(batch_start_by(frozen, n_threads, max_jobs, &s->queue, &error) == LAM_OK, "%s",
                  error.message);
}

static void stage_close(stage *s) {
    batch_close(s->queue);
    batch_destroy(s->queue);
    sem_destroy(&s->entered);
    sem_destroy(&s->gate);
    sem_destroy(&s->finished);
    pthread_mutex_destroy(&s->lock);
}

static bool submit(stage *s, job *j, size_t id, size_t wanted, const void *key) {
    *j = (job){.stage = s, .id = id, .wanted = wanted, .key = key};
    j->job =
        (batch_job){.begin = job_begin, .pass = job_pass, .end = job_end, .finish = job_finish, .key = key};
    return batch_submit(s->queue, &j->job);
}

static void wait_for(sem_t *what, size_t count) {
    for (size_t k = 0; k < count; k++) sem_wait(what);
}

static void let_go(stage *s, size_t count) {
    for (size_t k = 0; k < count; k++) sem_post(&s->gate);
}

/* The first goes alone, at once; what came meanwhile goes together, in its order. */
START_TEST(what_queued_meanwhile_shares_a_pass) {
    stage s;
    job jobs[6];
    stage_open(&s, (size_t)_i, MOST_JOBS);
    ck_assert(submit(&s, &jobs[0], 0, 1, "scene"));
    wait_for(&s.entered, 1);
    for (size_t k = 1; k < 6; k++) ck_assert(submit(&s, &jobs[k], k, 1, "scene"));
    let_go(&s, 1);
    wait_for(&s.entered, 1);
    let_go(&s, MOST_PASSES);
    wait_for(&s.finished, 6);
    /* With a second thread some of the five may still be beginning when the pass goes. */
    ck_assert_uint_eq(s.n_parts[0], 1);
    if (_i == 1) {
        ck_assert_uint_eq(s.n_passes, 2);
        ck_assert_uint_eq(s.n_parts[1], 5);
        for (size_t k = 0; k < 5; k++) ck_assert_uint_eq(s.ids[1][k], k + 1);
    }
    ck_assert_uint_eq(s.most_at_once, 1);
    for (size_t k = 0; k < 6; k++) {
        ck_assert_uint_eq(jobs[k].begun, 1);
        ck_assert_uint_eq(jobs[k].computed, 1);
        ck_assert_uint_eq(jobs[k].ended, 1);
    }
    stage_close(&s);
}
END_TEST

/* 40 vectors take passes of 16; one who comes in between is in the very next. */
START_TEST(a_long_request_holds_up_no_short_one) {
    stage s;
    job lengthy, brief;
    stage_open(&s, 1, MOST_JOBS);
    ck_assert(submit(&s, &lengthy, 0, 40, "scene"));
    wait_for(&s.entered, 1);
    ck_assert(submit(&s, &brief, 1, 2, "scene"));
    let_go(&s, MOST_PASSES);
    wait_for(&s.finished, 2);
    ck_assert_uint_eq(s.n_passes, 3);
    ck_assert_uint_eq(s.counts[0][0], 16);
    ck_assert_uint_eq(s.n_parts[1], 2);
    ck_assert_uint_eq(s.counts[1][0] + s.counts[1][1], 16);
    ck_assert_uint_eq(s.counts[1][s.ids[1][0] == 1 ? 0 : 1] + (s.n_parts[2] == 2 ? 1 : 0), 2);
    ck_assert_uint_eq(lengthy.computed, 40);
    ck_assert_uint_eq(brief.computed, 2);
    ck_assert_uint_eq(s.firsts[1][s.ids[1][0] == 0 ? 0 : 1], 16);
    stage_close(&s);
}
END_TEST

/* More who wait than a pass holds: the first 16, then the others. */
START_TEST(a_pass_holds_sixteen) {
    stage s;
    job jobs[21];
    stage_open(&s, 1, MOST_JOBS);
    for (size_t k = 0; k < 21; k++) {
        ck_assert(submit(&s, &jobs[k], k, 1, "scene"));
        if (k == 0) wait_for(&s.entered, 1);
    }
    let_go(&s, MOST_PASSES);
    wait_for(&s.finished, 21);
    ck_assert_uint_eq(s.n_passes, 3);
    ck_assert_uint_eq(s.n_parts[1], 16);
    ck_assert_uint_eq(s.ids[1][15], 16);
    ck_assert_uint_eq(s.n_parts[2], 4);
    stage_close(&s);
}
END_TEST

/* _i brief jobs that wait: at most half a pass has the next one, unless they fill a whole one. All are served
 * in their order. */
START_TEST(brief_ones_come_evenly) {
    stage s;
    job first, jobs[40];
    const size_t n = (size_t)_i;
    stage_open(&s, 1, MOST_JOBS);
    ck_assert(submit(&s, &first, MOST_JOBS, 1, "scene"));
    wait_for(&s.entered, 1);
    for (size_t k = 0; k < n; k++) {
        jobs[k] = (job){.stage = &s, .id = k, .wanted = 1, .key = "scene"};
        jobs[k].job = (batch_job){.begin = job_begin,
                                  .pass = job_pass,
                                  .end = job_end,
                                  .finish = job_finish,
                                  .key = "scene",
                                  .brief = true};
        ck_assert(batch_submit(s.queue, &jobs[k].job));
    }
    let_go(&s, MOST_PASSES);
    wait_for(&s.finished, n + 1);
    size_t served = 0, p = 1;
    for (; served < n; p++) {
        const size_t left = n - served, most = left >= BATCH_PASS ? BATCH_PASS : BATCH_PASS / 2;
        ck_assert_uint_eq(s.n_parts[p], left < most ? left : most);
        for (size_t k = 0; k < s.n_parts[p]; k++) ck_assert_uint_eq(s.ids[p][k], served + k);
        served += s.n_parts[p];
    }
    ck_assert_uint_eq(s.n_passes, p);
    stage_close(&s);
}
END_TEST

static sem_t rests;

static void count_rest(void) {
    sem_post(&rests);
}

/* The queue rests once after each time in which jobs came, and before any has come not at all. */
START_TEST(it_rests_once_after_jobs) {
    stage s;
    job jobs[2];
    int left = 1;
    sem_init(&rests, 0, 0);
    stage_open(&s, 1, MOST_JOBS);
    batch_when_resting(s.queue, count_rest);
    for (size_t k = 0; k < 2; k++) {
        ck_assert(submit(&s, &jobs[k], k, 1, "scene"));
        let_go(&s, 1);
        wait_for(&s.finished, 1);
        wait_for(&rests, 1);
    }
    stage_close(&s);
    ck_assert_int_eq(sem_getvalue(&rests, &left), 0);
    ck_assert_int_eq(left, 0);
    sem_destroy(&rests);
}
END_TEST

/* Jobs of different keys share no pass; two threads let them go side by side. */
START_TEST(keys_have_passes_of_their_own) {
    stage s;
    job jobs[5];
    stage_open(&s, 2, MOST_JOBS);
    static const char *const keys[] = {"one", "one", "two", "two", "two"};
    ck_assert(submit(&s, &jobs[0], 0, 1, keys[0]));
    wait_for(&s.entered, 1);
    ck_assert(submit(&s, &jobs[2], 2, 1, keys[2]));
    wait_for(&s.entered, 1); /* although the other still runs */
    for (size_t k = 1; k < 5; k++)
        if (k != 2) ck_assert(submit(&s, &jobs[k], k, 1, keys[k]));
    let_go(&s, MOST_PASSES);
    wait_for(&s.finished, 5);
    ck_assert_uint_eq(s.most_at_once, 2);
    for (size_t p = 0; p < s.n_passes; p++)
        for (size_t k = 1; k < s.n_parts[p]; k++) ck_assert_str_eq(keys[s.ids[p][k]], keys[s.ids[p][0]]);
    stage_close(&s);
}
END_TEST

/* One that wants nothing computed is finished at once, though a pass runs, and is not ended. */
START_TEST(who_wants_no_pass_waits_for_none) {
    stage s;
    job slow, refused;
    stage_open(&s, 2, MOST_JOBS);
    ck_assert(submit(&s, &slow, 0, 1, "scene"));
    wait_for(&s.entered, 1);
    ck_assert(submit(&s, &refused, 1, 0, NULL));
    wait_for(&s.finished, 1);
    ck_assert_uint_eq(refused.begun, 1);
    ck_assert_uint_eq(refused.ended, 0);
    let_go(&s, 1);
    wait_for(&s.finished, 1);
    ck_assert_uint_eq(s.n_passes, 1);
    stage_close(&s);
}
END_TEST

/* Full is full, from submit until finish is called; a closed queue takes nothing and finishes what it has. */
START_TEST(places_are_counted) {
    stage s;
    job jobs[4];
    stage_open(&s, 1, 3);
    for (size_t k = 0; k < 3; k++) ck_assert(submit(&s, &jobs[k], k, 1, "scene"));
    ck_assert(!submit(&s, &jobs[3], 3, 1, "scene"));
    ck_assert_uint_eq(batch_jobs(s.queue), 3);
    let_go(&s, MOST_PASSES);
    wait_for(&s.finished, 3);
    size_t least = 3;
    for (size_t k = 0; k < 3; k++) least = jobs[k].jobs_seen < least ? jobs[k].jobs_seen : least;
    ck_assert_uint_eq(least, 0);
    for (size_t k = 0; k < 3; k++) ck_assert(submit(&s, &jobs[k], k, 17, "scene"));
    batch_close(s.queue);
    for (size_t k = 0; k < 3; k++) ck_assert_uint_eq(jobs[k].ended, 1);
    ck_assert(!batch_submit(s.queue, &jobs[3].job));
    batch_destroy(s.queue);
}
END_TEST

static void quick_pass(const batch_part *parts, size_t n_parts, batch_workspace *workspace) {
    (void)workspace;
    for (size_t k = 0; k < n_parts; k++) job_of(parts[k].job)->computed += parts[k].count;
}

static bool quick_begin(batch_job *b, batch_workspace *workspace) {
    b->pass = quick_pass;
    return job_begin(b, workspace);
}

static void *submit_quick(void *argument) {
    job *jobs = argument;
    for (size_t k = 0; k < 200; k++) {
        stage *s = jobs[k].stage;
        jobs[k] = (job){.stage = s, .id = k, .wanted = 1 + k % 23, .key = k % 3 == 0 ? "one" : "two"};
        jobs[k].job = (batch_job){.begin = quick_begin,
                                  .pass = quick_pass,
                                  .end = job_end,
                                  .finish = job_finish,
                                  .key = jobs[k].key,
                                  .brief = k % 7 < 4};
        while (!batch_submit(s->queue, &jobs[k].job)) sched_yield();
    }
    return NULL;
}

static bool gated_begin(batch_job *b, batch_workspace *workspace) {
    (void)workspace;
    stage *s = job_of(b)->stage;
    job_of(b)->begun++;
    sem_post(&s->entered);
    sem_wait(&s->gate);
    return false;
}

static bool begin_that_lets_go(batch_job *b, batch_workspace *workspace) {
    (void)workspace;
    job_of(b)->begun++;
    sem_post(&job_of(b)->stage->gate);
    return false;
}

/* While somebody is at what is brief nobody is woken for what comes. A thread that turns from that to
 * something long has another thread woken first: here the long one ends only once the last has begun. */
START_TEST(what_waits_behind_a_long_one_is_handed_over) {
    stage s;
    job jobs[3];
    stage_open(&s, 2, MOST_JOBS);
    for (int round = 0; round < 200; round++) {
        for (size_t k = 0; k < 3; k++) {
            jobs[k] = (job){.stage = &s, .id = k};
            jobs[k].job = (batch_job){.begin = k < 2 ? gated_begin : begin_that_lets_go,
                                      .pass = job_pass,
                                      .end = job_end,
                                      .finish = job_finish,
                                      .brief = k != 1};
        }
        ck_assert(batch_submit(s.queue, &jobs[0].job));
        wait_for(&s.entered, 1);
        ck_assert(batch_submit(s.queue, &jobs[1].job));
        ck_assert(batch_submit(s.queue, &jobs[2].job));
        let_go(&s, 1); /* the brief one */
        wait_for(&s.finished, 3);
        wait_for(&s.entered, 1);
        for (size_t k = 0; k < 3; k++) ck_assert_uint_eq(jobs[k].begun, 1);
    }
    stage_close(&s);
}
END_TEST

/* Many at once, from several threads: everybody gets all vectors, once. */
START_TEST(everybody_is_served_once) {
    enum { CLIENTS = 4 };
    stage s;
    static job jobs[CLIENTS][200];
    pthread_t threads[CLIENTS];
    stage_open(&s, 3, 50);
    for (int c = 0; c < CLIENTS; c++) {
        for (size_t k = 0; k < 200; k++) jobs[c][k].stage = &s;
        ck_assert_int_eq(pthread_create(&threads[c], NULL, submit_quick, jobs[c]), 0);
    }
    for (int c = 0; c < CLIENTS; c++) pthread_join(threads[c], NULL);
    wait_for(&s.finished, CLIENTS * 200);
    for (int c = 0; c < CLIENTS; c++)
        for (size_t k = 0; k < 200; k++) {
            ck_assert(jobs[c][k].begun == 1);
            ck_assert(jobs[c][k].computed == 1 + k % 23);
            ck_assert(jobs[c][k].ended == 1);
        }
    stage_close(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("batch");
    TCase *tests = tcase_create("queue");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, what_queued_meanwhile_shares_a_pass, 1, 3);
    tcase_add_test(tests, a_long_request_holds_up_no_short_one);
    tcase_add_test(tests, a_pass_holds_sixteen);
    tcase_add_loop_test(tests, brief_ones_come_evenly, 1, 41);
    tcase_add_test(tests, it_rests_once_after_jobs);
    tcase_add_test(tests, keys_have_passes_of_their_own);
    tcase_add_test(tests, who_wants_no_pass_waits_for_none);
    tcase_add_test(tests, places_are_counted);
    tcase_add_test(tests, what_waits_behind_a_long_one_is_handed_over);
    tcase_add_test(tests, everybody_is_served_once);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
