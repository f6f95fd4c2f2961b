/* From raw ray counts to form factors that keep reciprocity and their row sums. */
#ifndef LAMBERT_FORMFACTOR_REPAIR_H
#define LAMBERT_FORMFACTOR_REPAIR_H

#include "solver/formfactor/formfactor.h"

/* Merges c_ij and c_ji of counts (rays each) into the exchange areas g_ij = A_i F_ij = g_ji:
 *     g_ij = (c_ij + c_ji)/rays * A_i A_j/(A_i + A_j)
 * which weighs the two estimates of g, of variance ~ A_i g/rays and ~ A_j g/rays, by their inverse
 * variances. The result has the same bits in both triangles. G is freed by csr_free. */
lam_status repair_merge(const csr *counts, size_t rays, const double *area, csr *G, lam_error *error);

/* Scales g_ij by d_i d_j so that every row closes, d_i (A_i outside_i + sum_j g_ij d_j) = A_i (symmetric
 * Sinkhorn sweeps), never above, and divides by A_i: G becomes F. outside, [n], is the sampled share that
 * does not reach an element: the outside is one more partner, scaled like the rest of its row, so that a row
 * whose own rays missed what others saw of it is not silenced by them. Fills the repair figures, closure and
 * reciprocity errors, row_sums. */
lam_status repair_close(csr *G, const double *area, const double *outside, form_factors *out,
                        lam_error *error);

#endif
