/* State that all requests share. */
#ifndef LAMBERT_SERVER_ROUTE_SERVICE_H
#define LAMBERT_SERVER_ROUTE_SERVICE_H

#include "server/config.h"
#include "server/net/access_log.h"
#include "server/net/connections.h"
#include "server/net/origin.h"
#include "server/net/peer.h"
#include "server/net/token.h"
#include "server/net/turns.h"
#include "server/queue/batch.h"
#include "server/queue/metrics.h"
#include "server/queue/problem_counts.h"
#include "server/route/metrics_page.h"
#include "server/route/request_memory.h"
#include "server/scene/catalog.h"
#include "server/scene/variants.h"

/* ENDING: solves that wait or run are given up. */
typedef enum service_state { SERVICE_LOADING, SERVICE_READY, SERVICE_DRAINING, SERVICE_ENDING } service_state;

typedef struct service {
    const config *config;
    catalog *catalog;
    variants *variants;
    metrics *metrics;
    batch_queue *queue;
    tokens *tokens;         /* NULL: none is needed */
    origin_rules origins;   /* hosts and pages that are served */
    peer_rules peers;       /* whose word about a client's address is taken */
    access_log *access_log; /* NULL: none */
    access_log
        *audit_log; /* PUT and DELETE; the access log, or standard error; NULL: nothing can be changed */
    problem_counts problems;
    kept_forms *openapi; /* GET /v1/openapi.json */
    kept_forms *manual;  /* GET /deploy/docs/api.md */
    metrics_page *metrics_page;
    atomic_int state;         /* a service_state */
    connections *connections; /* from http_start to http_stop, as turns */
    turns *turns;
    atomic_size_t n_refining; /* refinements that wait or run */
    request_ledger memory;    /* --max-request-memory, --max-buffered */
} service;

#endif
