/* The repair of row sums: symmetric Sinkhorn scaling d_i g_ij d_j of merged exchange areas, which keeps
 * reciprocity. */
#ifndef LAMBERT_FORMFACTOR_REPAIR_H
#define LAMBERT_FORMFACTOR_REPAIR_H

#include "solver/formfactor/formfactor.h"

/* Scales g_ij by d_i d_j so that every row closes and none exceeds its target,
 *     d_i (A_i outside_i + sum_j g_ij d_j) = A_i
 * G, the upper triangle of g (upper.h), becomes A_i F_ij. outside, [n], is the sampled share that reaches no
 * element (leaving.h). It is scaled like the rest of its row, so that a row keeps what the rays of other
 * elements found of it. Sets the repair figures, closure and reciprocity errors, and row_sums. The same for
 * any number of threads. */
lam_status repair_close(csr *G, const double *area, const double *outside, form_factors *out,
                        lam_error *error);

#endif
