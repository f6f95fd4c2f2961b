#include "server/queue/metrics.h"

#include "solver/codec/problem.h"

#include <pthread.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Statuses of answers that are no problems; 0 stands for a client that left. The other ones are those of the
 * classes of problems. */
static const unsigned successes[] = {0, 200, 202, 204, 304};
#define N_SUCCESSES (sizeof successes / sizeof successes[0])
#define MOST_STATUSES (N_SUCCESSES + PROBLEM_COUNT)

/* Seconds; the last bucket has no bound. */
static const double latencies[] = {.0005, .001, .0025, .005, .01, .025, .05, .1, .25, .5, 1, 2.5, 5, 10};
#define N_LATENCIES (sizeof latencies / sizeof latencies[0])

static const size_t batches[] = {1, 2, 4, 8, 16, 32, 64};
#define N_BATCHES (sizeof batches / sizeof batches[0])

static const char *const refusals[N_REFUSALS] = {
    [REFUSED_FULL] = "full",         [REFUSED_DEADLINE] = "deadline", [REFUSED_MEMORY] = "memory",
    [REFUSED_GONE] = "gone",         [REFUSED_SHARE] = "share",       [REFUSED_REFINEMENTS] = "refinements",
    [REFUSED_SHUTDOWN] = "shutdown",
};

typedef struct route_counts {
    uint64_t by_status[MOST_STATUSES + 1]; /* at n_statuses: any other */
    uint64_t by_latency[N_LATENCIES + 1];
    double seconds;
} route_counts;

struct metrics {
    pthread_mutex_t lock;
    size_t n_labels;
    const char *const *labels;
    size_t n_statuses;
    unsigned statuses[MOST_STATUSES];
    size_t in_flight;
    uint64_t by_batch[N_BATCHES + 1];
    uint64_t vectors;
    uint64_t by_wait[N_LATENCIES + 1];
    double waited; /* seconds */
    uint64_t by_refusal[N_REFUSALS];
    route_counts routes[];
};

/* The index of a status; n_statuses for any other. */
static size_t find_status(const metrics *m, unsigned status) {
    size_t s = 0;
    while (s < m->n_statuses && m->statuses[s] != status) s++;
    return s;
}

static void list_statuses(metrics *m) {
    for (; m->n_statuses < N_SUCCESSES; m->n_statuses++)
        m->statuses[m->n_statuses] = successes[m->n_statuses];
    for (int kind = PROBLEM_NONE; kind < PROBLEM_COUNT; kind++) {
        const unsigned status = problem_status((problem_kind)kind);
        if (find_status(m, status) == m->n_statuses) m->statuses[m->n_statuses++] = status;
    }
}

lam_status metrics_create(size_t n_labels, const char *const *labels, metrics **out, lam_error *error) {
    metrics *m = memory_allocate(1, sizeof *m + n_labels * sizeof m->routes[0], "metrics", error);
    if (m == NULL) return LAM_ERR_MEMORY;
    m->n_labels = n_labels;
    m->labels = labels;
    list_statuses(m);
    pthread_mutex_init(&m->lock, NULL);
    *out = m;
    return LAM_OK;
}

void metrics_destroy(metrics *m) {
    if (m == NULL) return;
    pthread_mutex_destroy(&m->lock);
    free(m);
}

void metrics_begin(metrics *m) {
    pthread_mutex_lock(&m->lock);
    m->in_flight++;
    pthread_mutex_unlock(&m->lock);
}

static size_t find_latency(double seconds) {
    size_t l = 0;
    while (l < N_LATENCIES && seconds > latencies[l]) l++;
    return l;
}

void metrics_end(metrics *m, size_t label, unsigned status, double seconds) {
    const size_t s = find_status(m, status), l = find_latency(seconds);
    pthread_mutex_lock(&m->lock);
    m->in_flight--;
    m->routes[label].by_status[s]++;
    m->routes[label].by_latency[l]++;
    m->routes[label].seconds += seconds;
    pthread_mutex_unlock(&m->lock);
}

void metrics_refuse(metrics *m, metrics_refusal why) {
    pthread_mutex_lock(&m->lock);
    m->by_refusal[why]++;
    pthread_mutex_unlock(&m->lock);
}

void metrics_wait(metrics *m, double seconds) {
    const size_t l = find_latency(seconds);
    pthread_mutex_lock(&m->lock);
    m->by_wait[l]++;
    m->waited += seconds;
    pthread_mutex_unlock(&m->lock);
}

void metrics_pass(metrics *m, size_t n_rhs) {
    size_t b = 0;
    while (b < N_BATCHES && n_rhs > batches[b]) b++;
    pthread_mutex_lock(&m->lock);
    m->by_batch[b]++;
    m->vectors += n_rhs;
    pthread_mutex_unlock(&m->lock);
}

size_t metrics_in_flight(metrics *m) {
    pthread_mutex_lock(&m->lock);
    size_t in_flight = m->in_flight;
    pthread_mutex_unlock(&m->lock);
    return in_flight;
}

static bool write_head(buffer *b, const char *name, const char *type, const char *help) {
    return buffer_printf(b, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static bool write_requests(const metrics *m, buffer *b) {
    static const char name[] = "lambertd_requests_total";
    bool written =
        write_head(b, name, "counter", "Requests by route and status; 0: the client left before the answer.");
    for (size_t r = 0; r < m->n_labels; r++)
        for (size_t s = 0; s <= m->n_statuses; s++) {
            if (m->routes[r].by_status[s] == 0) continue;
            char status[8] = "other";
            if (s < m->n_statuses) snprintf(status, sizeof status, "%u", m->statuses[s]);
            written = written && buffer_printf(b, "%s{route=\"%s\",status=\"%s\"} %llu\n", name, m->labels[r],
                                               status, (unsigned long long)m->routes[r].by_status[s]);
        }
    return written;
}

/* One histogram of times; label: "" or route="..." */
static bool write_times(buffer *b, const char *name, const char *label, const uint64_t *counts,
                        double seconds) {
    const char *comma = label[0] != '\0' ? "," : "", *open = label[0] != '\0' ? "{" : "",
               *close = label[0] != '\0' ? "}" : "";
    bool written = true;
    uint64_t sum = 0;
    for (size_t l = 0; l <= N_LATENCIES; l++) {
        char bound[16] = "+Inf";
        sum += counts[l];
        if (l < N_LATENCIES) snprintf(bound, sizeof bound, "%g", latencies[l]);
        written = written && buffer_printf(b, "%s_bucket{%s%sle=\"%s\"} %llu\n", name, label, comma, bound,
                                           (unsigned long long)sum);
    }
    return written && buffer_printf(b, "%s_sum%s%s%s %.9g\n%s_count%s%s%s %llu\n", name, open, label, close,
                                    seconds, name, open, label, close, (unsigned long long)sum);
}

static bool write_latencies(const metrics *m, buffer *b) {
    static const char name[] = "lambertd_request_duration_seconds";
    bool written = write_head(b, name, "histogram", "From a request's head to the last byte of its answer.");
    for (size_t r = 0; r < m->n_labels; r++) {
        const route_counts *counts = &m->routes[r];
        char label[128];
        uint64_t sum = 0;
        for (size_t l = 0; l <= N_LATENCIES; l++) sum += counts->by_latency[l];
        if (sum == 0) continue;
        snprintf(label, sizeof label, "route=\"%s\"", m->labels[r]);
        written = written && write_times(b, name, label, counts->by_latency, counts->seconds);
    }
    return written;
}

static bool write_waits(const metrics *m, buffer *b) {
    static const char name[] = "lambertd_queue_wait_seconds";
    return write_head(b, name, "histogram",
                      "The time that a solve waits for a thread: until it is read, and then until its first "
                      "pass.") &&
           write_times(b, name, "", m->by_wait, m->waited);
}

static bool write_refusals(const metrics *m, buffer *b) {
    static const char name[] = "lambertd_solves_refused_total";
    bool written = write_head(b, name, "counter", "Solves that were not done, or not to their end.");
    for (int why = REFUSED_NOT + 1; why < N_REFUSALS; why++)
        written = written && buffer_printf(b, "%s{why=\"%s\"} %llu\n", name, refusals[why],
                                           (unsigned long long)m->by_refusal[why]);
    return written;
}

static bool write_batches(const metrics *m, buffer *b) {
    static const char name[] = "lambertd_batch_size";
    bool written = write_head(b, name, "histogram", "Vectors in one pass over an operator.");
    uint64_t sum = 0;
    for (size_t i = 0; i <= N_BATCHES; i++) {
        char bound[16] = "+Inf";
        sum += m->by_batch[i];
        if (i < N_BATCHES) snprintf(bound, sizeof bound, "%zu", batches[i]);
        written =
            written && buffer_printf(b, "%s_bucket{le=\"%s\"} %llu\n", name, bound, (unsigned long long)sum);
    }
    return written && buffer_printf(b, "%s_sum %llu\n%s_count %llu\n", name, (unsigned long long)m->vectors,
                                    name, (unsigned long long)sum);
}

static bool write_gauge(buffer *b, const char *name, const char *help, unsigned long long value) {
    return write_head(b, name, "gauge", help) && buffer_printf(b, "%s %llu\n", name, value);
}

/* The figures of one moment, freed by the caller; NULL if memory is short. Requests wait for the copy alone,
 * not for the text. */
static metrics *copy_of(metrics *m) {
    const size_t counts = offsetof(metrics, n_labels), /* behind the lock */
        bytes = sizeof *m + m->n_labels * sizeof m->routes[0];
    metrics *copy = malloc(bytes);
    if (copy == NULL) return NULL;
    pthread_mutex_lock(&m->lock);
    memcpy((char *)copy + counts, (const char *)m + counts, bytes - counts);
    pthread_mutex_unlock(&m->lock);
    return copy;
}

bool metrics_write(metrics *all, const metrics_gauges *gauges, buffer *b) {
    metrics *m = copy_of(all);
    const bool written =
        m != NULL && write_requests(m, b) && write_latencies(m, b) && write_waits(m, b) &&
        write_refusals(m, b) && write_batches(m, b) &&
        write_gauge(b, "lambertd_in_flight", "Requests that are not answered yet.", m->in_flight) &&
        write_gauge(b, "lambertd_queued", "Solves that wait or run.", gauges->queued) &&
        write_gauge(b, "lambertd_refining", "Refinements that wait or run.", gauges->refining) &&
        write_gauge(b, "lambertd_body_bytes", "Bytes of request bodies held.", gauges->body_bytes) &&
        write_gauge(b, "lambertd_scenes", "Scenes that are served.", gauges->n_scenes) &&
        write_gauge(b, "lambertd_operator_bytes", "Bytes of operator held.", gauges->operator_bytes);
    free(m);
    return written;
}

bool metrics_write_stores(const metrics_stores *stores, buffer *b) {
    return write_gauge(b, "lambertd_stores_refused",
                       "Stores that were refused when stores were read last (/readyz names them).",
                       stores->n_refused) &&
           write_gauge(b, "lambertd_reload_success",
                       "Outcome of reading stores last, at the start or by SIGHUP: 1 if every one could be "
                       "read, else 0.",
                       stores->read_all) &&
           write_gauge(b, "lambertd_scenes_damaged", "Scenes out of service for damage.",
                       stores->n_damaged) &&
           write_gauge(b, "lambertd_scenes_unverified", "Scenes whose mapped blocks are still compared.",
                       stores->n_unverified) &&
           write_gauge(b, "lambertd_mapped_bytes", "Bytes of stores that are mapped, not copied.",
                       stores->mapped_bytes) &&
           write_gauge(b, "lambertd_verified_timestamp_seconds",
                       "Unix time when the mapped store that waits for longest was found sound; 0: not yet.",
                       (unsigned long long)stores->verified_at) &&
           write_gauge(b, "lambertd_kept_memory_bytes",
                       "Memory of stores, variants, work areas, rows, meshes, elements and form factors "
                       "(--max-memory).",
                       stores->memory);
}
