/* Compressed form factors: A^1/2 F A^-1/2 in a basis of multiwavelets without its small coefficients, and a
 * bound on the error of the product with every x.
 *
 * x is split into the means m_g over some groups, whose irradiance F 1_g is stored, and the rest y:
 *     F x ~ sum_g m_g F 1_g + A^-1/2 W^T S W A^1/2 y,   y = x - sum_g m_g 1_g.
 * The error is A^-1/2 W^T D W A^1/2 y with D = W A^1/2 F A^-1/2 W^T - S, the dropped coefficients. d_tk is
 * the Frobenius norm of the block of D with the rows of node t and the columns of the nodes of class k. With
 * c = W A^1/2 y and its parts c_k, by Cauchy and Schwarz, the error at element i is
 *     |F x - F~ x|_i <= sum_{t above i} M_t sum_k d_tk |c_k|,   M_t = max_i |psi_t(i)|,
 * where psi_t(i) are the values of the node's wavelets at i. bound holds M_t d_tk. */
#ifndef LAMBERT_OPERATOR_REFINE_COMPRESSED_FACTORS_H
#define LAMBERT_OPERATOR_REFINE_COMPRESSED_FACTORS_H

#include "solver/linalg/csr.h"
#include "solver/operator/wavelet/wavelets.h"

/* The class of a node is its height (leaves: 0), or the last class for the highest nodes. */
enum { COMPRESSED_CLASSES_MOST = 255 };

typedef struct compressed_factors {
    size_t n;
    wavelets basis;
    uint32_t *order; /* [n], position -> element */
    csr S;           /* by coefficient; its upper triangle with the diagonal until compressed_finish */
    size_t n_classes;
    float *bound;        /* [n_nodes][n_classes], rounded up */
    size_t n_lit;        /* groups g whose F 1_g is stored */
    uint32_t *lit_group; /* [n_lit] */
    float *lit;          /* [n_lit][n] F 1_g, by element */
    /* Derived by compressed_place: */
    uint8_t *class_of; /* [n], by coefficient */
    double *root;      /* [n] A^1/2, by position */
    uint32_t *lit_of;  /* [n], by element: the place of its group in lit_group, or n_lit */
    double *lit_area;  /* [n_lit] */
    double area;       /* of all elements */
    double rounding;   /* of (F~ x)_i over |x|_max; set by compressed_finish */
} compressed_factors;

void compressed_free(compressed_factors *c);

/* Derives the classes and the arrays by element from basis, order and lit_group. area, group: [n], by
 * element. Errors: LAM_ERR_MEMORY. */
lam_status compressed_place(compressed_factors *c, const double *area, const uint32_t *group,
                            lam_error *error);

/* Called after compressed_place: mirrors the upper triangle S. Errors: LAM_ERR_MEMORY. */
lam_status compressed_finish(compressed_factors *c, lam_error *error);

/* Write and read /form_factors of a store. c to save has the upper triangle alone; loading finishes it, with
 * the groups of /mesh. Errors: as store_read; LAM_ERR_FORMAT, LAM_ERR_NUMERIC when parts do not match. */
lam_status compressed_save(const compressed_factors *c, store *s, lam_error *error);
lam_status compressed_load(store *s, size_t n, const double *area, compressed_factors *out, lam_error *error);

/* Bytes in memory of the form factors of a store. Errors: as store_array_info. */
lam_status compressed_size(store *s, size_t *bytes, lam_error *error);
size_t compressed_bytes(const compressed_factors *c);

/* Doubles of work for a product or a bound. */
size_t compressed_work(const compressed_factors *c);

/* norms [n_classes] = |c_k| for x. */
void compressed_norms(const compressed_factors *c, const double *x, double *norms, double *work);

/* y ~ F x, both [n] by element. The bits do not depend on n_threads. */
void compressed_multiply(const compressed_factors *c, const double *x, double *y, double *work,
                         size_t n_threads);

/* out [n], by element: a bound on |F x - F~ x|_i without the rounding of compressed_multiply. Returns the
 * largest. */
double compressed_error(const compressed_factors *c, const double *x, double *out, double *work);

#endif
