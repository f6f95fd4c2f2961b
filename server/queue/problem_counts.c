#include "server/queue/problem_counts.h"

#include <stdio.h>
#include <string.h>

static const unsigned statuses[LIBRARY_STATUSES] = {400, 413, 414, 431, 500, 501, 505};

void problem_counts_add(problem_counts *c, problem_kind kind) {
    atomic_fetch_add_explicit(&c->by_kind[kind], 1, memory_order_relaxed);
}

void problem_counts_add_unread(problem_counts *c, unsigned status) {
    size_t at = 0;
    while (at < LIBRARY_STATUSES && statuses[at] != status) at++;
    atomic_fetch_add_explicit(&c->unread[at], 1, memory_order_relaxed);
}

/* The class of a problem: the anchor of its section in the manual. */
static const char *class_of(problem_kind kind) {
    const char *anchor = strrchr(problem_type(kind), '#');
    return anchor != NULL ? anchor + 1 : "other";
}

bool problem_counts_write(const problem_counts *c, buffer *b) {
    static const char problems[] = "lambertd_problems_total", unread[] = "lambertd_malformed_requests_total";
    bool written = buffer_printf(b,
                                 "# HELP %s Requests that were answered by a problem, by its class.\n"
                                 "# TYPE %s counter\n",
                                 problems, problems);
    for (int kind = PROBLEM_NONE + 1; kind < PROBLEM_COUNT; kind++)
        written =
            written && buffer_printf(b, "%s{problem=\"%s\"} %llu\n", problems, class_of((problem_kind)kind),
                                     (unsigned long long)atomic_load(&c->by_kind[kind]));
    written = written && buffer_printf(b,
                                       "# HELP %s Heads and bodies that libmicrohttpd could not read, by the "
                                       "status of its answer.\n# TYPE %s counter\n",
                                       unread, unread);
    for (size_t i = 0; i <= LIBRARY_STATUSES; i++) {
        char status[16] = "other";
        if (i < LIBRARY_STATUSES) snprintf(status, sizeof status, "%u", statuses[i]);
        written = written && buffer_printf(b, "%s{status=\"%s\"} %llu\n", unread, status,
                                           (unsigned long long)atomic_load(&c->unread[i]));
    }
    return written;
}
