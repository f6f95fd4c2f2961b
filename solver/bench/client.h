/* One HTTP client on one keep-alive connection to the loopback: an optimizer's loop. */
#ifndef LAMBERT_BENCH_CLIENT_H
#define LAMBERT_BENCH_CLIENT_H

#include "solver/bench/bench.h"

#include <stdint.h>

/* What is sent; bodies are the caller's. */
typedef struct client_request {
    const char *method, *path;
    const char *type; /* of the body and of the answer that is wanted; NULL: neither */
    const char *body;
    size_t length;
} client_request;

typedef struct client {
    int fd; /* -1: not connected */
    unsigned port;
    char *bytes; /* the last answer, with its head */
    size_t capacity;
} client;

/* body points into the client, until it asks again. */
typedef struct client_answer {
    unsigned status; /* 0: the server hung up instead */
    const char *body;
    size_t length;
    double seconds; /* from the first byte sent to the last received */
} client_answer;

/* Connects with the first request, and again where the server hung up. Freed by client_close. */
client client_to(unsigned port);
void client_close(client *c);

/* Errors: LAM_ERR_IO when the server is not there, is silent for two minutes or speaks no HTTP,
 * LAM_ERR_CANCELLED, LAM_ERR_MEMORY. */
lam_status client_ask(client *c, const bench_run *run, const client_request *request, client_answer *answer,
                      lam_error *error);

/* Asks again and again for so many seconds and at least so often. Errors: also LAM_ERR_IO for an answer that
 * is not 200. */
lam_status client_warm_up(client *c, const bench_run *run, const client_request *request, double seconds,
                          size_t least, lam_error *error);

#endif
