/* The adjoint rows of a scene (solver/operator/groups/adjoint_row.h): computed when first needed, and kept
 * (row_cache.h). Any thread. */
#ifndef LAMBERT_SERVER_SCENE_ADJOINT_ROWS_H
#define LAMBERT_SERVER_SCENE_ADJOINT_ROWS_H

#include "server/queue/batch.h"
#include "server/scene/row_cache.h"
#include "solver/codec/request.h"

#define ADJOINT_ROWS_OF_REQUEST 64 /* rows for one request, at most */

typedef struct scene scene;

/* The number of rows that a scene keeps for one request, at most. */
size_t adjoint_rows_capacity(const scene *s);

/* The rows of every name of request->reduce, in rows [n_names], if all are in the cache; each is released by
 * adjoint_rows_release. Does not wait. */
bool adjoint_rows_find(const scene *s, const radiosity_request *request, adjoint_row **rows);

/* The most bytes that adjoint_rows_get takes for a request, with rows that the cache does not keep; and for
 * rows that are found by up to BATCH_PASS at a time. */
size_t adjoint_rows_room(const scene *s, size_t n_rows);
size_t adjoint_rows_bytes(const scene *s, const radiosity_request *request);

/* The same of names first ... first + count, in rows [count], at most BATCH_PASS; those that are missing are
 * computed by one pass over the operator. 503 when memory is short. */
bool adjoint_rows_get(const scene *s, const radiosity_request *request, size_t first, size_t count,
                      batch_workspace *workspace, adjoint_row **rows, problem *why);

/* The rows of the values of elements, at most BATCH_PASS, by one pass over the operator. The cache does not
 * keep them: the caller frees each by adjoint_row_free. Where it fails all are NULL. 503 when memory is
 * short. */
bool adjoint_rows_of_elements(const scene *s, lam_quantity quantity, size_t count, const uint32_t *elements,
                              batch_workspace *workspace, adjoint_row **rows, problem *why);

void adjoint_rows_release(const scene *s, size_t count, adjoint_row **rows);

/* The number of products of an evaluation, apart from dense emissions. */
size_t adjoint_row_work(const scene *s, const radiosity_request *request);

/* True if a row answers the request without weights, false if a store of few emitters needs whole vectors.
 * The same for every row of a scene. */
bool adjoint_row_answers(const scene *s, const adjoint_row *row, const radiosity_request *request);

/* means [n_rhs][C] of a request, in double. weights [n_rhs][C][s] replace all emission of a store of few
 * emitters; NULL if adjoint_row_answers. Cost: that of the spots, and nC for a dense vector. */
void adjoint_row_means(const scene *s, const adjoint_row *row, const radiosity_request *request,
                       const float *weights, double *means);

/* The parts of a scene that rows depend on. */
linear_scene scene_linear(const scene *s);

#endif
