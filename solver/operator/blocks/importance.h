/* The importance of elements for answers of which only some elements are read (Smits, Arvo and Salesin 1992).
 * An error dH of the light that arrives at an element changes what is read, sum_i A_i w_i B_i, by
 *     sum_i A_i y_i rho_i dH_i,   y = (I - R F)^-1 w:
 * the importance y is the radiosity of a scene in which what is read, and nothing else, emits w. */
#ifndef LAMBERT_OPERATOR_BLOCKS_IMPORTANCE_H
#define LAMBERT_OPERATOR_BLOCKS_IMPORTANCE_H

#include "solver/linalg/factor_product.h"
#include "solver/operator/blocks/plane_tree.h"
#include "store/store.h"

typedef struct importance {
    size_t n;
    float *read; /* [n] by element: w over its largest value */
    float *of;   /* [n] by element: y, between importance_least and 1; NULL before it is found */
    double share_of_bounds, share_of_thresholds; /* found with it: importance.c says how */
} importance;

/* No element has less importance, so that light which is not read is roughly right: it errs by some 4 times
 * as much. Bounds of blocks and thresholds of coefficients are multiplied by the shares, beside what
 * importance allows, so that what is read errs about as much as where all is read. */
extern const double importance_least;

void importance_free(importance *i);

/* Finds y by rho [C][n], of which the largest of all channels counts, to within a hundredth, and the shares.
 * F may be coarse; area [n]. Cost: about ten products. Errors: LAM_ERR_MEMORY, those of the product. */
lam_status importance_find(const factor_product *F, size_t n_channels, const float *rho, const double *area,
                           importance *io, lam_error *error);

/* out: the importance of a reference, y^1/2, between y and 1, of what is read alike, with a share of bounds
 * of half or more. The caller frees it.
 * Errors: LAM_ERR_MEMORY. */
lam_status importance_even_out(const importance *i, importance *out, lam_error *error);

/* /importance of a store: the elements with a weight and their weights; option says in the words of the
 * command line where these are from. Loading leaves `of` NULL, and n at 0 where the store has none. Errors:
 * those of the store; LAM_ERR_FORMAT where an element is not below n, or a weight not above 0 and at most 1;
 * LAM_ERR_MEMORY. */
lam_status importance_save(const importance *i, const char *option, store *s, lam_error *error);
lam_status importance_load(store *s, size_t n, importance *out, lam_error *error);

/* out [n_clusters + n], of clusters, then of elements by position: the root mean square over the elements of
 * each, by area, of `of` [n] by element. A function of norm 1 that is spread over a cluster has this norm
 * where it is multiplied by `of`. area [n] by element. The caller frees it. Errors: LAM_ERR_MEMORY. */
lam_status importance_of_nodes(const float *of, const double *area, const plane_tree *tree, float **out,
                               lam_error *error);

#endif
