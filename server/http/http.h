/* HTTP over one listening socket; with http_answer.c the only user of <microhttpd.h>. One I/O thread
 * receives, sends and gives quick answers; solves go to the queue of the service. Knows the table of routes,
 * not what they do. */
#ifndef LAMBERT_SERVER_HTTP_HTTP_H
#define LAMBERT_SERVER_HTTP_HTTP_H

#include "server/route/service.h"

typedef struct http http;

/* Serves s on a listening socket, which is taken over, also on an error. s outlives it. */
lam_status http_start(service *s, int listen_fd, http **out, lam_error *error);

/* Accepts no further connection; open ones go on. Once. */
void http_quiesce(http *h);

/* Closes all connections and frees h. The queue must be closed before, so that no solve waits or runs. */
void http_stop(http *h);

#endif
