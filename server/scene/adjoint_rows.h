/* Adjoint rows: the mean of a quantity over a group is linear in what shines, mean = w^T E, so that one row
 * w = (dq/dE)^T (A 1_group / sum A), made once, answers every emission by a product, and w summed over each
 * group of the scene every emission by groups. Rows are made when they are first asked for, kept by the scene
 * (the oldest go when they are too many) and never changed. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_ADJOINT_ROWS_H
#define LAMBERT_SERVER_SCENE_ADJOINT_ROWS_H

#include "lambert/lambert.h"
#include "server/queue/batch.h"
#include "server/scene/memory_ledger.h"
#include "solver/codec/request.h"

#include <stdbool.h>
#include <stdint.h>

#define ADJOINT_ROWS_OF_REQUEST 64 /* so many at most answer one request */

typedef struct scene scene;
typedef struct adjoint_rows adjoint_rows;

/* One row, for C channels. */
typedef struct adjoint_row {
    size_t references;
    uint64_t used; /* when, in uses */
    struct adjoint_row *next;
    size_t bytes;
    const uint32_t *groups; /* whose mean it is, as group_index_find gives them */
    size_t n_groups;
    lam_quantity quantity;
    double area;      /* sum A; 0: the row is 0, and the mean has no value */
    float *w;         /* [C][n]; NULL where the store answers for its own emitters only */
    float *emitters;  /* [C][s], of their weights, in place of w */
    double *of_group; /* [C][groups of the scene]: sum of w over each; NaN: the emitters do not tell */
    float *tiles;     /* [C][m], of a sky's radiances; NaN likewise */
} adjoint_row;

/* max_bytes: what all rows together may take; and ledger, if any: a row it has no room for answers once. */
lam_status adjoint_rows_create(size_t max_bytes, memory_ledger *ledger, adjoint_rows **out, lam_error *error);

/* No row may be in use. NULL is allowed. */
void adjoint_rows_destroy(adjoint_rows *rows);

/* Bytes taken of the ledger. */
size_t adjoint_rows_held(adjoint_rows *rows);

/* Rows that a scene is willing to keep for one request. */
size_t adjoint_rows_capacity(const scene *s);

/* The rows of every name of request->reduce, in rows [n_names], if all of them are there; each is given back
 * with adjoint_rows_release. Waits for nobody. */
bool adjoint_rows_find(const scene *s, const radiosity_request *request, adjoint_row **rows);

/* The same, making those that are not there: one pass over the operator for up to 16. 503 when memory is
 * short. */
bool adjoint_rows_get(const scene *s, const radiosity_request *request, batch_workspace *workspace,
                      adjoint_row **rows, problem *why);

void adjoint_rows_release(const scene *s, size_t count, adjoint_row **rows);

/* Products that an evaluation takes, apart from what E holds. */
size_t adjoint_row_work(const scene *s, const radiosity_request *request);

/* Whether a row answers the request without weights: false where a store of few emitters has to look at whole
 * vectors. The same of every row of a scene. */
bool adjoint_row_tells(const scene *s, const adjoint_row *row, const radiosity_request *request);

/* means [n_rhs][C] of a request, in double. weights [n_rhs][C][s] stand for all that shines in a store of few
 * emitters; NULL: the row tells. Costs what the spots are, and nC a vector of E. */
void adjoint_row_evaluate(const scene *s, const adjoint_row *row, const radiosity_request *request,
                          const float *weights, double *means);

#endif
