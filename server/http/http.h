/* HTTP over one socket: with http_answer.c the only user of <microhttpd.h>. One thread does all input and
 * output and the quick answers; solves go to the queue of the service. Knows routes, not what they mean. */
#ifndef LAMBERT_SERVER_HTTP_HTTP_H
#define LAMBERT_SERVER_HTTP_HTTP_H

#include "server/route/service.h"

typedef struct http http;

/* Serves s on a listening socket, which is taken over, also on an error. s outlives it. */
lam_status http_start(service *s, int listen_fd, http **out, lam_error *error);

/* Accepts no further connection; those that are open go on. Once. */
void http_quiesce(http *h);

/* Closes what is open and frees h. No solve may wait or run: the queue must be closed. */
void http_stop(http *h);

#endif
