/* Answers to radiosity requests with `reduce`: figures of groups in place of vectors. */
#ifndef LAMBERT_SERVER_ROUTE_RADIOSITY_FIGURES_H
#define LAMBERT_SERVER_ROUTE_RADIOSITY_FIGURES_H

#include "server/route/call.h"
#include "solver/codec/answer.h"

/* False with *why if the client does not accept JSON, the only format of figures. */
bool figures_acceptable(const call *in, const radiosity_request *request, problem *why);

/* Bytes that figures take until they are written, and their text, at most. */
size_t figures_bytes(const radiosity_request *request, size_t n_channels);

/* Adds vectors first ... first + count, x [count][C][n_selected], to figures of reduce_figures. 422 for a
 * value beyond single precision. */
bool figures_add(const scene *s, const radiosity_request *request, size_t first, size_t count, const float *x,
                 double *figures, problem *why);

/* Writes the whole answer. */
bool figures_write(const scene *s, const radiosity_request *request, const double *figures,
                   const answer_notes *notes, buffer *b, problem *why);

/* Answers a linear reduction by adjoint rows; missing ones are computed. */
bool figures_linear(call *in, radiosity_request *request, answer_notes *notes, buffer *b, problem *why);

#endif
