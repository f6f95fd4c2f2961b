/* The open connections and how long each may take for what it does: slow readers and writers are cut. Knows
 * sockets, not HTTP. Any thread. */
#ifndef LAMBERT_SERVER_NET_CONNECTIONS_H
#define LAMBERT_SERVER_NET_CONNECTIONS_H

#include "solver/codec/buffer.h"
#include "store/status.h"

#include <stdint.h>

typedef struct connections connections;
typedef struct client client;

/* What is waited for:
 *   HEAD    the client's next request, as a whole: timeout_s from the connection or from the last answer
 *   BODY    the rest of it: timeout_s, put off by every byte at least_rate bytes a second, but never further
 *           than timeout_s from now
 *   SOLVE   us
 *   ANSWER  the client's reading of it, as a body */
typedef enum connection_stage { STAGE_HEAD, STAGE_BODY, STAGE_SOLVE, STAGE_ANSWER } connection_stage;

typedef struct connection_limits {
    size_t most; /* connections; once they are open, those that idle longest are cut for others */
    size_t timeout_s;
    size_t least_rate; /* bytes a second */
} connection_limits;

/* How many connections the process has descriptors for, at most `wanted`: room is kept for stores and what
 * else it opens. Raises the soft limit as far as that is needed and allowed.
 * Errors: LAM_ERR_IO, when there is room for none. */
lam_status connections_affordable(size_t wanted, size_t *most, lam_error *error);

/* Listens on address, HOST:PORT ([...]:PORT for IPv6). where: the URL for clients, with the port that was
 * taken. The caller closes *fd. Errors: LAM_ERR_ARGUMENT, LAM_ERR_IO. */
lam_status connections_listen_tcp(const char *address, int *fd, char *where, size_t where_size,
                                  lam_error *error);

/* Listens on a socket at path, which the caller unlinks in the end; one without a listener is replaced. */
lam_status connections_listen_unix(const char *path, int *fd, char *where, size_t where_size,
                                   lam_error *error);

/* Starts a thread that checks all connections once a second. */
lam_status connections_start(const connection_limits *limits, connections **out, lam_error *error);

/* Ends the thread and frees all; none may be open. */
void connections_stop(connections *all);

/* A connection begins, at STAGE_HEAD; NULL when memory is short. */
client *connections_add(connections *all, int fd);

/* Before its descriptor is closed: what is cut has to be still the same. c may be NULL. */
void connections_remove(connections *all, client *c);

/* A stage begins now; so many bytes are going to be sent in it. c may be NULL. */
void client_enter(connections *all, client *c, connection_stage stage, size_t bytes);

/* So many bytes of the body have come. c may be NULL. */
void client_received(connections *all, client *c, size_t bytes);

/* Whether the client is known to be gone for good; one that only ended its own sending may still read. c is
 * open, or NULL. */
bool client_is_lost(const client *c);

/* Appends the counts as Prometheus text. */
bool connections_write(connections *all, buffer *b);

#endif
