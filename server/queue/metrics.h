/* What the daemon counts, as Prometheus text. Any thread. */
#ifndef LAMBERT_SERVER_QUEUE_METRICS_H
#define LAMBERT_SERVER_QUEUE_METRICS_H

#include "solver/codec/buffer.h"
#include "store/status.h"

#include <stdint.h>

typedef struct metrics metrics;

/* labels[n_labels] are the routes, static; a route is known by its place among them. */
lam_status metrics_create(size_t n_labels, const char *const *labels, metrics **out, lam_error *error);
void metrics_destroy(metrics *m);

/* A request has come; has been answered (status 0: its client went before). */
void metrics_begin(metrics *m);
void metrics_end(metrics *m, size_t label, unsigned status, double seconds);

/* Vectors that one pass over an operator served. */
void metrics_pass(metrics *m, size_t n_rhs);

/* Requests that have come and are not answered yet. */
size_t metrics_in_flight(metrics *m);

/* What others know. */
typedef struct metrics_gauges {
    size_t n_scenes;
    uint64_t operator_bytes;
    size_t queued;     /* solves that wait or run */
    size_t body_bytes; /* held of requests */
} metrics_gauges;

/* Appends the text. */
bool metrics_write(metrics *m, const metrics_gauges *gauges, buffer *b);

/* What is known of the scenes' mapped stores. */
typedef struct metrics_stores {
    size_t n_damaged, n_unverified; /* scenes out of service; scenes still being compared */
    uint64_t mapped_bytes;
} metrics_stores;
bool metrics_write_stores(const metrics_stores *stores, buffer *b);

#endif
