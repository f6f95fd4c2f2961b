/* Compresses form factors in a wavelet basis and bounds the error that this makes in F B. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_COMPRESS_H
#define LAMBERT_METHOD_HIERARCHICAL_COMPRESS_H

#include "solver/base/progress.h"
#include "solver/operator/refine/compressed_factors.h"

typedef struct compress_input {
    const csr *F;              /* rows, A_i F_ij = A_j F_ji up to rounding to single precision */
    const double *area;        /* [n] */
    const double (*centre)[3]; /* [n] */
    const float (*normal)[3];  /* [n] unit */
    const uint32_t *group;     /* [n] below n_groups */
    size_t n_groups;
    const bool *shines; /* [n_groups], groups of emitters: their direct illumination is stored first */
    double threshold;   /* a coefficient of S is kept if it changes F B by this anywhere, for B of norm 1 */
    size_t most;        /* coefficients, at most; 0: any number */
    size_t n_threads;
    const progress *progress;
} compress_input;

/* The threshold for an operator of this epsilon, far below it. */
double compress_threshold(double epsilon);

/* out: the entries of the upper triangle of S = W A^1/2 F A^-1/2 W^T above the threshold. All of S is
 * computed, in double, node by node, so that the norm of what is dropped is exact. Not finished
 * (compressed_finish); freed with compressed_free; n is 0 if more than `most` coefficients were needed. Cost:
 * O(n^2), 500 n operations for each of n / 3 nodes; memory: about 60 n numbers per thread. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_NUMERIC. */
lam_status compress_form_factors(const compress_input *input, compressed_factors *out, lam_error *error);

#endif
