/* What rays say leaves the scene, and what rows that are closed leave outside. */
#ifndef LAMBERT_FORMFACTOR_LEAVING_H
#define LAMBERT_FORMFACTOR_LEAVING_H

#include "solver/formfactor/formfactor.h"

/* f->closed, leaving_share and absorbed_share from f->leaving and absorbed. */
void closing_measure(form_factors *f, const mesh *m);

/* Whether nothing leaves and nothing meets back faces, but through cracks; closing_measure goes before. */
bool closing_all_stays(const form_factors *f);

/* The share of an element's rays that rows are closed by, to the outside; likewise. */
double closing_outside(const form_factors *f, size_t element);

/* What rows leave outside by f->row_sums, shared as the rays found it: f->sky becomes first_bounce. Errors:
 * LAM_ERR_MEMORY. */
lam_status closing_sky(form_factors *f, size_t n, lam_error *error);

#endif
