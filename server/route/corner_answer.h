/* Answers at the corners that elements share, of an answer at elements. */
#ifndef LAMBERT_SERVER_ROUTE_CORNER_ANSWER_H
#define LAMBERT_SERVER_ROUTE_CORNER_ANSWER_H

#include "server/route/call.h"
#include "solver/operator/corners/corner_plan.h"

/* Starts zeroed. */
typedef struct corner_answer {
    const corner_plan *plan; /* of the scene; NULL: the answer is at elements */
    float *work;             /* [C][n] for vectors that are needed at elements later; else NULL */
} corner_answer;

/* For a request at corners: finds the plan, which the first request makes, and states the number of corners
 * in the request; false with *why. */
bool corner_answer_begin(const call *in, radiosity_request *request, corner_answer *out, problem *why);

/* Room to keep the vectors at elements, without which they are lost; freed by corner_answer_free. False with
 * *why. */
bool corner_answer_keep(const call *in, corner_answer *a, problem *why);
void corner_answer_free(corner_answer *a);

/* Puts vectors first ... first + count of x [n_rhs][C][n] into out [n_rhs][C][corners]. */
void corner_answer_find(const scene *s, const corner_answer *a, size_t first, size_t count, float *x,
                        float *out);

#endif
