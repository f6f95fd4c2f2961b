/* Small transport problems whose operator is known in double, for every kind: what the contract test judges
 * by. Everything here is dense, slow and obvious. */
#ifndef LAMBERT_TESTS_TRANSPORT_H
#define LAMBERT_TESTS_TRANSPORT_H

#include "solver/linalg/panel.h"
#include "solver/operator/hierarchical.h"
#include "solver/operator/operator.h"
#include "solver/operator/sparse.h"
#include "support/dense.h"
#include "support/random_basis.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* The unit roundoff of single precision. */
#define TRANSPORT_U (FLT_EPSILON / 2.0)

/* An operator and what it should be. */
typedef struct transport {
    const char *name, *kind;
    size_t n, n_channels, k;
    float *reflectance; /* [C][n] */
    double *F;          /* [n][n] form factors of the truth, that all channels share */
    double *P;          /* [C][n][n] bounced light, mesh order: what the kind must compute */
    double *magnitude;  /* [C][n][n] the sum of the magnitudes of the products behind P */
    double roundings;   /* the most roundings of each of those products, in units of u */
    uint32_t *order;    /* [n] or NULL */
    panel_precision precision;
    lam_operator *op;
    lam_operator *lender; /* whose large arrays op has; or NULL */
} transport;

/* A sum of count products in single precision (of two meshes, in double, fewer): each is rounded when it is
 * made and with every partial sum; at most 128 of them stand in one, 16 lanes are added, and the total is
 * rounded once more. */
double sum_roundings(size_t count);

/* Every variant that the contract test judges: its name, its kind, the precision of its large arrays, and who
 * makes it. "3 channels", "folded" and "relit" in a name say so of the variant; of channels that are "alike"
 * the last has the reflectances of the first. */
#define TRANSPORT_LIST(X)                                                                                    \
    X(EXACT, "exact", "exact", PANEL_F32, make_exact)                                                        \
    X(EXACT_COLOUR, "exact, 3 channels", "exact", PANEL_F32, make_exact)                                     \
    X(FOLDED, "folded", "low_rank", PANEL_F32, make_low_rank)                                                \
    X(FACTORED, "factored", "low_rank", PANEL_F32, make_low_rank)                                            \
    X(FACTORED_COLOUR, "factored, 3 channels", "low_rank", PANEL_F32, make_low_rank)                         \
    X(FOLDED_F16, "folded, f16", "low_rank", PANEL_F16, make_low_rank)                                       \
    X(FOLDED_I8, "folded, i8", "low_rank", PANEL_I8, make_low_rank)                                          \
    X(FACTORED_COLOUR_I8, "factored, 3 channels, i8", "low_rank", PANEL_I8, make_low_rank)                   \
    X(TWO_MESH, "two meshes, folded", "two_mesh", PANEL_F32, make_low_rank)                                  \
    X(TWO_MESH_COLOUR, "two meshes, 3 channels", "two_mesh", PANEL_F32, make_low_rank)                       \
    X(TWO_MESH_F16, "two meshes, folded, f16", "two_mesh", PANEL_F16, make_low_rank)                         \
    X(TWO_MESH_I8, "two meshes, folded, i8", "two_mesh", PANEL_I8, make_low_rank)                            \
    X(TWO_MESH_COLOUR_I8, "two meshes, 3 channels, i8", "two_mesh", PANEL_I8, make_low_rank)                 \
    X(SPARSE, "sparse, with delta", "sparse", PANEL_F32, make_sparse)                                        \
    X(SPARSE_PARTS, "sparse, with delta of parts", "sparse", PANEL_F32, make_sparse)                         \
    X(SPARSE_COLOUR, "sparse, 3 channels", "sparse", PANEL_F32, make_sparse)                                 \
    X(HIERARCHICAL, "hierarchical", "hierarchical", PANEL_F32, make_hierarchical)                            \
    X(HIERARCHICAL_COLOUR, "hierarchical, 3 channels", "hierarchical", PANEL_F32, make_hierarchical)         \
    X(HIERARCHICAL_ALIKE, "hierarchical, 3 channels, alike", "hierarchical", PANEL_F32, make_hierarchical)   \
    X(RELIT, "relit", "low_rank", PANEL_F32, make_low_rank)                                                  \
    X(RELIT_COLOUR_F16, "relit, 3 channels, f16", "low_rank", PANEL_F16, make_low_rank)                      \
    X(RELIT_TWO_MESH_F16, "two meshes, relit, f16", "two_mesh", PANEL_F16, make_low_rank)                    \
    X(RELIT_TWO_MESH_COLOUR, "two meshes, relit, 3 channels", "two_mesh", PANEL_F32, make_low_rank)

typedef enum transport_kind {
#define TRANSPORT_ENUMERATOR(id, name, kind, precision, make) TRANSPORT_##id,
    TRANSPORT_LIST(TRANSPORT_ENUMERATOR) TRANSPORT_KINDS
} transport_kind;

/* The random parts that a maker may use: F = U V^T of rank k; begin: of a coarse mesh, NULL for other kinds.
 */
typedef struct transport_parts {
    const double *F;
    const float *U, *V;
    const uint64_t *begin;
    uint64_t *state; /* of the random numbers to come */
} transport_parts;

/* Area of an element: that of the store's mesh where a kind asks for it. Roots are exact. */
double transport_area(size_t element);

/* Puts an operator that was made for other reflectances and relit in place of one made for its own. The cores
 * of both are in double until they are rounded once: nothing is added to the roundings. */
void relight(transport *t, const transport_parts *parts);

/* An operator of a kind with its truth; ordered: its rows are in a random order inside. */
transport transport_make(transport_kind kind, bool ordered);

void transport_free(transport *t);

/* Each kind in mesh order, then each in an order of its own. */
enum { TRANSPORTS = 2 * TRANSPORT_KINDS };

/* Made once and kept: an operator does not change. */
transport *transport_kept(int index);

/* Unchecked fixtures: what is there before libcheck forks, no test makes again. */
void transport_keep_all(void);

void transport_free_all(void);

/* The row of a quantity's matrix: out_i = direct E_i + scale sum_j P_ij E_j. */
void quantity_row(lam_quantity quantity, float rho, double *direct, double *scale);

/* Numbers of both signs, none of them 0. */
float *random_vectors(size_t count, uint64_t seed);

/* Applies (or its adjoint) into NaN with a fresh work area of just the size asked for; the caller frees. */
float *transport_apply(const lam_operator *op, bool adjoint, size_t n_rhs, lam_quantity quantity,
                       const float *in);

#endif
