/* The options of lambertd. */
#ifndef LAMBERT_SERVER_CONFIG_H
#define LAMBERT_SERVER_CONFIG_H

#include "solver/base/options/options.h"
#include "store/status.h"

#include <stdio.h>

typedef struct config {
    const char *stores_dir;
    const char *listen_address; /* HOST:PORT; port 0: any that is free */
    const char *unix_path;      /* instead of listen_address */
    const char *token_file;
    option_list trusted_proxies;                /* texts of peer_rules_read */
    option_list allowed_hosts, allowed_origins; /* texts of origin_rules_read */
    const char *access_log;                     /* "-": standard output */
    size_t threads;
    char threads_why[96]; /* the limit by which they are fewer than the processors; "": none */
    size_t max_body;      /* bytes */
    size_t max_batch;     /* vectors in a request */
    size_t max_inflight;  /* solves that wait or run */
    size_t max_buffered;  /* bytes of request bodies, of all clients together */
    size_t max_connections;
    size_t max_memory;         /* bytes that stores and work areas may take; 0: any */
    size_t max_request_memory; /* bytes that requests and their answers may take */
    size_t timeout_s, keep_alive_s;
    size_t request_timeout_s;
    size_t drain_delay_s, shutdown_timeout_s;
    size_t min_rate; /* bytes a second that a client has to send and to read */
    size_t max_variants;
    bool strict;
    bool verify;
    size_t verify_below; /* bytes of mapped arrays */
    bool no_viewer;
    double scrub_hours; /* 0: never */
    bool version;
    char **stores; /* the other arguments: STORE.h5 or STORE.h5:NAME */
    size_t n_stores;
} config;

/* Fills c from presets and argv, whose order may change; texts stay in argv. Returns OPTIONS_GO, or the exit
 * status after --help or wrong usage. */
int config_read(config *c, int argc, char **argv);

#endif
