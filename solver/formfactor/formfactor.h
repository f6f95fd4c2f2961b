/* Form factors as sparse rows, repaired so that they keep reciprocity and their row sums. */
#ifndef LAMBERT_FORMFACTOR_FORMFACTOR_H
#define LAMBERT_FORMFACTOR_FORMFACTOR_H

#include "solver/operator/csr.h"
#include "solver/scene/mesh.h"

typedef struct form_factors {
    csr F;             /* rows F[i][.], mesh order */
    double *row_sums;  /* [n], of F after repair, <= 1 */
    double *leaving;   /* [n], share of an element's rays that left the scene */
    double *absorbed;  /* [n], share that hit a back face */
    char method[16];   /* "rays", "hemicube", "pairs" */
    size_t rays;       /* per element; 0 where magnitudes are not counted by rays */
    uint64_t seed;     /* of the rays */
    size_t resolution; /* of a hemicube: pixels along its top; else 0 */
    double accuracy;   /* of pairs: of a factor that is partly hidden; else 0 */
    size_t pairs_facing, pairs_open, pairs_hidden; /* of pairs, when just made: plainly one or the other */
    bool closed;                                   /* nothing leaves but through cracks between elements */
    double leaving_share;                          /* area-weighted means */
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

/* Bounds of a hemicube's resolution, which is even besides. */
enum { HEMICUBE_LEAST = 4, HEMICUBE_MOST = 4096 };

typedef struct hemicube_options {
    size_t resolution; /* pixels along the top */
    const progress *progress;
    const char *stage; /* what progress calls it */
} hemicube_options;

/* The same by hemicubes around every element's centroid in place of rays: no sampling noise, but aliasing.
 * Cost: 3 n resolution^2 rays and O(nnz) memory. */
lam_status form_factors_hemicube(const mesh *m, const uint32_t *order, const hemicube_options *options,
                                 form_factors *out, lam_error *error);

typedef struct pair_options {
    double accuracy; /* absolute, of a factor that is partly hidden */
    uint64_t seed;
    const progress *progress;
    const char *stage; /* what progress calls it */
} pair_options;

/* More pairs than those of this many elements are not taken one by one. */
enum { PAIRS_ELEMENTS_MOST = 16384 };

/* The same pair by pair: magnitudes by mathematics to 1e-6, by rays only what is hidden of them. What a row
 * lacks goes outside, or, where the scene is closed, is put back by the repair. Cost: O(n^2), about 1 us a
 * pair; 2.5 n^2 bytes beside the rows. Errors besides: LAM_ERR_ARGUMENT for too many. */
lam_status form_factors_pairs(const mesh *m, const uint32_t *order, const pair_options *options,
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
