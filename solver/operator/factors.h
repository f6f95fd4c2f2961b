/* The common part of operators of k columns: the array Y or U that spreads light out over the elements, the
 * cores between it and V, and the products of both. V and V^T E belong to the kind.
 * folded (grey):  P = -Y T                      T = V^T E
 * factored:       P_c = rho'_c U core_c T_c     U free of reflectance, shared by all channels */
#ifndef LAMBERT_OPERATOR_FACTORS_H
#define LAMBERT_OPERATOR_FACTORS_H

#include "solver/linalg/core.h"
#include "solver/operator/operator.h"

typedef struct factors {
    panel left;    /* [n][k]: Y or U */
    bool borrowed; /* left is another operator's, which outlives this */
    panel *core;   /* [C] of [k][k]; NULL when folded */
    size_t n_channels;
} factors;

/* left [n][k] and core [C][k][k] (NULL: folded) are taken over, also on an error. The caller frees with
 * factors_free. Errors: as panel_create. */
lam_status factors_create(size_t n, size_t k, size_t n_channels, float *left, float *core, factors *out,
                          lam_error *error);
void factors_free(factors *f);

/* Reads form, Y or U, and the cores of an open store; left.precision is what /operator says, where it says.
 * Errors: LAM_ERR_FORMAT names what the file has, LAM_ERR_MEMORY. */
lam_status factors_load(store *s, size_t n, size_t n_channels, factors *out, lam_error *error);
lam_status factors_save(const factors *f, store *s, lam_error *error);

/* The same with left in another precision. Errors: as panel_convert. */
lam_status factors_convert(const factors *f, panel_precision precision, factors *out, lam_error *error);

/* The cores of op, whose factors f are, under other reflectances [C][n] (mesh order), between the same left,
 * which out borrows. V is in `in`, as V_panel or begin and weight, with cancelled; the rest of it is filled
 * here. Errors: LAM_ERR_UNSUPPORTED (folded), as core_make. */
lam_status factors_relight(const lam_operator *op, const factors *f, core_factors in,
                           const float *reflectance, factors *out, lam_error *error);

void factors_set_threads(factors *f, size_t n_threads);

/* Form, precision, rank and bytes of a description. */
void factors_describe(const factors *f, operator_description *description);

/* Bytes for T and core T of n_rhs vectors and for any product with left, core or a V whose products need
 * V_bytes; 0 when that overflows. */
size_t factors_work_bytes(const factors *f, size_t n_rhs, size_t V_bytes);

/* Room for T, [n_rhs][C][stride], of which the kind fills k numbers per row. */
float *factors_take_columns(const factors *f, size_t n_rhs, void **work);

/* P from T for all rows or, with selected not NULL, for n_selected elements. */
void factors_expand(const lam_operator *op, const factors *f, size_t n_rhs, const float *T, size_t n_selected,
                    const uint32_t *selected, float *P, void *work);

/* The transpose: T from g, [n_rhs][C][n], which is overwritten. */
void factors_project(const lam_operator *op, const factors *f, size_t n_rhs, float *g, float *T, void *work);

#endif
