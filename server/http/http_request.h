/* A request while it is served, shared by http.c, which receives, http_solve.c, which solves, and
 * http_answer.c, which sends. Private to them. */
#ifndef LAMBERT_SERVER_HTTP_HTTP_REQUEST_H
#define LAMBERT_SERVER_HTTP_HTTP_REQUEST_H

#include "server/http/http_fields.h"
#include "server/route/content_coding.h"
#include "server/route/routes.h"
#include "solver/base/clock.h"

#include <microhttpd.h>

/* Lives from its head to the last byte of its answer. It belongs to the I/O thread, or, while its connection
 * is suspended, to the thread that solves. */
typedef struct request {
    call call;
    service *service;
    struct MHD_Connection *connection;
    client *client;      /* NULL when memory was short */
    peer peer;           /* the client, as the head states it */
    token_holder holder; /* its token; "" without one */
    char id[REQUEST_ID_MAX + 1];
    char method[16];
    char *path;              /* as sent, without scheme and host */
    query_member *query;     /* of the call, with its texts behind it; or NULL */
    double start;            /* clock_seconds */
    double submitted;        /* the same, to the queue */
    double waited;           /* seconds until it was begun */
    double read;             /* the time when passes were all that was left */
    double deadline;         /* of the last byte of the answer */
    metrics_refusal refusal; /* of a solve that is not wanted any more */
    route_match match;
    catalog_snapshot *snapshot;
    problem variant_why;
    answer answer;
    coding_choice accepted; /* as that of the call, which some requests never have */
    content_coding coding;  /* of the answer */
    char etag[ETAG_MAX];    /* of the answer; "" for none */
    const char *origin;     /* of --allow-origin, the page that asks; NULL: none of them */
    bool preflight;         /* the answer is one to a CORS preflight */
    bool paused;            /* the rest of the body waits in the socket for memory */
    bool waits_for_memory;  /* of the thread that solves, and of the queue's looks */
    bool answered;          /* the answer is made; the rest of the body is dropped */
    bool last;              /* the connection ends with this answer */
    bool queued;            /* the answer was handed to libmicrohttpd */
    bool written;           /* the answer was written past libmicrohttpd, in the middle of the body */
    buffer body;            /* counted in memory */
    request_memory memory;  /* of the body, of what is computed, of the answer */
    turn turn;
    bool had_turn; /* its client's turn came */
    uint64_t received;
    uint64_t announced; /* length of the body; 0: unknown */
    size_t sent;
} request;

/* A header of the request, or NULL. */
const char *http_header(const request *r, const char *name);

/* False when memory is short. */
static inline bool http_add_header(struct MHD_Response *response, const char *name, const char *value) {
    return MHD_add_response_header(response, name, value) == MHD_YES;
}

/* Lowers the deadline to what the header Lambert-Timeout asks for; false, with 400, if that is no time. */
bool http_read_timeout(request *r);

/* turns_may now; called by the thread that receives and sends, whose time that is. */
static inline bool http_has_turn(turns *all, turn *t) {
    const double now = clock_seconds();
    return turns_may(all, t, now, now - clock_thread_seconds());
}

/* Suspends the connection and queues the solve of a request with its whole body, or refuses it. */
void http_solve(request *r);

/* After a take that found no room, on the I/O thread: suspends the connection until there is room for
 * `wanted` bytes in all, or until it is refused (answered). libmicrohttpd then calls with the same bytes
 * again. False if memory is short for another reason. */
bool http_wait_for_memory(request *r, size_t wanted);

/* False, with 503 in place of any answer, if the scene is out of service. */
bool http_check_health(request *r);

void http_drop_body(request *r);

/* Counts the memory of the answer, in place of all that the request took to make it. Compresses it if the
 * client accepts that and it pays, and sets its ETag. The I/O thread sends long bodies as they are. */
void http_finish_answer(request *r, bool on_io_thread);

/* Hands a finished answer to libmicrohttpd. */
enum MHD_Result http_send_answer(request *r);

/* Writes a refusal to the socket in the middle of a body, where libmicrohttpd sends none: the connection is
 * then to be closed. An answer that the socket has no room for is lost. */
void http_write_refusal(request *r);

#endif
