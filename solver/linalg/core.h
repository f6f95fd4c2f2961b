/* The k x k core of a low-rank operator, inverted in double and judged by its condition. */
#ifndef LAMBERT_LINALG_CORE_H
#define LAMBERT_LINALG_CORE_H

#include "solver/linalg/panel.h"

#include <stdatomic.h>

/* A core worse than this is refused. */
#define CORE_RCOND_MIN 1e-12

/* K := K^-1, K [k][k] row-major, by LU; *rcond is its reciprocal condition number in the 1-norm (1 for k =
 * 0). On an error K's content is lost. Cost: O(k^3). Errors: LAM_ERR_NUMERIC (singular, not finite or rcond
 * below CORE_RCOND_MIN), LAM_ERR_MEMORY, LAM_ERR_ARGUMENT (k past what LAPACK counts to). */
lam_status core_invert(size_t k, double *K, double *rcond, lam_error *error);

/* F ~ U V^T, the reflectances between V and U, and a flag that stops the work. Rows are positions. */
typedef struct core_factors {
    size_t n, k;
    const float *U, *V;             /* [n][k], from a method; NULL: */
    const panel *U_panel, *V_panel; /* the same, from an operator */
    const uint64_t *begin;          /* [k+1]; not NULL: V has one entry a row (segments.h) and no array */
    const float *weight;            /* [n], of begin; NULL: 1 */
    const float *rho;               /* [n], by element */
    const uint32_t *order;          /* [n], position -> element; NULL: mesh order */
    atomic_bool *cancelled;         /* read after every block of rows; NULL: never cancelled */
} core_factors;

/* core [k][k] = (I - V^T R U)^-1 with R = diag(rho). Summed and inverted in double, rounded once: the bits do
 * not depend on where U and V are from. Cost: O(n k^2 + k^3), with begin O(nk + k^3). Errors: as core_invert,
 * LAM_ERR_CANCELLED (tested after 512 rows and after LU). */
lam_status core_make(const core_factors *in, float *core, double *rcond, lam_error *error);

/* core_make for arrays in mesh order. */
lam_status core_factored(size_t k, size_t n, const float *V, const float *U, const float *rho, float *core,
                         double *rcond, lam_error *error);

/* Called once, before any linear algebra: OpenBLAS asks OpenMP for as many threads as there are cores and
 * waits for ever when OMP_THREAD_LIMIT allows fewer. Version 0.3.29, not 0.3.21, asks for as many as OpenMP
 * would give the calling thread, whatever number OpenBLAS itself was set to. */
void core_keep_thread_limit(void);

/* Makes OpenBLAS use the calling thread alone, for a program that needs the other cores of the machine for
 * answers. Called once by each thread that makes cores. */
void core_use_one_thread(void);

#endif
