#include "server/route/request_memory.h"

void request_ledger_init(request_ledger *ledger, size_t room) {
    atomic_init(&ledger->all.room, room);
    atomic_init(&ledger->all.taken, 0);
    atomic_init(&ledger->n_full, 0);
    atomic_init(&ledger->n_never, 0);
}

bool request_memory_take(request_memory *m, size_t bytes, problem *why) {
    request_ledger *ledger = m->ledger;
    if (memory_ledger_take(&ledger->all, bytes)) {
        m->held += bytes;
        return true;
    }
    const size_t room = atomic_load(&ledger->all.room), wanted = bytes_plus(m->held, bytes);
    if (wanted > room) {
        atomic_fetch_add(&ledger->n_never, 1);
        if (wanted == SIZE_MAX)
            return problem_set(
                why, PROBLEM_TOO_MUCH,
                "the request takes more memory than there is (--max-request-memory %zu); send several "
                "requests",
                room);
        return problem_set(
            why, PROBLEM_TOO_MUCH,
            "the request takes %zu bytes of memory, at most %zu (--max-request-memory); send several "
            "requests, or select elements",
            wanted, room);
    }
    atomic_fetch_add(&ledger->n_full, 1);
    return problem_set(why, PROBLEM_NO_MEMORY,
                       "the request takes %zu bytes of memory, of which others hold too much now "
                       "(--max-request-memory %zu); try again",
                       wanted, room);
}

bool request_memory_take_of(void *owner, size_t bytes, problem *why) {
    return request_memory_take(owner, bytes, why);
}

void request_memory_give_back(request_memory *m, size_t bytes) {
    m->held -= bytes;
    memory_ledger_give_back(&m->ledger->all, bytes);
}

bool request_memory_keep(request_memory *m, size_t bytes) {
    problem unused;
    if (bytes > m->held) return request_memory_take(m, bytes - m->held, &unused);
    request_memory_give_back(m, m->held - bytes);
    return true;
}

bool request_ledger_write(const request_ledger *ledger, buffer *b) {
    return buffer_printf(
        b,
        "# HELP lambertd_request_memory_bytes Memory of requests, and of answers until they are sent.\n"
        "# TYPE lambertd_request_memory_bytes gauge\n"
        "lambertd_request_memory_bytes %zu\n"
        "# HELP lambertd_request_memory_limit_bytes The most of it (--max-request-memory).\n"
        "# TYPE lambertd_request_memory_limit_bytes gauge\n"
        "lambertd_request_memory_limit_bytes %zu\n"
        "# HELP lambertd_request_memory_refused_total Requests refused for it: others held it (full), or "
        "one alone would pass it (never).\n"
        "# TYPE lambertd_request_memory_refused_total counter\n"
        "lambertd_request_memory_refused_total{why=\"full\"} %zu\n"
        "lambertd_request_memory_refused_total{why=\"never\"} %zu\n",
        atomic_load(&ledger->all.taken), atomic_load(&ledger->all.room), atomic_load(&ledger->n_full),
        atomic_load(&ledger->n_never));
}
