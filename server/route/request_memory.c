#include "server/route/request_memory.h"

#include "solver/base/clock.h"

/* A request of less than this part of the first one that waits may overtake it. */
#define SMALL_PART 16

void request_ledger_init(request_ledger *ledger, size_t room, size_t room_of_bodies) {
    *ledger = (request_ledger){.all.room = room, .bodies.room = room_of_bodies};
    pthread_mutex_init(&ledger->lock, NULL);
}

void request_ledger_destroy(request_ledger *ledger) {
    pthread_mutex_destroy(&ledger->lock);
}

size_t request_ledger_most(const request_ledger *ledger) {
    return shares_most(&ledger->all);
}

/* True if the request comes before the other: its client holds less, or as much and it came first. */
static bool is_before(const request_ledger *ledger, const request_memory *m, const request_memory *first) {
    if (first == NULL) return true;
    const size_t held = shares_of(&ledger->all, m->client),
                 held_first = shares_of(&ledger->all, first->client);
    return held < held_first || (held == held_first && m->since < first->since);
}

static request_memory *find_first(const request_ledger *ledger) {
    request_memory *first = NULL;
    for (request_memory *m = ledger->first; m != NULL; m = m->after)
        if (is_before(ledger, m, first)) first = m;
    return first;
}

/* The bytes of those who wait: all that is taken once others are done. */
static shares find_held_waiting(const request_ledger *ledger) {
    shares then = {.room = ledger->all.room};
    for (const request_memory *m = ledger->first; m != NULL; m = m->after)
        shares_add(&then, m->client, m->held);
    return then;
}

/* The first that waits, if it was patient and waits only for those that do not wait themselves; else NULL. */
static const request_memory *find_patient(const request_ledger *ledger) {
    if (ledger->first == NULL) return NULL;
    const request_memory *first = find_first(ledger);
    if (clock_seconds() - first->since <= REQUEST_MEMORY_PATIENCE) return NULL;
    const shares then = find_held_waiting(ledger);
    return shares_allow(&then, first->client, first->wanted - first->held) ? first : NULL;
}

/* True if the request, which needs so much in all, may not overtake the patient one (or NULL). */
static bool is_held_up(const request_memory *m, size_t wanted, const request_memory *patient) {
    const shares *all = &m->ledger->all;
    return patient != NULL && patient != m && wanted >= patient->wanted / SMALL_PART &&
           (patient->client == m->client || shares_of(all, m->client) > shares_of(all, patient->client));
}

static void unlist(request_memory *m) {
    request_ledger *ledger = m->ledger;
    if (m->before != NULL)
        m->before->after = m->after;
    else
        ledger->first = m->after;
    if (m->after != NULL) m->after->before = m->before;
    m->before = m->after = NULL;
    m->waits = false;
    ledger->n_waiting--;
}

static void wake(request_memory *m, bool refused) {
    unlist(m);
    m->refused = refused;
    m->wake(m);
}

/* Grants what is free in the order of the head of request_memory.h. O(waiting) for each that goes on. */
static void grant(request_ledger *ledger) {
    for (;;) {
        const request_memory *patient = find_patient(ledger);
        request_memory *best = NULL;
        for (request_memory *m = ledger->first; m != NULL; m = m->after)
            if (shares_allow(&ledger->all, m->client, m->wanted - m->held) && is_before(ledger, m, best) &&
                !is_held_up(m, m->wanted, patient))
                best = m;
        if (best == NULL) return;
        best->assured = best->wanted;
        best->granted = best->wanted - best->held;
        shares_add(&ledger->all, best->client, best->granted);
        wake(best, false);
    }
}

/* The bytes that a client holds by waiting. */
static size_t held_waiting(const request_ledger *ledger, uint64_t client) {
    size_t sum = 0;
    for (const request_memory *m = ledger->first; m != NULL; m = m->after)
        if (m->client == client) sum += m->held;
    return sum;
}

/* True if one of those who wait could go on once all others are done. */
static bool can_any_go_on(const request_ledger *ledger) {
    const shares then = find_held_waiting(ledger);
    for (const request_memory *m = ledger->first; m != NULL; m = m->after)
        if (shares_allow(&then, m->client, m->wanted - m->held)) return true;
    return ledger->first == NULL;
}

/* Refuses the last request of the client that holds most by waiting. */
static void refuse_one(request_ledger *ledger) {
    request_memory *worst = NULL;
    size_t most = 0;
    for (request_memory *m = ledger->first; m != NULL; m = m->after) {
        const size_t held = held_waiting(ledger, m->client);
        if (held < most) continue;
        most = held;
        worst = m;
    }
    if (worst != NULL) wake(worst, true);
}

/* Gives what is free to those who wait. */
static void settle(request_ledger *ledger) {
    grant(ledger);
    while (!can_any_go_on(ledger)) {
        refuse_one(ledger);
        grant(ledger);
    }
}

/* The caller holds the lock. */
static bool take(request_memory *m, size_t bytes) {
    request_ledger *ledger = m->ledger;
    const size_t more = bytes > m->granted ? bytes - m->granted : 0;
    if (more > 0 && (!shares_allow(&ledger->all, m->client, more) ||
                     is_held_up(m, bytes_plus(m->held, bytes), find_patient(ledger))))
        return false;
    shares_add(&ledger->all, m->client, more);
    m->granted -= bytes - more;
    m->held += bytes;
    return true;
}

/* The caller holds the lock. */
static bool refuse(request_memory *m, size_t bytes, problem *why) {
    request_ledger *ledger = m->ledger;
    const size_t most = request_ledger_most(ledger), wanted = bytes_plus(m->held, bytes);
    if (wanted > most) {
        ledger->n_never++;
        if (wanted == SIZE_MAX)
            return problem_set(
                why, PROBLEM_TOO_MUCH,
                "the request takes more memory than there is (--max-request-memory %zu); send several "
                "requests",
                ledger->all.room);
        return problem_set(why, PROBLEM_TOO_MUCH,
                           "the request takes %zu bytes of memory, at most %zu (three quarters of "
                           "--max-request-memory); send "
                           "several requests, or select elements",
                           wanted, most);
    }
    m->wanted = wanted;
    return problem_set(why, PROBLEM_NO_MEMORY,
                       "the request takes %zu bytes of memory, of which others hold too much now "
                       "(--max-request-memory %zu); try again",
                       wanted, ledger->all.room);
}

bool request_memory_take(request_memory *m, size_t bytes, problem *why) {
    pthread_mutex_lock(&m->ledger->lock);
    const bool taken = take(m, bytes) || refuse(m, bytes, why);
    pthread_mutex_unlock(&m->ledger->lock);
    return taken;
}

/* The caller holds the lock. */
static bool allows_body(const request_memory *m, size_t bytes) {
    const shares *bodies = &m->ledger->bodies;
    if (shares_of(bodies, m->client) > m->body) return shares_allow(bodies, m->client, bytes);
    return bodies->taken <= bodies->room && bytes <= bodies->room - bodies->taken;
}

bool request_memory_allows_body(const request_memory *m, size_t bytes) {
    pthread_mutex_lock(&m->ledger->lock);
    const bool allowed = allows_body(m, bytes);
    pthread_mutex_unlock(&m->ledger->lock);
    return allowed;
}

bool request_memory_take_body(request_memory *m, size_t bytes, problem *why) {
    pthread_mutex_lock(&m->ledger->lock);
    const bool taken = allows_body(m, bytes) && (take(m, bytes) || refuse(m, bytes, why));
    if (taken) {
        shares_add(&m->ledger->bodies, m->client, bytes);
        m->body += bytes;
    }
    pthread_mutex_unlock(&m->ledger->lock);
    return taken;
}

void request_memory_give_back_body(request_memory *m, size_t bytes) {
    pthread_mutex_lock(&m->ledger->lock);
    shares_subtract(&m->ledger->bodies, m->client, bytes);
    m->body -= bytes;
    pthread_mutex_unlock(&m->ledger->lock);
    request_memory_give_back(m, bytes);
}

size_t request_ledger_bodies(request_ledger *ledger) {
    pthread_mutex_lock(&ledger->lock);
    const size_t bytes = ledger->bodies.taken;
    pthread_mutex_unlock(&ledger->lock);
    return bytes;
}

bool request_memory_take_of(void *owner, size_t bytes, problem *why) {
    return request_memory_take(owner, bytes, why);
}

void request_memory_give_back(request_memory *m, size_t bytes) {
    if (bytes == 0) return;
    pthread_mutex_lock(&m->ledger->lock);
    m->held -= bytes;
    const size_t has = m->held + m->granted, short_of = m->assured > has ? m->assured - has : 0,
                 kept = bytes < short_of ? bytes : short_of;
    m->granted += kept;
    shares_subtract(&m->ledger->all, m->client, bytes - kept);
    settle(m->ledger);
    pthread_mutex_unlock(&m->ledger->lock);
}

void request_memory_hand_over(request_memory *m, size_t bytes) {
    pthread_mutex_lock(&m->ledger->lock);
    m->held -= bytes;
    m->ledger->all.of[shares_place(m->client)] -= bytes;
    pthread_mutex_unlock(&m->ledger->lock);
}

void request_ledger_give_back(void *of, size_t bytes) {
    request_ledger *ledger = of;
    pthread_mutex_lock(&ledger->lock);
    ledger->all.taken -= bytes;
    settle(ledger);
    pthread_mutex_unlock(&ledger->lock);
}

bool request_memory_keep(request_memory *m, size_t bytes) {
    problem unused;
    if (bytes > m->held) return request_memory_take(m, bytes - m->held, &unused);
    m->held += m->granted; /* it is given back with the rest */
    m->granted = m->assured = 0;
    request_memory_give_back(m, m->held - bytes);
    return true;
}

void request_memory_wait(request_memory *m, void (*wake_it)(request_memory *m)) {
    request_ledger *ledger = m->ledger;
    pthread_mutex_lock(&ledger->lock);
    request_memory *last = ledger->first;
    while (last != NULL && last->after != NULL) last = last->after;
    m->wake = wake_it;
    m->refused = false;
    m->before = last;
    m->after = NULL;
    if (last != NULL)
        last->after = m;
    else
        ledger->first = m;
    /* One that waits again, as it was short of more, stays as old as it is. */
    if (m->since == 0) {
        m->since = clock_seconds();
        ledger->n_waited++;
    }
    m->waits = true;
    ledger->n_waiting++;
    settle(ledger);
    pthread_mutex_unlock(&ledger->lock);
}

void request_memory_leave(request_memory *m) {
    pthread_mutex_lock(&m->ledger->lock);
    if (m->waits) {
        unlist(m);
        settle(m->ledger);
    }
    pthread_mutex_unlock(&m->ledger->lock);
}

void request_ledger_count_full(request_ledger *ledger) {
    pthread_mutex_lock(&ledger->lock);
    ledger->n_full++;
    pthread_mutex_unlock(&ledger->lock);
}

bool request_ledger_write(request_ledger *ledger, buffer *b) {
    pthread_mutex_lock(&ledger->lock);
    const request_ledger now = {.all.room = ledger->all.room,
                                .all.taken = ledger->all.taken,
                                .n_waiting = ledger->n_waiting,
                                .n_waited = ledger->n_waited,
                                .n_full = ledger->n_full,
                                .n_never = ledger->n_never};
    pthread_mutex_unlock(&ledger->lock);
    return buffer_printf(
        b,
        "# HELP lambertd_request_memory_bytes Memory of requests, and of answers until they are sent.\n"
        "# TYPE lambertd_request_memory_bytes gauge\n"
        "lambertd_request_memory_bytes %zu\n"
        "# HELP lambertd_request_memory_limit_bytes The most of it (--max-request-memory).\n"
        "# TYPE lambertd_request_memory_limit_bytes gauge\n"
        "lambertd_request_memory_limit_bytes %zu\n"
        "# HELP lambertd_request_memory_waiting Requests that wait for memory.\n"
        "# TYPE lambertd_request_memory_waiting gauge\n"
        "lambertd_request_memory_waiting %zu\n"
        "# HELP lambertd_request_memory_waited_total Requests that have begun to wait for memory.\n"
        "# TYPE lambertd_request_memory_waited_total counter\n"
        "lambertd_request_memory_waited_total %llu\n"
        "# HELP lambertd_request_memory_refused_total Requests refused for it: others held it (full), or "
        "one alone would pass it (never).\n"
        "# TYPE lambertd_request_memory_refused_total counter\n"
        "lambertd_request_memory_refused_total{why=\"full\"} %llu\n"
        "lambertd_request_memory_refused_total{why=\"never\"} %llu\n",
        now.all.taken, now.all.room, now.n_waiting, (unsigned long long)now.n_waited,
        (unsigned long long)now.n_full, (unsigned long long)now.n_never);
}
