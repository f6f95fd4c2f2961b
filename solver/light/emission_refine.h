/* Emissions to answers with certificates, a few vectors at a time. */
#ifndef LAMBERT_LIGHT_EMISSION_REFINE_H
#define LAMBERT_LIGHT_EMISSION_REFINE_H

#include "solver/light/emission_apply.h"

typedef struct refined_light {
    double *values;       /* [n_vectors][C][n] */
    double *certificates; /* [n_vectors] */
    size_t *iterations;
} refined_light;

void refined_light_free(refined_light *r);

/* Refines every vector of e to a tolerance (lam_refine) by the form factors of the store at path, which must
 * keep some. It starts from the answers of op. stop as of emission_apply. Errors: LAM_ERR_ARGUMENT (none
 * are kept; an emission that is not a sum of the store's emitters), LAM_ERR_NUMERIC (not reached), those of
 * opening a store, LAM_ERR_MEMORY. */
lam_status emission_refine(const emission *e, const char *path, const lam_operator *op, const lam_sky *sky,
                           lam_quantity quantity, double tolerance, lam_status (*stop)(lam_error *error),
                           refined_light *out, lam_error *error);

#endif
