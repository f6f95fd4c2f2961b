/* K = S (I - R S)^-1 in a basis of wavelets, by repeated doubling of its Neumann series, where R is what
 * elements reflect. All matrices are symmetric and kept as their upper triangles. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_INVERSE_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_INVERSE_H

#include "solver/base/progress.h"
#include "solver/linalg/csr.h"
#include "solver/operator/wavelet/wavelets.h"

typedef struct wavelet_inverse_input {
    const wavelets *basis;
    const csr *S;
    const float *rho;    /* [n], by position, in [0, 1) */
    const float *weight; /* [n_nodes] */
    float threshold;     /* K is kept from threshold weight_i weight_j on */
    float inner;         /* of that, what products are kept from on the way */
    float skipped;       /* of that, the largest term that a product may leave out */
    size_t n_threads;
    const progress *progress;
} wavelet_inverse_input;

typedef struct wavelet_inverse_report {
    size_t doublings; /* 2^doublings bounces and more are in it */
    double terms;     /* multiplications and additions */
} wavelet_inverse_report;

/* out: freed with csr_free. With K_m the sum of m bounces and Z_m = S (R S)^(m-1): K_2m = K_m + Z_m R K_m and
 * Z_2m = Z_m R Z_m, so that rho = 0 divides nothing. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status wavelet_inverse(const wavelet_inverse_input *input, csr *out, wavelet_inverse_report *report,
                           lam_error *error);

/* W R W^T: the upper triangle; only nodes and those above them meet, and nothing does where rho is the same
 * all over a node. */
lam_status wavelet_diagonal(const wavelets *w, const float *rho, csr *out, lam_error *error);

#endif
