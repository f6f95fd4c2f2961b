/* Turns of clients on the one thread that receives and sends. epoll gives each connection a turn; so a client
 * with many connections, each of which asks for little, would have most of the thread. Here each client has
 * about the same of it: while more than one client asks, a request, or a part of a long answer, whose client
 * has had its share of this round waits for one of the next rounds. A round ends when those that were let go
 * for it are served, as the thread looks at all other connections in between. A client that asks alone never
 * waits.
 *
 * Deficit round robin (Shreedhar and Varghese 1996): a client may go while its debt is below TURNS_ROUND_S,
 * each request adds what it costs, each round takes TURNS_ROUND_S off, and TURNS_FREE of the time in which
 * the thread has nothing to do is taken off, so that a client who leaves most of the thread to others does
 * not wait. Where the thread is busy only rounds take off, on slow machines too. Clients that meet in a place
 * of the table count as one (server/net/shares.h). */
#ifndef LAMBERT_SERVER_NET_TURNS_H
#define LAMBERT_SERVER_NET_TURNS_H

#include "store/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Seconds of the thread that a client may have in a round. */
#define TURNS_ROUND_S 60e-6

/* About what it takes to receive a small request and to send its answer, or to send a part of a long one. */
#define TURNS_COST_S 30e-6

#define TURNS_FREE .25

/* A client counts for so long after it asked. */
#define TURNS_SEEN_S 1.0

typedef struct turns turns;

/* A turn belongs to one request or one long answer. It is zero at the start but for the first two members. */
typedef struct turn turn;
struct turn {
    uint64_t client;
    void *connection;
    bool waits, goes; /* in a list; let go, and not yet back */
    uint64_t round;   /* of one that goes */
    turn *next;
};

/* go, which must not call the functions of this file, lets one that waits go on: turns_may is then called for
 * it again, or turns_leave. Errors: LAM_ERR_MEMORY. */
lam_status turns_create(void (*go)(turn *t), turns **out, lam_error *error);

/* NULL is allowed. Nobody waits any more. */
void turns_destroy(turns *all);

/* True if it may go on now (clock_seconds); idle: the seconds in which the thread did nothing so far, give or
 * take a constant. Otherwise turns_wait must be called, once the connection does. */
bool turns_may(turns *all, turn *t, double now, double idle);
void turns_wait(turns *all, turn *t);

/* Counts more of the thread for a client than a request takes by itself. */
void turns_charge(turns *all, uint64_t client, double seconds);

/* Its connection ends. */
void turns_leave(turns *all, turn *t);

/* Lets all go, now and from now on. */
void turns_close(turns *all);

#endif
