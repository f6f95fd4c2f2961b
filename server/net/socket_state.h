/* Questions to the system about a connected socket. Any thread. */
#ifndef LAMBERT_SERVER_NET_SOCKET_STATE_H
#define LAMBERT_SERVER_NET_SOCKET_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* *bytes: bytes that the client's machine has acknowledged; false if the socket does not count them. */
bool socket_acknowledged(int fd, uint64_t *bytes);

/* Bytes that came, as TCP counts them (its end is one); 0 where the socket does not. */
size_t socket_received(int fd);

/* True if the client has ended its sending and all it sent was received. */
bool socket_has_hung_up(int fd);

/* True if the connection is lost, or the client has ended its sending. */
bool socket_is_lost(int fd);

#endif
