/* The text of GET /metrics, which is written at most ten times a second, however often it is asked for, and
 * kept in every coding. Any thread. */
#ifndef LAMBERT_SERVER_ROUTE_METRICS_PAGE_H
#define LAMBERT_SERVER_ROUTE_METRICS_PAGE_H

#include "server/scene/kept_forms.h"

#define METRICS_PAGE_S .1

typedef struct metrics_page metrics_page;

/* Errors: LAM_ERR_MEMORY. */
lam_status metrics_page_create(metrics_page **out, lam_error *error);

/* NULL is allowed. */
void metrics_page_destroy(metrics_page *page);

/* The text, as a reference for the caller: the kept one where it is younger than METRICS_PAGE_S, or what
 * `write` appends now. NULL if memory is short. */
kept_forms *metrics_page_get(metrics_page *page, bool (*write)(void *context, buffer *b), void *context);

#endif
