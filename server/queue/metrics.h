/* Counters of the daemon as Prometheus text. Any thread. */
#ifndef LAMBERT_SERVER_QUEUE_METRICS_H
#define LAMBERT_SERVER_QUEUE_METRICS_H

#include "solver/codec/buffer.h"
#include "store/status.h"

#include <stdint.h>

typedef struct metrics metrics;

/* labels [n_labels] are the routes, static; a label is an index into them. */
lam_status metrics_create(size_t n_labels, const char *const *labels, metrics **out, lam_error *error);
void metrics_destroy(metrics *m);

/* A request arrived; it was answered (status 0: its client left before). */
void metrics_begin(metrics *m);
void metrics_end(metrics *m, size_t label, unsigned status, double seconds);

/* A solve that is not done: it found no place; its deadline passed, or did while it waited for memory; its
 * client went; there were too many refinements; its place went to a client with fewer; the daemon ends. */
typedef enum metrics_refusal {
    REFUSED_NOT,
    REFUSED_FULL,
    REFUSED_DEADLINE,
    REFUSED_MEMORY,
    REFUSED_GONE,
    REFUSED_REFINEMENTS,
    REFUSED_SHARE,
    REFUSED_SHUTDOWN,
    N_REFUSALS
} metrics_refusal;
void metrics_refuse(metrics *m, metrics_refusal why);

/* Counts a solve that waited so long for a thread: to be read, and then for its first pass. */
void metrics_wait(metrics *m, double seconds);

/* Counts a pass over an operator by its number of vectors. */
void metrics_pass(metrics *m, size_t n_rhs);

/* Requests that are not answered yet. */
size_t metrics_in_flight(metrics *m);

/* Figures that the caller knows. */
typedef struct metrics_gauges {
    size_t n_scenes;
    uint64_t operator_bytes;
    size_t queued;     /* solves that wait or run */
    size_t refining;   /* refinements among them */
    size_t body_bytes; /* of requests, held in memory */
} metrics_gauges;

/* Appends the text. */
bool metrics_write(metrics *m, const metrics_gauges *gauges, buffer *b);

/* Figures of the scenes' mapped stores. */
typedef struct metrics_stores {
    bool read_all;                  /* none was */
    size_t n_refused;               /* stores that could not be read when stores were read last */
    size_t n_damaged, n_unverified; /* scenes out of service; scenes still being compared */
    uint64_t mapped_bytes;
    long long verified_at; /* Unix time of the oldest comparison of a mapped store; 0: none */
    uint64_t memory;       /* counted against --max-memory */
} metrics_stores;
bool metrics_write_stores(const metrics_stores *stores, buffer *b);

#endif
