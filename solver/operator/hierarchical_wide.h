/* The products of kind "hierarchical" with vectors side by side, one channel at a time. */
#ifndef LAMBERT_OPERATOR_HIERARCHICAL_WIDE_H
#define LAMBERT_OPERATOR_HIERARCHICAL_WIDE_H

#include "solver/operator/hierarchical.h"

/* Bytes of work area; 0 when they overflow. */
size_t hierarchical_wide_bytes(const hierarchical *self);

/* The answers to at most OPERATOR_PASS vectors in channel c, each with the bits that it has alone. */
void hierarchical_wide_answer(const hierarchical *self, size_t c, size_t count,
                              const operator_vector *vectors, void *work);

/* The products of vectors by position, in and out [count][C][n], beginning with channel c of the first, or,
 * adjoint, with the transpose. */
void hierarchical_wide_product(const hierarchical *self, size_t c, bool adjoint, size_t count,
                               const float *in, float *out, void *work);

/* Makes self->runs of its plan and order, each of at most OPERATOR_PASS elements. Errors: LAM_ERR_MEMORY. */
lam_status hierarchical_wide_prepare(hierarchical *self, lam_error *error);

#endif
