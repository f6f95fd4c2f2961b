/* Form factors compressed: A^1/2 F A^-1/2 in a basis of multiwavelets, of which small numbers are left out,
 * and what that may change at most, for every light.
 *
 * Light x is taken apart: the mean m_g of each of some groups, whose first light F 1_g is kept as it is, and
 * the rest y, which is smooth where light is:
 *     F x ~ sum_g m_g F 1_g + A^-1/2 W^T S W A^1/2 y,   y = x - sum_g m_g 1_g.
 * What is missing is A^-1/2 W^T D W A^1/2 y, D = W A^1/2 F A^-1/2 W^T - S. Of the rows of D that belong to a
 * node t of the tree, and of columns of nodes of one class, the Frobenius norm d_tk is known from when they
 * were left out. With c = W A^1/2 y and its parts c_k, by Cauchy and Schwarz at an element i,
 *     |F x - what is computed|_i <= sum_{t above i} M_t sum_k d_tk |c_k|,   M_t = max_i |psi_t(i)|,
 * psi_t(i) the values of the node's wavelets there. bound holds M_t d_tk. */
#ifndef LAMBERT_OPERATOR_REFINE_COMPRESSED_FACTORS_H
#define LAMBERT_OPERATOR_REFINE_COMPRESSED_FACTORS_H

#include "solver/linalg/csr.h"
#include "solver/operator/wavelet/wavelets.h"

/* A node is of the class of its height (leaves: 0), the highest ones of the last class. */

typedef struct compressed_factors {
    size_t n;
    wavelets basis;
    uint32_t *order; /* [n], position -> element */
    csr S;           /* by coefficient; in a store its upper triangle, the diagonal included */
    size_t n_classes;
    float *bound;        /* [n_nodes][n_classes], rounded up */
    size_t n_lit;        /* groups whose first light is kept */
    uint32_t *lit_group; /* [n_lit] */
    float *lit;          /* [n_lit][n] F 1_g, by element */
    /* Made by compressed_place. */
    uint8_t *class_of; /* [n], of a coefficient */
    double *root;      /* [n] A^1/2, by position */
    uint32_t *lit_of;  /* [n], by element: which of those groups; n_lit: none */
    double *lit_area;  /* [n_lit] */
    double area;       /* of all elements */
    double rounding;   /* of a product, by element, over |x|_max: by compressed_finish */
} compressed_factors;

void compressed_free(compressed_factors *c);

/* Of classes at most. */
enum { COMPRESSED_CLASSES_MOST = 255 };

/* n_classes and what elements need, from basis, order and lit_group. area, group: [n], by element. Errors:
 * LAM_ERR_MEMORY. */
lam_status compressed_place(compressed_factors *c, const double *area, const uint32_t *group,
                            lam_error *error);

/* Of one that was placed: mirrors S, so that it multiplies. Errors: LAM_ERR_MEMORY. */
lam_status compressed_finish(compressed_factors *c, lam_error *error);

/* /form_factors of a store; c is not finished. Loading finishes it; group comes from /mesh.
 * Errors: as store_read; LAM_ERR_FORMAT, LAM_ERR_NUMERIC where parts do not fit together. */
lam_status compressed_save(const compressed_factors *c, store *s, lam_error *error);
lam_status compressed_load(store *s, size_t n, const double *area, compressed_factors *out, lam_error *error);

/* Bytes that one of a store takes in memory. Errors: as store_array_info. */
lam_status compressed_size(store *s, size_t *bytes, lam_error *error);
size_t compressed_bytes(const compressed_factors *c);

/* Doubles of work for a product or a bound. */
size_t compressed_work(const compressed_factors *c);

/* |c_k| of light x, [n_classes]. */
void compressed_norms(const compressed_factors *c, const double *x, double *norms, double *work);

/* y ~ F x, both [n] by element. The bits do not depend on n_threads. */
void compressed_multiply(const compressed_factors *c, const double *x, double *y, double *work,
                         size_t n_threads);

/* out [n], by element: |F x - what compressed_multiply makes of x without rounding| at most. Returns the
 * largest. */
double compressed_error(const compressed_factors *c, const double *x, double *out, double *work);

#endif
