/* From merged exchange areas to form factors that keep reciprocity and their row sums. */
#ifndef LAMBERT_FORMFACTOR_REPAIR_H
#define LAMBERT_FORMFACTOR_REPAIR_H

#include "solver/formfactor/formfactor.h"

/* Scales g_ij by d_i d_j so that every row closes, d_i (A_i outside_i + sum_j g_ij d_j) = A_i (symmetric
 * Sinkhorn sweeps), never above: G, the upper triangle of g (upper.h), becomes A_i F_ij. outside, [n], is the
 * sampled share that does not reach an element: the outside is one more partner, scaled like the rest of its
 * row, so that a row whose own rays missed what others saw of it is not silenced by them. Fills the repair
 * figures, closure and reciprocity errors, row_sums. The same for any number of threads. */
lam_status repair_close(csr *G, const double *area, const double *outside, form_factors *out,
                        lam_error *error);

#endif
