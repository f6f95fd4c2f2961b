/* The memory that requests may take, --max-request-memory: bodies, emissions, what is computed from them, and
 * answers until their last byte is sent. It is taken before it is allocated, by what follows from shapes, and
 * given back when it is freed. The memory that the process keeps is another ledger's
 * (server/scene/memory_ledger.h). No client has more than its share (server/net/shares.h).
 *
 * Waiting. A request that finds no room, or none in its client's share, gives back all but its body and
 * waits. Freed memory goes to the waiting request whose client holds least, of those to the one that came
 * first, if there is room for all that it was short of; otherwise to the next that has room. The bytes are
 * then its own, so that nobody takes them before it goes on. Once the first of this order has waited for
 * REQUEST_MEMORY_PATIENCE seconds, it is overtaken no more by requests of at least a sixteenth of its size,
 * of its own client or of those that hold more; unless it would have no room either when all but those that
 * wait are done. Where requests that wait hold so much by their bodies that none of them could go on, the
 * last one of the client that holds most of it is refused. */
#ifndef LAMBERT_SERVER_ROUTE_REQUEST_MEMORY_H
#define LAMBERT_SERVER_ROUTE_REQUEST_MEMORY_H

#include "server/net/shares.h"
#include "solver/codec/buffer.h"
#include "solver/codec/problem.h"

#include <pthread.h>
#include <stdint.h>

#define REQUEST_MEMORY_PATIENCE 1.0

typedef struct request_memory request_memory;

/* The memory of all requests. Any thread may use it, by the functions below. */
typedef struct request_ledger {
    pthread_mutex_t lock;
    shares all, bodies;    /* bytes; bodies are part of all, with a limit of their own (--max-buffered) */
    request_memory *first; /* requests that wait */
    size_t n_waiting;
    uint64_t n_waited;        /* requests that have begun to wait */
    uint64_t n_full, n_never; /* refusals where others held the room, and of what passes the whole of it */
} request_ledger;

void request_ledger_init(request_ledger *ledger, size_t room, size_t room_of_bodies);
void request_ledger_destroy(request_ledger *ledger);

/* The most bytes that one request, or one client, may have (server/net/shares.h). */
size_t request_ledger_most(const request_ledger *ledger);

/* The memory of one request belongs to the thread that has the request. It is zero at the start but for
 * ledger. */
struct request_memory {
    request_ledger *ledger;
    uint64_t client; /* whose it is */
    size_t held;     /* taken */
    size_t body;     /* bytes of its body among them */
    size_t granted;  /* kept for it beside these */
    size_t assured;  /* after a wait, until request_memory_keep: what it gives back stays granted up to this
                        sum of both, as it may need it again to come as far as before */
    size_t wanted;   /* the least it needs in all to go on, after a take that found no room; else 0 */
    /* While it waits, with the lock of the ledger: */
    bool waits, refused;
    double since;
    void (*wake)(request_memory *m);
    request_memory *before, *after;
};

/* Takes bytes; false with *why: 422 with the sizes if the request could never have as much, 503 if others
 * hold it (`wanted` is then set). */
bool request_memory_take(request_memory *m, size_t bytes, problem *why);

/* True if so much more of the body may be held: one body of a client may take all of --max-buffered, several
 * have a share of it. */
bool request_memory_allows_body(const request_memory *m, size_t bytes);

/* Takes bytes of the body; false with *why, as above, or with none set where --max-buffered is full. */
bool request_memory_take_body(request_memory *m, size_t bytes, problem *why);
void request_memory_give_back_body(request_memory *m, size_t bytes);

/* Bytes of bodies that are held. */
size_t request_ledger_bodies(request_ledger *ledger);

/* The same for a codec_scene, whose owner is a request_memory. */
bool request_memory_take_of(void *owner, size_t bytes, problem *why);

void request_memory_give_back(request_memory *m, size_t bytes);

/* The bytes are not the request's any more, but stay taken, as nobody's: who has them gives them back to the
 * ledger (a request_ledger). */
void request_memory_hand_over(request_memory *m, size_t bytes);
void request_ledger_give_back(void *ledger, size_t bytes);

/* Gives back all but `bytes` of it, and what is granted, or takes what it is short of; false if there is no
 * room for that. */
bool request_memory_keep(request_memory *m, size_t bytes);

/* Waits for `wanted` bytes in all (of which `held` are taken). wake is called once, by any thread and maybe
 * before this returns, with the lock of the ledger held: when they are granted, or with `refused`. It must
 * not call the functions of this file. */
void request_memory_wait(request_memory *m, void (*wake)(request_memory *m));

/* Waits no more. wake neither runs nor will run when this returns. */
void request_memory_leave(request_memory *m);

/* Counts a request that is refused because others hold the room. */
void request_ledger_count_full(request_ledger *ledger);

/* Appends the figures of the ledger as Prometheus text. */
bool request_ledger_write(request_ledger *ledger, buffer *b);

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
