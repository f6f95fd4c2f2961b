/* The light of many emissions at once, in one channel: the precomputation of a few emitters. */
#ifndef LAMBERT_METHOD_MANY_LIGHTS_H
#define LAMBERT_METHOD_MANY_LIGHTS_H

#include "solver/base/progress.h"
#include "solver/linalg/csr.h"

typedef struct many_lights_input {
    size_t n;
    const csr *F;       /* with reciprocity: A_i F_ij = A_j F_ji */
    const double *area; /* [n] */
    const float *rho;   /* [n], in [0, 1) */
    /* [m][n] each, NULL where there is none: emissions, and the irradiance that a sky gives directly. */
    size_t m;
    const float *E, *H0;
    const progress *progress;
    const char *stage; /* its name in the progress */
} many_lights_input;

typedef struct many_lights_report {
    size_t sweeps;   /* products with F, of the block that took most */
    double residual; /* |H0 + F B - H| / |H| in the scaled norm, of the worst column */
} many_lights_report;

/* T [m][n] = rho' H, rho' being rho or, where that is 0, 1: H = H0 + F B, B = E + rho H, by conjugate
 * gradients on the symmetric form I - R^1/2 S R^1/2 in single precision, begun again from its true residual
 * until that is at most tolerance (about 5e-7 is what single precision can have). The result does not depend
 * on the number of threads. Cost: F is read once a sweep for every 32 columns.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_NUMERIC (it does not settle: rho is too near 1). */
lam_status many_lights_solve(const many_lights_input *c, double tolerance, float *T,
                             many_lights_report *report, lam_error *error);

/* The same by a given number of Jacobi sweeps, B := E' + R F B from B = E' (Aguerre 2016, eqs. 2.5 and 4.8),
 * for comparison. */
lam_status many_lights_jacobi(const many_lights_input *c, size_t sweeps, float *T, lam_error *error);

#endif
