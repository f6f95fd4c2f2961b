/* A request while it is served: between http.c, which receives, and http_answer.c, which sends. Private to
 * them. */
#ifndef LAMBERT_SERVER_HTTP_HTTP_REQUEST_H
#define LAMBERT_SERVER_HTTP_HTTP_REQUEST_H

#include "server/http/content_coding.h"
#include "server/http/etag.h"
#include "server/http/http.h"
#include "server/http/request_id.h"
#include "server/route/routes.h"

#include <microhttpd.h>
#include <time.h>

struct http {
    service *service;
    struct MHD_Daemon *daemon;
    uint64_t seed, next_id;
    int listen_fd; /* after http_quiesce; before, the daemon's */
};

/* From its head to the last byte of its answer. The I/O thread owns it; while its connection is suspended,
 * the thread that solves does. */
typedef struct request {
    call call;
    http *http;
    struct MHD_Connection *connection;
    client *client; /* NULL when memory was short */
    char id[REQUEST_ID_MAX + 1];
    char method[16];
    char *path; /* as sent */
    struct timespec start;
    route_match match;
    catalog_snapshot *snapshot;
    problem variant_why;
    answer answer;
    coding_choice accepted;
    content_coding coding; /* of the answer */
    char etag[ETAG_MAX];   /* of the answer; "" for none */
    bool answered;         /* the answer is made: what follows of the body is dropped */
    bool queued;           /* the answer was handed to libmicrohttpd */
    buffer body;           /* counted in the service's body_bytes */
    uint64_t received;
    size_t sent;
} request;

/* A header of the request, or NULL. */
const char *http_header(const request *r, const char *name);

/* Codes the answer as the client likes, where that pays, and names its bytes. On the thread that solved, or
 * on the I/O thread, where long bodies are sent as they are. */
void http_finish_answer(request *r, bool on_io_thread);

/* Hands a finished answer to libmicrohttpd. */
enum MHD_Result http_send_answer(request *r);

#endif
