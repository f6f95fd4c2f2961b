/* Refined answers beside the truth: a dense LU in double, corrected by residuals in long double. */
#ifndef LAMBERT_TESTS_CERTIFIED_H
#define LAMBERT_TESTS_CERTIFIED_H

#include "solver/method/reference.h"
#include "solver/operator/operator.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* An operator and the form factors that its answers are refined by. */
typedef struct certified {
    const char *name;
    lam_operator *op;
    lam_form_factors *F;
    lam_refiner *refiner;
    reference **truth; /* [C] */
} certified;

/* op and F, which has rows, are taken over. */
certified certified_make(const char *name, lam_operator *op, lam_form_factors *F);

void certified_free(certified *s);

/* Refines a batch E, H0 [n_rhs][C][n] and holds each vector's error against its certificate and each
 * certificate against the tolerance. Returns the largest share of a certificate that an error takes. */
double certified_check(const certified *s, size_t n_rhs, lam_quantity quantity, const double *E,
                       const double *H0, const float *start, double tolerance);

#endif
