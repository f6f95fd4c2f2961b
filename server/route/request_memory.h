/* The memory that requests may take, --max-request-memory: bodies, emissions, what is computed from them, and
 * answers until their last byte is sent. It is taken before it is allocated, by what follows from shapes, and
 * given back when it is freed. The memory that the process keeps is another ledger's
 * (server/scene/memory_ledger.h). */
#ifndef LAMBERT_SERVER_ROUTE_REQUEST_MEMORY_H
#define LAMBERT_SERVER_ROUTE_REQUEST_MEMORY_H

#include "server/scene/memory_ledger.h"
#include "solver/codec/problem.h"

#include <stdint.h>

/* Of all requests. Any thread. */
typedef struct request_ledger {
    memory_ledger all;
    atomic_size_t n_full;  /* refusals where others held the room */
    atomic_size_t n_never; /* refusals of what passes the whole of it */
} request_ledger;

void request_ledger_init(request_ledger *ledger, size_t room);

/* Of one request; belongs to the thread that has the request. */
typedef struct request_memory {
    request_ledger *ledger;
    size_t held;
} request_memory;

/* Takes bytes; false with *why: 422 with the sizes if the request could never have as much, 503 if others
 * hold it. */
bool request_memory_take(request_memory *m, size_t bytes, problem *why);

/* The same for a codec_scene, whose owner is a request_memory. */
bool request_memory_take_of(void *owner, size_t bytes, problem *why);

void request_memory_give_back(request_memory *m, size_t bytes);

/* The bytes are not the request's any more, but stay taken: another gives them back to the ledger. */
static inline void request_memory_hand_over(request_memory *m, size_t bytes) {
    m->held -= bytes;
}

/* Gives back all but `bytes` of it, or takes what it is short of; false if there is no room for that. */
bool request_memory_keep(request_memory *m, size_t bytes);

/* Appends the figures of the ledger as Prometheus text. */
bool request_ledger_write(const request_ledger *ledger, buffer *b);

/* Sizes that stay SIZE_MAX once they pass it, which no ledger has. */
static inline size_t bytes_times(size_t a, size_t b) {
    size_t product;
    return __builtin_mul_overflow(a, b, &product) ? SIZE_MAX : product;
}
static inline size_t bytes_plus(size_t a, size_t b) {
    size_t sum;
    return __builtin_add_overflow(a, b, &sum) ? SIZE_MAX : sum;
}

#endif
