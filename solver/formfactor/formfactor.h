/* Form factors as sparse rows, repaired so that they keep reciprocity and their row sums. */
#ifndef LAMBERT_FORMFACTOR_FORMFACTOR_H
#define LAMBERT_FORMFACTOR_FORMFACTOR_H

#include "solver/formfactor/recipe.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/operator/csr.h"
#include "solver/scene/mesh.h"

/* What was skipped and what was done, in pairs. */
typedef struct pairs_report {
    double facing;  /* each other, and near enough */
    double certain; /* of those: nothing is between their clusters */
    double settled; /* so small that a first look says enough */
    double open;    /* no segment was blocked; hidden: every one was; mixed: some were, or a neighbour's */
    double hidden, mixed;
} pairs_report;

typedef struct form_factors {
    csr F;            /* rows F[i][.], mesh order */
    double *row_sums; /* [n], of F after repair, <= 1 */
    double *leaving;  /* [n], share of an element's rays that left the scene */
    double *absorbed; /* [n], share that hit a back face */
    sky_bounce sky;   /* where one was asked for, else zero */
    recipe recipe;
    pairs_report pairs;   /* where just made of pairs */
    bool closed;          /* nothing leaves but through cracks between elements */
    double leaving_share; /* area-weighted means */
    double absorbed_share;
    double closure_error;           /* largest |row sum - its target| after repair */
    double reciprocity_error;       /* largest |A_i F_ij - A_j F_ji| / max of both */
    double repair_mean, repair_max; /* |1 - row sum - what goes outside| before repair */
} form_factors;

typedef struct form_factor_options {
    recipe recipe;
    const progress *progress;
    const char *stage; /* what progress calls it */
    const char *sky;   /* a tiling that what leaves is binned by, at no further ray; NULL: none */
    double ground_albedo;
    sky_bounce *bounce; /* form_factors_make's own: where the rays put what leaves */
} form_factor_options;

/* Finds the form factors by a recipe, merges the two estimates of each pair by reciprocity and repairs the
 * row sums. The result is the same for any number of threads. order is [n] (mesh_z_order): the sequence in
 * which elements are worked on, for locality only.
 *
 * rays: counts rays (Embree) from every element. Cost: n * rays rays and O(nnz) memory.
 * hemicube: the same by hemicubes around every element's centroid: no sampling noise, but aliasing. Cost:
 *   3 n resolution^2 rays and O(nnz) memory.
 * pairs: pair by pair, magnitudes by mathematics, by rays only what is hidden of them. What a row lacks goes
 *   outside, or, where the scene is closed, is put back by the repair. Cost: O(n^2), about .3 us a pair that
 *   is facing; 9 bytes for each of those beside the rows.
 * near-pairs: the same for pairs of which a ray would hit several times, the others by rays.
 *
 * With a sky, what a repaired row leaves outside is shared among its tiles, the ground and back faces as the
 * rays (of pairs: recipe.rays of them) found it: sum_j F_ij + sum_t first_bounce/pi <= 1, and = 1 where
 * nothing meets a back face and the ground's albedo is 1. Cost: 4 m n bytes.
 *
 * Errors: LAM_ERR_ARGUMENT (a recipe out of bounds), LAM_ERR_MEMORY, LAM_ERR_CANCELLED,
 * LAM_ERR_INTERNAL. */
lam_status form_factors_make(const mesh *m, const uint32_t *order, const form_factor_options *options,
                             form_factors *out, lam_error *error);

void form_factors_free(form_factors *f);

/* The mean of two independent samples of the same mesh: a reference with half the variance, without a sky. */
lam_status form_factors_mean(const form_factors *a, const form_factors *b, form_factors *out,
                             lam_error *error);

/* /form_factors of a store; its /sky apart, by sky_bounce_save and sky_bounce_load. */
lam_status form_factors_save(const form_factors *f, store *s, lam_error *error);
lam_status form_factors_load(store *s, const mesh *m, form_factors *out, lam_error *error);

#endif
