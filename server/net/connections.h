/* The open connections with their time limits and the shares of clients in them: connections of slow readers
 * and writers are closed. Knows sockets, not HTTP. Any thread. */
#ifndef LAMBERT_SERVER_NET_CONNECTIONS_H
#define LAMBERT_SERVER_NET_CONNECTIONS_H

#include "solver/codec/buffer.h"
#include "store/status.h"

#include <stdint.h>

typedef struct connections connections;
typedef struct client client;

/* The time limit of each stage:
 *   IDLE    the next request must begin keep_alive_s after the last answer
 *   HEAD    its head must be complete timeout_s after it began, that of the first one after the connection
 *   BODY    timeout_s, extended by 1/least_rate seconds with every byte, to at most timeout_s from now
 *   SOLVE   none
 *   ANSWER  as BODY, for bytes that the client reads
 *   LINGERING  as BODY, for bytes that are dropped, with 5 s (or timeout_s, if less) in place of timeout_s,
 * and six times as long in all */
typedef enum connection_stage {
    STAGE_IDLE,
    STAGE_HEAD,
    STAGE_BODY,
    STAGE_SOLVE,
    STAGE_ANSWER,
    STAGE_LINGERING
} connection_stage;

typedef struct connection_limits {
    size_t wanted; /* most connections */
    size_t beyond; /* accepted beyond most, for a moment: while another is closed for it, or idle ones are */
    size_t most;   /* of these, as many as there are descriptors for; when all are open, or no descriptor is
                      left, those idle for longest are closed for others */
    size_t timeout_s, keep_alive_s;
    size_t least_rate; /* bytes a second */
} connection_limits;

/* Starts a thread that checks all connections once a second. */
lam_status connections_start(const connection_limits *limits, connections **out, lam_error *error);

/* The stores hold so many descriptors from now on: idle connections beyond the rest are closed. */
void connections_reserve(connections *all, size_t n_stores);

/* Ends the thread and frees everything; no connection may be open. */
void connections_stop(connections *all);

/* True if a new connection of a client (a key of server/net/peer.h) is to be accepted. When all are in use,
 * those are closed whose clients are gone, and one of the client that has most of them for one of a client
 * that has fewer: the one that has been idle for longest, or in its stage. One of the client that has most is
 * accepted beyond the limit, if few are, or for one of its own without a request, or is refused. O(open
 * connections) when all are in use, else O(1). */
bool connections_admit(connections *all, uint64_t key);

/* Adds a connection at STAGE_HEAD; NULL if memory is short. counts: it counts for its client, as that of a
 * proxy does not. */
client *connections_add(connections *all, int fd, uint64_t key, bool counts);

/* Call it before the descriptor is closed, so that no other connection with this descriptor is closed
 * instead. c may be NULL. */
void connections_remove(connections *all, client *c);

/* The same for a connection that is closed, in place of connections_remove: where client_linger was called,
 * it goes on with a copy of the descriptor, whose sending is shut down, and counts until its client has
 * closed it or its time is over. At most a quarter of all linger; the one that has for longest is closed for
 * another. */
void connections_close(connections *all, client *c);

/* Connections that linger now. */
size_t connections_lingering(connections *all);

/* A stage begins now, in which `bytes` will be sent. c may be NULL. */
void client_enter(connections *all, client *c, connection_stage stage, size_t bytes);

/* Bytes of the body have arrived. c may be NULL. */
void client_received(connections *all, client *c, size_t bytes);

/* The next body and answer must have moved by then (clock_seconds), whatever their rate; until the next head.
 * c may be NULL. */
void client_end_by(connections *all, client *c, double end);

/* The answer leaves before all of the request has come: connections_close reads the rest. c may be NULL. */
void client_linger(connections *all, client *c);

/* True from the head of a request to the last byte of its answer. c may be NULL. */
bool client_has_request(const client *c);

/* Bytes that came over the connection, as TCP counts them (its end is one); 0 where the socket does not. c is
 * open, or NULL. */
size_t client_bytes_received(const client *c);

/* True if the connection is lost, or the client has ended its sending, as one does that closes. c is open, or
 * NULL.
 */
bool client_is_lost(const client *c);

/* Appends the counts as Prometheus text. */
bool connections_write(connections *all, buffer *b);

#endif
