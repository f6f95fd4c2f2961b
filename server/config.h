/* The options of lambertd: one table that reads the command line and makes --help. */
#ifndef LAMBERT_SERVER_CONFIG_H
#define LAMBERT_SERVER_CONFIG_H

#include "store/status.h"

#include <stdio.h>

typedef struct config {
    const char *stores_dir;
    const char *listen_address; /* HOST:PORT; port 0: any that is free */
    const char *unix_path;      /* instead of listen_address */
    const char *token_file;
    const char *access_log; /* "-": standard output */
    size_t threads;
    size_t max_body;     /* bytes */
    size_t max_batch;    /* vectors in a request */
    size_t max_inflight; /* solves that wait or run */
    size_t max_buffered; /* bytes of request bodies, of all clients together */
    size_t max_connections;
    size_t max_memory; /* bytes that stores and work areas may take; 0: any */
    size_t timeout_s;
    size_t min_rate; /* bytes a second that a client has to send and to read */
    size_t max_variants;
    bool verify;
    bool no_viewer;
    bool help;
    bool version;
    char **stores; /* the other arguments: STORE.h5 or STORE.h5:NAME */
    size_t n_stores;
} config;

/* Fills c with defaults and what argv says; its texts stay owned by argv, whose order may change.
 * Errors: LAM_ERR_ARGUMENT, LAM_ERR_UNSUPPORTED. */
lam_status config_read(config *c, int argc, char **argv, lam_error *error);

void config_print_help(FILE *to);

#endif
