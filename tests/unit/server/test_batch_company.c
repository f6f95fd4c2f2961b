/* Company: what may be begun before a pass to share it, by a clock of the test, whatever functions were
 * estimated to take. */
#include "server/queue/job_order.h"
#include "support/suite.h"

#include <math.h>

/* A queue whose functions take what the test says, by a clock of the test. */
enum { ACTORS = 24, KEYS = 3, MOST_THREADS = 4, STEPS = 20000 };

typedef struct actor {
    batch_job job;
    double estimate, begin_s, pass_s; /* the estimate is of begin */
    bool has_pass;
    double gathers_since; /* when the first company was begun for its next pass; INFINITY: none was */
} actor;

typedef struct simulated {
    job_order order;
    actor actors[ACTORS];
    const void *passing[MOST_THREADS];
    size_t n_threads;
    actor *in[MOST_THREADS]; /* begun by each thread; NULL: it makes a pass, or is idle */
    batch_part parts[MOST_THREADS][BATCH_PASS];
    size_t n_parts[MOST_THREADS];
    double until[MOST_THREADS], took[MOST_THREADS]; /* until INFINITY: it is idle */
    size_t n_passes, n_shared, n_company;
    double now;
} simulated;

static actor *actor_of(batch_job *job) {
    return (actor *)(void *)job;
}

static double uniform(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (double)(1 << 24);
}

/* Between .1 and 100 ms, most of them short. */
static double some_seconds(uint32_t *state) {
    return 1e-4 * pow(1e3, uniform(state) * uniform(state));
}

static void arrive(simulated *s, actor *a) {
    a->job.was_read = false;
    a->job.cost = a->estimate;
    a->job.n_vectors = 1;
    a->job.ticket = s->order.n_submitted++;
    a->gathers_since = INFINITY;
    order_enter(&s->order, &a->job);
    order_add(&s->order.lines[a->job.line].arrived, &a->job);
    s->order.n_arrived++;
}

/* The function that a thread is in ends. A job that is done comes again. */
static void end_function(simulated *s, size_t t) {
    actor *a = s->in[t];
    s->until[t] = INFINITY;
    s->in[t] = NULL;
    if (a != NULL) {
        order_begun(&s->order, &a->job, a->estimate, s->took[t]);
        if (!a->has_pass) {
            arrive(s, a);
            return;
        }
        a->job.cost = a->pass_s;
        order_wait(&s->order, &a->job);
        return;
    }
    size_t mine = 0;
    while (s->order.passing[mine] != s->parts[t][0].job->key) mine++;
    s->order.passing[mine] = s->order.passing[--s->order.n_passing];
    order_sort(&s->order, s->parts[t], s->n_parts[t], s->took[t]);
    for (batch_job *job; (job = order_take(&s->order.computed)) != NULL;) arrive(s, actor_of(job));
}

static bool is_passing(const job_order *order, const void *key) {
    bool found = false;
    for (size_t p = 0; p < order->n_passing; p++) found = found || order->passing[p] == key;
    return found;
}

/* The first job of a line that may go on: of those that have arrived, or of those that wait for a pass. */
static batch_job *first_of(const job_order *order, size_t line) {
    batch_job *arrived = order->lines[line].arrived.first, *ready = order->waiting.first;
    while (ready != NULL && (ready->line != line || is_passing(order, ready->key))) ready = ready->next;
    return arrived == NULL || (ready != NULL && ready->ticket < arrived->ticket) ? ready : arrived;
}

/* The one of the least charged line. */
static batch_job *due_job(const job_order *order) {
    batch_job *due = NULL;
    for (size_t a = 0; a < order->n_active; a++) {
        batch_job *job = first_of(order, order->active[a]);
        if (job == NULL) continue;
        const double charge = order->lines[job->line].charge,
                     least = due == NULL ? INFINITY : order->lines[due->line].charge;
        if (charge < least || (charge == least && job->ticket < due->ticket)) due = job;
    }
    return due;
}

/* An idle thread takes what goes on: the job that is due, or company for its pass. */
static void go_on(simulated *s, size_t t) {
    bool passes;
    batch_job *const due = due_job(&s->order), *job = order_find_next(&s->order, false, s->now, &passes);
    ck_assert((due == NULL) == (job == NULL));
    if (job == NULL) return;
    if (passes) {
        ck_assert_ptr_eq(job, due);
        s->n_parts[t] = order_choose_parts(&s->order, job, s->parts[t]);
        s->order.passing[s->order.n_passing++] = job->key;
        s->took[t] = actor_of(job)->pass_s;
        s->n_passes++;
        s->n_shared += s->n_parts[t] - 1;
        for (size_t p = 0; p < s->n_parts[t]; p++) actor_of(s->parts[t][p].job)->gathers_since = INFINITY;
    } else {
        if (job != due) {
            actor *leader = actor_of(due);
            ck_assert(due->was_read && due->key == job->key);
            leader->gathers_since = fmin(leader->gathers_since, s->now);
            ck_assert_double_le(s->now, leader->gathers_since + BATCH_GATHER);
            ck_assert_double_le(s->order.lines[job->line].charge,
                                s->order.lines[due->line].charge + BATCH_AHEAD);
            s->n_company++;
        }
        s->in[t] = actor_of(job);
        s->took[t] = s->in[t]->begin_s;
        order_begin(&s->order, job);
    }
    s->until[t] = s->now + s->took[t];
}

/* Costs at random, estimates that lie by up to a factor of 1000. However long begins take in truth, no job is
 * begun before another's pass, ahead of its turn, later than BATCH_GATHER after the first one was, nor one of
 * another key, nor one of a line that is charged more than that pass's and BATCH_AHEAD. So the pass waits
 * for BATCH_GATHER and for one begin of each thread. Passes are shared all the same. */
START_TEST(company_is_begun_by_the_clock) {
    static simulated s;
    uint32_t state = 1 + (uint32_t)_i;
    s = (simulated){.n_threads = 1 + (size_t)_i % MOST_THREADS};
    s.order.passing = s.passing;
    for (size_t t = 0; t < MOST_THREADS; t++) s.until[t] = INFINITY;
    for (size_t k = 0; k < ACTORS; k++) {
        actor *a = &s.actors[k];
        *a = (actor){.begin_s = some_seconds(&state), .pass_s = some_seconds(&state), .has_pass = k % 4 != 0};
        a->estimate = a->begin_s * pow(1e3, -uniform(&state));
        a->job = (batch_job){.key = &s.passing[k % KEYS], .kind = 1, .client = k / 2};
        arrive(&s, a);
    }
    for (size_t step = 0; step < STEPS; step++) {
        size_t first = 0;
        for (size_t t = 0; t < s.n_threads; t++)
            if (s.until[t] == INFINITY) go_on(&s, t);
        for (size_t t = 1; t < s.n_threads; t++)
            if (s.until[t] < s.until[first]) first = t;
        ck_assert_double_lt(s.until[first], INFINITY);
        s.now = s.until[first];
        end_function(&s, first);
    }
    ck_assert_uint_ge(s.n_company, s.n_passes / 8);
    ck_assert_uint_ge(s.n_shared, s.n_passes / 8);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("batch_company");
    TCase *tests = tcase_create("company");
    tcase_add_loop_test(tests, company_is_begun_by_the_clock, 0, 32);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
