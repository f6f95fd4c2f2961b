/* From what a source found to the repaired upper triangle of a scene. */
#ifndef LAMBERT_FORMFACTOR_CLOSING_H
#define LAMBERT_FORMFACTOR_CLOSING_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rows/upper.h"
#include "solver/formfactor/visibility/visibility.h"

/* Repairs f->upper, A_i F_ij, with the shares of the rays that leave. Errors: LAM_ERR_MEMORY. */
lam_status closing_repair(form_factors *f, const mesh *m, const visibility *v, lam_error *error);

/* Merges one-sided rows, whose entries are F_ij times rays, into the repaired upper triangle; frees the rows.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_IO. */
lam_status closing_merge(form_factors *f, const mesh *m, const visibility *v, packed_rows *rows, size_t rays,
                         const large_place *place, lam_error *error);

#endif
