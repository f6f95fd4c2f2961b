/* What all requests share. */
#ifndef LAMBERT_SERVER_SERVICE_H
#define LAMBERT_SERVER_SERVICE_H

#include "server/batch.h"
#include "server/catalog.h"
#include "server/config.h"
#include "server/connections.h"
#include "server/metrics.h"
#include "server/token.h"
#include "server/variants.h"

typedef enum service_state { SERVICE_LOADING, SERVICE_READY, SERVICE_DRAINING } service_state;

typedef struct service {
    const config *config;
    catalog *catalog;
    variants *variants;
    metrics *metrics;
    batch_queue *queue;
    token token;              /* empty: none is asked for */
    FILE *access_log;         /* NULL: none */
    atomic_int state;         /* a service_state */
    connections *connections; /* from http_start to http_stop */
    atomic_size_t body_bytes; /* of requests whose bodies are held */
} service;

#endif
