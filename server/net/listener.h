/* The socket that is listened on. */
#ifndef LAMBERT_SERVER_NET_LISTENER_H
#define LAMBERT_SERVER_NET_LISTENER_H

#include "store/status.h"

/* address is HOST:PORT ([...]:PORT for IPv6); where says how a client finds it, with the port that was taken.
 * The caller closes *fd. Errors: LAM_ERR_ARGUMENT, LAM_ERR_IO. */
lam_status listener_tcp(const char *address, int *fd, char *where, size_t where_size, lam_error *error);

/* A socket at path, which the caller unlinks in the end; one that nobody listens on any more is replaced. */
lam_status listener_unix(const char *path, int *fd, char *where, size_t where_size, lam_error *error);

#endif
