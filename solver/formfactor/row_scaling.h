/* Scales of the rows and columns of exchange areas that give rows the sums they must have: symmetric Sinkhorn
 * sweeps (Sinkhorn and Knopp 1967), each extrapolated from those before (Anderson 1965). It does not know how
 * the exchange areas are stored. */
#ifndef LAMBERT_FORMFACTOR_ROW_SCALING_H
#define LAMBERT_FORMFACTOR_ROW_SCALING_H

#include "lambert/lambert.h"

#include <stddef.h>

/* r_i = d_i sum_j g_ij d_j, where what leaves the scene may be one of the j. */
typedef lam_status row_sums_of(void *context, const double *d, double *r, lam_error *error);

/* A scaling d in progress, its row sums r, and the largest |r_i / A_i - 1|. */
typedef struct row_scaling {
    size_t n;
    const double *area; /* [n] */
    row_sums_of *sums;
    void *context;
    int sweeps_most;  /* without extrapolation, where that does not settle */
    double tolerance; /* of r_i / A_i; 0: 2e-8 */
    double *d, *r;    /* [n], of the caller */
    double worst;
    size_t products; /* calls of sums */
} row_scaling;

/* Finds d with r_i = A_i to the tolerance. Where no scaling closes every row, rows with r_i > A_i are scaled
 * down, and their pairs with them. before [n] receives the row sums of d = 1. Cost: about 15 products in
 * closed rooms. Errors: LAM_ERR_MEMORY, and those of sums. */
lam_status row_scaling_settle(row_scaling *c, double *before, lam_error *error);

#endif
