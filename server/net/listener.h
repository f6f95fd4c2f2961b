/* The socket that listens, on an address or in the file system. */
#ifndef LAMBERT_SERVER_NET_LISTENER_H
#define LAMBERT_SERVER_NET_LISTENER_H

#include "store/status.h"

#include <stdint.h>

/* Listens on address, HOST:PORT ([...]:PORT for IPv6). where: the URL for clients, with the port that was
 * taken. The caller closes *fd. Errors: LAM_ERR_ARGUMENT, LAM_ERR_IO. */
lam_status listener_open_tcp(const char *address, int *fd, char *where, size_t where_size, lam_error *error);

/* A socket in the file system: its path, and the file that was bound there. */
typedef struct unix_socket {
    const char *path; /* NULL: none */
    uint64_t device, inode;
} unix_socket;

/* Listens on a socket at path; one without a listener is replaced. own is for listener_unlink; its path is
 * the caller's. */
lam_status listener_open_unix(const char *path, int *fd, char *where, size_t where_size, unix_socket *own,
                              lam_error *error);

/* Removes the socket, once, unless the path is that of another one by now: a successor may have taken it over
 * as soon as this program stopped to listen. */
void listener_unlink(unix_socket *own);

#endif
