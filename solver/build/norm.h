/* The 2-norm of what a factorization left out. */
#ifndef LAMBERT_BUILD_NORM_H
#define LAMBERT_BUILD_NORM_H

#include "solver/build/tsvd.h"
#include "solver/matrix/scaled.h"
#include "solver/progress.h"

/* |S - Q V^T|_2 to about a per cent from below: Lanczos steps on the square of the difference, which is what
 * a power iteration with memory is. f as hf_factorize returns it. Cost: a few dozen products with S, Q and V.
 */
lam_status norm_of_error(const scaled_matrix *S, const uint32_t *order, const tall_factors *f,
                         const progress *p, double *norm, lam_error *error);

/* w = D^T D q of some matrix D; q and w are [n]. */
typedef void norm_product(void *context, const double *q, double *w);

/* The same for any D of n columns: |D|_2. Cost: at most 32 products. */
lam_status norm_of_product(size_t n, norm_product *product, void *context, const progress *p, double *norm,
                           lam_error *error);

#endif
