/* What `reduce` makes of a radiosity request: figures of groups in place of vectors. */
#ifndef LAMBERT_SERVER_ROUTE_RADIOSITY_FIGURES_H
#define LAMBERT_SERVER_ROUTE_RADIOSITY_FIGURES_H

#include "server/route/call.h"
#include "solver/codec/answer.h"

/* Whether the answer can be what the client accepts: figures are JSON. */
bool figures_acceptable(const call *in, const radiosity_request *request, problem *why);

/* Reduces vectors first ... first + count of an answer, x [count][C][n_selected]; figures are those of
 * reduce_figures. 422 for a value beyond single precision. */
bool figures_add(const scene *s, const radiosity_request *request, size_t first, size_t count, const float *x,
                 double *figures, problem *why);

/* The whole answer. */
bool figures_write(const scene *s, const radiosity_request *request, const double *figures,
                   const answer_notes *notes, buffer *b, problem *why);

/* Solves and answers a linear reduction by adjoint rows, which are made where they are not there yet. */
bool figures_linear(call *in, radiosity_request *request, answer_notes *notes, buffer *b, problem *why);

#endif
