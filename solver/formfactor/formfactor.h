/* Form factors as sparse rows, repaired so that they keep reciprocity and their row sums. */
#ifndef LAMBERT_FORMFACTOR_FORMFACTOR_H
#define LAMBERT_FORMFACTOR_FORMFACTOR_H

#include "solver/operator/csr.h"
#include "solver/scene/mesh.h"

typedef struct form_factors {
    csr F;            /* rows F[i][.], mesh order */
    double *row_sums; /* [n], of F after repair, <= 1 */
    double *leaving;  /* [n], share of an element's rays that left the scene */
    double *absorbed; /* [n], share that hit a back face */
    char method[16];  /* "rays" */
    size_t rays;      /* per element */
    uint64_t seed;
    bool closed;          /* nothing leaves but through cracks between elements */
    double leaving_share; /* area-weighted means */
    double absorbed_share;
    double closure_error;           /* largest |row sum - its target| after repair */
    double reciprocity_error;       /* largest |A_i F_ij - A_j F_ji| / max of both */
    double repair_mean, repair_max; /* |1 - row sum - what goes outside| before repair */
} form_factors;

typedef struct ray_options {
    size_t rays; /* per element */
    uint64_t seed;
    const progress *progress;
    const char *stage; /* what progress calls it */
} ray_options;

/* Counts rays (Embree) from every element, merges the two estimates of each pair by reciprocity and repairs
 * the row sums. The result is the same for any number of threads. order is [n] (mesh_z_order): the sequence
 * in which elements are traced, for locality only.
 * Cost: n * rays rays and O(nnz) memory. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_INTERNAL. */
lam_status form_factors_trace(const mesh *m, const uint32_t *order, const ray_options *options,
                              form_factors *out, lam_error *error);

void form_factors_free(form_factors *f);

/* The mean of two independent samples of the same mesh: a reference with half the variance. */
lam_status form_factors_mean(const form_factors *a, const form_factors *b, form_factors *out,
                             lam_error *error);

/* Rays per element for a factorization bound epsilon: the sampling noise of a merged F has a 2-norm of about
 * sqrt(2/rays); share is what part of epsilon it may be. A power of two. */
size_t form_factors_auto_rays(double epsilon, double share);

/* /form_factors of a store. */
lam_status form_factors_save(const form_factors *f, store *s, lam_error *error);
lam_status form_factors_load(store *s, const mesh *m, form_factors *out, lam_error *error);

#endif
