/* The importance of elements for answers of which only some elements are read (Smits, Arvo and Salesin 1992),
 * or in which only some emit. An error dH of the light that arrives at an element changes what is read,
 * sum_i A_i w_i B_i, by
 *     sum_i A_i y_i rho_i dH_i,   y = (I - R F)^-1 w:
 * the importance y is the radiosity of a scene in which what is read, and nothing else, emits w. Where
 * sources alone emit, by s, the light that an error can change goes as z = (I - R F)^-1 s, so that an error
 * of the factor between i and j counts as y_i z_j or y_j z_i. */
#ifndef LAMBERT_OPERATOR_BLOCKS_IMPORTANCE_H
#define LAMBERT_OPERATOR_BLOCKS_IMPORTANCE_H

#include "solver/linalg/factor_product.h"
#include "solver/operator/blocks/plane_tree.h"
#include "store/store.h"

#include <stdbool.h>

typedef struct importance {
    size_t n;        /* 0: none is known, all is read and may emit */
    float *read;     /* [n] by element: w over its largest value; NULL: all is read */
    float *emits;    /* [n] by element: s, at most 1 of the sources, else 0; NULL: any element may emit */
    bool sensors;    /* some are read by the light that they send to sensors */
    bool luminaires; /* some are sources by the light of luminaires that they reflect */
    float *of;       /* [n] by element: y, between importance_least and 1; NULL before it is found: 1 */
    float *lit;      /* [n] by element: z, likewise */
    double share_of_bounds, share_of_thresholds; /* found with them: importance.c says how */
} importance;

/* No element has less importance, so that light which is not read, or has other sources, is roughly right: it
 * errs by some 4 times as much, and light of which both is true by up to 40 times. Bounds of blocks and
 * thresholds of coefficients are multiplied by the shares, beside what importance allows, so that what is
 * read errs about as much as where all is read. */
extern const double importance_least;

void importance_free(importance *i);

/* Finds y where not all is read, and z where there are sources, by rho [C][n], of which the largest of all
 * channels counts, to within a hundredth, and the shares. F may be coarse; area [n]. Cost: about ten products
 * each. Errors: LAM_ERR_MEMORY, those of the product. */
lam_status importance_find(const factor_product *F, size_t n_channels, const float *rho, const double *area,
                           importance *io, lam_error *error);

/* True where importance_find was called. */
bool importance_is_found(const importance *i);

/* out: the importance of a reference, y^1/2 and z^1/2, between these and 1, of the same elements, with a
 * share of bounds of half, if that is more, but no more than 1.25 times theirs. The caller frees it. Errors:
 * LAM_ERR_MEMORY. */
lam_status importance_even_out(const importance *i, importance *out, lam_error *error);

/* /importance of a store: the elements with a weight and their weights; /sources: the elements that emit, and
 * their s where luminaires are among the sources, else it is 1; both groups say where sensors, or luminaires,
 * are among those that were named. The options say in the words of
 * the command line where these are from; one that is not needed may be NULL. Loading leaves y and z NULL, and
 * n at 0 where the store has neither. Errors: those of the store; LAM_ERR_FORMAT where an element is not
 * below n, a weight not above 0 and at most 1, or no element emits; LAM_ERR_MEMORY. */
lam_status importance_save(const importance *i, const char *option, const char *sources, store *s,
                           lam_error *error);
lam_status importance_load(store *s, size_t n, importance *out, lam_error *error);

/* [n_clusters + n], of clusters, then of elements by position: the root mean square over the elements of
 * each, by area, of y and of z. A function of norm 1 that is spread over a cluster has this norm where it is
 * multiplied by y. NULL: 1. */
typedef struct importance_nodes {
    float *of, *lit;
} importance_nodes;

/* area [n] by element. Errors: LAM_ERR_MEMORY. */
lam_status importance_nodes_make(const importance *i, const double *area, const plane_tree *tree,
                                 importance_nodes *out, lam_error *error);
void importance_nodes_free(importance_nodes *nodes);

/* The importance of the light between two nodes, which goes both ways, is max(y_a z_b, y_b z_a). */
double importance_between(const importance_nodes *nodes, size_t a, size_t b);

/* y_a z_a of one node: the root of its product with that of another node is the geometric mean of y_a z_b and
 * y_b z_a. */
double importance_at(const importance_nodes *nodes, size_t a);

#endif
