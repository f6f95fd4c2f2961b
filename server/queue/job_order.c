/* The order of jobs is start-time fair queuing (Goyal, Vin and Cheng 1996): the first job of the least
 * charged line goes on. A line is charged for the seconds of its jobs, for a pass by took count / (sum of
 * counts), and an empty one begins again at max(charge, now_served). batch.h has the rules. */
#include "server/queue/job_order.h"

#include "solver/base/clock.h"

#include <math.h>

/* Classes of cost. */
enum { CLASSES = 12 };

/* Seconds that a line which had no thread for its work may be ahead of the others when it has one. */
static const double most_credit = 1.0;

/* The least time over which the pace of jobs is measured. */
static const double pace_period = .25;

void order_add(job_list *list, batch_job *job) {
    job->next = NULL;
    if (list->last == NULL)
        list->first = job;
    else
        list->last->next = job;
    list->last = job;
}

batch_job *order_take(job_list *list) {
    batch_job *job = list->first;
    if (job == NULL) return NULL;
    list->first = job->next;
    if (list->first == NULL) list->last = NULL;
    return job;
}

bool order_is_short(const batch_job *job) {
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
    const uint64_t kind = 2 * job->kind + job->was_read;
    const uint64_t place = job->client * CLASSES * 128 + kind * CLASSES + class_of(job->cost);
    return (size_t)(place * UINT64_C(0x9E3779B97F4A7C15) >> 56);
}

void order_enter(job_order *order, batch_job *job) {
    job->line = find_line(job);
    job_line *l = &order->lines[job->line];
    if (l->n_jobs++ > 0) return;
    order->active[order->n_active++] = job->line;
    l->charge = fmax(l->charge, order->now_served);
}

void order_leave(job_order *order, const batch_job *job) {
    size_t a = 0;
    if (--order->lines[job->line].n_jobs > 0) return;
    while (order->active[a] != job->line) a++;
    order->active[a] = order->active[--order->n_active];
}

static void remove_job(job_list *list, const batch_job *gone) {
    job_list before = *list;
    *list = (job_list){0};
    for (batch_job *job; (job = order_take(&before)) != NULL;)
        if (job != gone) order_add(list, job);
}

static bool is_listed(const job_list *list, const batch_job *wanted) {
    const batch_job *job = list->first;
    while (job != NULL && job != wanted) job = job->next;
    return job != NULL;
}

void order_return(job_order *order, batch_job *job) {
    order_enter(order, job);
    job_list *line = &order->lines[job->line].arrived, before = *line;
    *line = (job_list){0};
    while (before.first != NULL && before.first->ticket < job->ticket) order_add(line, order_take(&before));
    order_add(line, job);
    for (batch_job *later; (later = order_take(&before)) != NULL;) order_add(line, later);
    order->n_arrived++;
}

void order_unblock(job_order *order, batch_job *job) {
    if (!is_listed(&order->blocked, job)) {
        job->unblocked = true; /* its begin has not returned yet, or nobody wants it any more */
        return;
    }
    remove_job(&order->blocked, job);
    order_return(order, job);
}

static size_t left_of(const batch_job *job) {
    return job->n_vectors - job->next_vector;
}

static bool is_passing(const job_order *order, const void *key) {
    for (size_t k = 0; k < order->n_passing; k++)
        if (order->passing[k] == key) return true;
    return false;
}

bool order_is_any_ready(const job_order *order) {
    for (const batch_job *job = order->waiting.first; job != NULL; job = job->next)
        if (!is_passing(order, job->key)) return true;
    return false;
}

/* The jobs that wait for a pass with `like`, at most BATCH_PASS. */
static size_t count_alike(const job_order *order, const batch_job *like) {
    size_t count = 0;
    for (const batch_job *job = order->waiting.first; job != NULL && count < BATCH_PASS; job = job->next)
        count += job->key == like->key && job->pass == like->pass;
    return count;
}

/* The most jobs in the next pass. The round trip of a brief job to its client takes about as long as a pass.
 * If the waiting ones do not fill a pass, it takes half of BATCH_PASS: the others travel meanwhile, and
 * passes stay evenly filled. Without this limit passes of most jobs would alternate with passes of the few
 * that came too late. */
static size_t most_together(const job_order *order, const batch_job *like) {
    return like->brief && count_alike(order, like) < BATCH_PASS ? BATCH_PASS / 2 : BATCH_PASS;
}

/* The vectors of the next pass, from all jobs with the key and pass of `like`: first one of each job, so that
 * a long request delays no short one, then the rest in their order. Returns the number of parts. */
size_t order_choose_parts(const job_order *order, batch_job *like, batch_part parts[BATCH_PASS]) {
    const size_t most = most_together(order, like);
    size_t n_parts = 0, room = BATCH_PASS;
    for (batch_job *job = like; job != NULL && n_parts < most; job = job->next) {
        if (job->key != like->key || job->pass != like->pass) continue;
        parts[n_parts++] = (batch_part){job, job->next_vector, 1};
        job->passing = true;
        room--;
    }
    for (size_t p = 0; p < n_parts && room > 0; p++) {
        const size_t more = left_of(parts[p].job) - 1 < room ? left_of(parts[p].job) - 1 : room;
        parts[p].count += more;
        room -= more;
    }
    return n_parts;
}

bool order_is_unwanted(const job_order *order, batch_job *job, double now) {
    if (job->drop == NULL) return false;
    if (order->abandoned || job->evicted) return true;
    if (job->is_wanted == NULL || now - job->looked < BATCH_LOOK) return false;
    job->looked = now;
    return !job->is_wanted(job);
}

/* Moves the unwanted jobs of a list; returns their number. Jobs in a pass belong to its thread. */
static size_t sift(job_order *order, job_list *list, bool in_line, double now) {
    job_list before = *list;
    size_t count = 0;
    *list = (job_list){0};
    for (batch_job *job; (job = order_take(&before)) != NULL;) {
        const bool unwanted = !job->passing && order_is_unwanted(order, job, now);
        order_add(unwanted ? &order->unwanted : list, job);
        if (unwanted && in_line) order_leave(order, job);
        count += unwanted;
    }
    return count;
}

/* The pace of the jobs that were done since it was last measured, and of those before. */
static void measure_pace(job_order *order, double now) {
    const double passed = now - order->pace_since;
    if (order->pace_since == 0) order->pace_since = now;
    if (order->pace_since == now || passed < pace_period) return;
    if (order->n_done == 0) {
        order->pace = fmax(order->pace, passed);
        return;
    }
    const double pace = passed / (double)order->n_done;
    order->pace = order->pace == 0 ? pace : (order->pace + pace) / 2;
    order->n_done = 0;
    order->pace_since = now;
}

void order_look(job_order *order) {
    const double now = clock_seconds();
    if (now < order->next_look) return;
    order->next_look = now + BATCH_LOOK;
    measure_pace(order, now);
    (void)sift(order, &order->waiting, true, now);
    (void)sift(order, &order->computed, false, now);
    (void)sift(order, &order->blocked, false, now);
    /* Backwards, as a line without jobs leaves its place to the last. */
    for (size_t a = order->n_active; a-- > 0;)
        order->n_arrived -= sift(order, &order->lines[order->active[a]].arrived, true, now);
}

/* Each job of a pass is charged for its vectors. */
static void charge_parts(job_order *order, const batch_part *parts, size_t n_parts, double took) {
    size_t count = 0;
    for (size_t p = 0; p < n_parts; p++) count += parts[p].count;
    for (size_t p = 0; p < n_parts; p++)
        order->lines[parts[p].job->line].charge += took * (double)parts[p].count / (double)count;
}

/* A job with vectors left waits for its next pass in `list`, unless nobody wants it any more. */
static void wait_again(job_order *order, job_list *list, batch_job *job, double now) {
    const bool unwanted = order_is_unwanted(order, job, now);
    job->gathers_until = 0;
    order_add(unwanted ? &order->unwanted : list, job);
    if (unwanted) order_leave(order, job);
}

/* Jobs of which all vectors are computed move to `computed`. Of several in a pass the others move to the end
 * of `waiting`; a single one keeps its place, before jobs that came after it. */
void order_sort(job_order *order, const batch_part *parts, size_t n_parts, double took) {
    job_list before = order->waiting, again = {0};
    const double now = clock_seconds();
    order->waiting = (job_list){0};
    charge_parts(order, parts, n_parts, took);
    for (size_t p = 0; p < n_parts; p++) {
        parts[p].job->next_vector += parts[p].count;
        parts[p].job->passing = false;
    }
    for (batch_job *job; (job = order_take(&before)) != NULL;) {
        bool served = false;
        for (size_t p = 0; p < n_parts; p++) served = served || parts[p].job == job;
        if (!served) {
            order_add(&order->waiting, job);
        } else if (left_of(job) > 0) {
            wait_again(order, n_parts == 1 ? &order->waiting : &again, job, now);
        } else {
            order_add(&order->computed, job);
            order_leave(order, job);
            job->evicted = false; /* little is left to do */
        }
    }
    for (batch_job *job; (job = order_take(&again)) != NULL;) order_add(&order->waiting, job);
}

batch_job *order_take_computed(job_order *order, bool spare) {
    batch_job *before = NULL, *job = order->computed.first;
    for (; spare && job != NULL && !order_is_short(job); job = job->next) before = job;
    if (job == NULL || before == NULL) return job == NULL ? NULL : order_take(&order->computed);
    before->next = job->next;
    if (job->next == NULL) order->computed.last = before;
    return job;
}

/* Sets `ready` of every line with jobs. */
static void find_ready(job_order *order, bool spare) {
    for (size_t a = 0; a < order->n_active; a++) order->lines[order->active[a]].ready = NULL;
    for (batch_job *job = order->waiting.first; job != NULL; job = job->next) {
        job_line *l = &order->lines[job->line];
        if (l->ready == NULL && !is_passing(order, job->key) && (!spare || order_is_short(job)))
            l->ready = job;
    }
}

/* The job of a line that goes on: the one that came first. */
static batch_job *next_of(const job_line *l, bool spare) {
    batch_job *arrived = l->arrived.first;
    if (arrived != NULL && spare && !order_is_short(arrived)) arrived = NULL;
    if (arrived == NULL || l->ready == NULL) return arrived == NULL ? l->ready : arrived;
    return arrived->ticket < l->ready->ticket ? arrived : l->ready;
}

/* The first of the least charged line, which is charged no less than most_credit below the others. */
static batch_job *find_due(job_order *order, bool spare) {
    batch_job *best = NULL;
    find_ready(order, spare);
    for (size_t a = 0; a < order->n_active; a++) {
        const job_line *l = &order->lines[order->active[a]];
        batch_job *job = next_of(l, spare);
        if (job == NULL) continue;
        const double charge = best == NULL ? INFINITY : order->lines[best->line].charge;
        if (l->charge < charge || (l->charge == charge && job->ticket < best->ticket)) best = job;
    }
    if (best == NULL) return NULL;
    job_line *l = &order->lines[best->line];
    l->charge = fmax(l->charge, order->now_served - most_credit);
    order->now_served = fmax(order->now_served, l->charge);
    return best;
}

/* The job that came first of those that may be begun before the pass of `ready`, to share it, or NULL: of its
 * key and kind, in a line that would go on within BATCH_AHEAD of charge, and short, until the clock ends it.
 */
static batch_job *find_company(const job_order *order, batch_job *ready, double now) {
    batch_job *best = NULL;
    const bool over = ready->gathers_until > 0 && now >= ready->gathers_until;
    const double most_charged = order->lines[ready->line].charge + BATCH_AHEAD;
    if (order->n_arrived == 0 || over || count_alike(order, ready) >= BATCH_PASS) return NULL;
    for (size_t a = 0; a < order->n_active; a++) {
        const job_line *l = &order->lines[order->active[a]];
        batch_job *job = l->arrived.first;
        if (job == NULL || job->key != ready->key || job->kind != ready->kind || job->cost > BATCH_GATHER ||
            l->charge > most_charged)
            continue;
        if (best == NULL || job->ticket < best->ticket) best = job;
    }
    if (best != NULL && ready->gathers_until == 0) ready->gathers_until = now + BATCH_GATHER;
    return best;
}

batch_job *order_find_next(job_order *order, bool spare, double now, bool *passes) {
    batch_job *due = find_due(order, spare);
    const bool ready = due != NULL && order->lines[due->line].ready == due;
    batch_job *company = ready ? find_company(order, due, now) : NULL;
    *passes = ready && company == NULL;
    return company != NULL ? company : due;
}

void order_begin(job_order *order, batch_job *job) {
    (void)order_take(&order->lines[job->line].arrived);
    order->n_arrived--;
    order->lines[job->line].charge += job->cost;
}

void order_begun(job_order *order, batch_job *job, double cost, double took) {
    order->lines[job->line].charge += fmax(took - cost, 0);
    order_leave(order, job);
}

void order_wait(job_order *order, batch_job *job) {
    job->next_vector = 0;
    job->was_read = true;
    job->gathers_until = 0;
    order_enter(order, job);
    order_add(&order->waiting, job);
}

/* Clients that meet in a place of this table count as one. */
enum { CLIENTS = 256 };

static size_t place_of(uint64_t client) {
    return (size_t)(client * UINT64_C(0x9E3779B97F4A7C15) >> 56);
}

/* A job that waits and may be dropped for another client's. */
static bool is_evictable(const batch_job *job, const void *key) {
    return job->drop != NULL && !job->evicted && (key == NULL || job->key == key);
}

/* Counts of jobs by client, and the job to be dropped. */
typedef struct crowd {
    const void *key;
    size_t counts[CLIENTS];
    size_t most;     /* the place with most jobs */
    batch_job *last; /* of these, the one that came last */
    job_list *of;    /* its list */
} crowd;

static void count_clients(crowd *c, const job_list *list) {
    for (const batch_job *job = list->first; job != NULL; job = job->next)
        c->counts[place_of(job->client)] += is_evictable(job, c->key);
}

static void find_last(crowd *c, job_list *list) {
    for (batch_job *job = list->first; job != NULL; job = job->next)
        if (place_of(job->client) == c->most && is_evictable(job, c->key) &&
            (c->last == NULL || job->ticket > c->last->ticket)) {
            c->last = job;
            c->of = list;
        }
}

bool order_evict(job_order *order, uint64_t client, const void *key) {
    crowd c = {.key = key};
    count_clients(&c, &order->waiting);
    if (key == NULL) count_clients(&c, &order->blocked);
    for (size_t a = 0; key == NULL && a < order->n_active; a++)
        count_clients(&c, &order->lines[order->active[a]].arrived);
    for (size_t p = 1; p < CLIENTS; p++)
        if (c.counts[p] > c.counts[c.most]) c.most = p;
    if (c.counts[c.most] <= c.counts[place_of(client)] + 1) return false;
    for (size_t a = 0; key == NULL && a < order->n_active; a++)
        find_last(&c, &order->lines[order->active[a]].arrived);
    const bool has_arrived = c.last != NULL; /* less is lost than of one that has begun */
    if (!has_arrived && key == NULL) find_last(&c, &order->blocked);
    const bool is_blocked = !has_arrived && c.last != NULL;
    if (c.last == NULL) find_last(&c, &order->waiting);
    if (c.last == NULL) return false;
    c.last->evicted = true;
    if (c.last->passing) return true; /* it belongs to the thread of its pass */
    remove_job(c.of, c.last);
    if (has_arrived) order->n_arrived--;
    if (!is_blocked) order_leave(order, c.last);
    order_add(&order->unwanted, c.last);
    return true;
}

void order_count_done(job_order *order) {
    order->n_done++;
    if (--order->n_jobs > 0) return;
    order->n_done = 0;
    order->pace_since = 0;
}
