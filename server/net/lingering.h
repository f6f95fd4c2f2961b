/* Connections whose answer left before all of their request had come. To close one at once would make the
 * kernel reset it, and its client lose the answer (RFC 9112, 9.6): their bytes are read and dropped instead.
 * Knows sockets, not HTTP. */
#ifndef LAMBERT_SERVER_NET_LINGERING_H
#define LAMBERT_SERVER_NET_LINGERING_H

#include "store/status.h"

typedef struct lingering lingering;

/* Called by the thread that reads. */
typedef struct lingering_calls {
    bool (*take)(void *context, void *who, size_t bytes); /* bytes were dropped; false: it is to be closed */
    void (*end)(void *context, void *who);                /* before the descriptor is closed; who is gone */
    void *context;
} lingering_calls;

/* Starts the thread that reads. */
lam_status lingering_start(const lingering_calls *calls, lingering **out, lam_error *error);

/* Reads fd, whose sending is shut down, until its client closes it, `take` says so, or LINGERING_BYTES have
 * come; then closes it. Takes over fd and who; false, with nothing taken over, if memory is short. Holds no
 * lock that a call needs. */
bool lingering_add(lingering *all, int fd, void *who);

/* Ends the thread once each connection has ended; the caller has shut them down, and `take` says so. */
void lingering_stop(lingering *all);

#endif
