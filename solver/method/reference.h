/* The judge of all: radiosity in double, by dense LU or by converged iteration. Slow, exact, obvious. */
#ifndef LAMBERT_METHOD_REFERENCE_H
#define LAMBERT_METHOD_REFERENCE_H

#include "solver/base/progress.h"
#include "solver/linalg/factor_product.h"

/* With more elements a reference is never a dense LU, whose matrix takes 8 n^2 bytes. */
#define REFERENCE_DENSE_ELEMENTS 8192

/* The solver of B = E + R F B for one channel and one F. */
typedef struct reference reference;

typedef enum reference_way { REFERENCE_DENSE, REFERENCE_ITERATED } reference_way;

/* Seconds of one thread that the cheaper way takes for m emissions with a guide, of n elements whose form
 * factors have that many entries: for a forecast. */
double reference_seconds(double n, double entries, double m);

/* The way that takes less time for m emissions, by the operations of both: n^3 of the LU and n^2 m of its
 * solves against m products with F for each of the sweeps that the mean reflectance lets expect, or, guided,
 * of a few steps of guided_reference_correct. It is the same on every machine. Form factors that are no rows
 * are iterated. */
reference_way reference_choose(const factor_product *F, const double *area, const float *reflectance,
                               size_t m, bool guided);

/* F (with reciprocity: A_i F_ij = A_j F_ji), area and reflectance must outlive it.
 * Dense: factorizes I - R F, O(n^3). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status reference_create(const csr *F, const double *area, const float *reflectance, reference_way way,
                            reference **out, lam_error *error);
/* The same; form factors that are no rows are iterated. */
lam_status reference_create_of(const factor_product *F, const double *area, const float *reflectance,
                               reference_way way, reference **out, lam_error *error);
void reference_destroy(reference *r);

/* B of m emissions, both [m][n]. B holds a guess on entry (E will do), which an iteration starts from.
 * Iterated: conjugate gradients on the symmetric form I - R^1/2 S R^1/2, S = A^1/2 F A^-1/2, safe for a
 * reflectance of 0, until each vector's residual is below tolerance times its solution.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC (no convergence), LAM_ERR_CANCELLED. */
lam_status reference_solve(const reference *r, size_t m, const double *E, double *B, double tolerance,
                           const progress *p, lam_error *error);

#endif
