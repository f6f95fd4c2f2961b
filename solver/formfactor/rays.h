/* Ray counting: how many of an element's rays first meet each other element. */
#ifndef LAMBERT_FORMFACTOR_RAYS_H
#define LAMBERT_FORMFACTOR_RAYS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/found_rows.h"
#include "solver/formfactor/visibility.h"

/* counts gets rows of hits; leaving and absorbed, [n], the shares that met nothing or a back face. The caller
 * frees counts with found_rows_free. */
lam_status rays_count(const mesh *m, const visibility *v, const uint32_t *order,
                      const form_factor_options *options, found_rows *counts, double *leaving,
                      double *absorbed, lam_error *error);

/* Casts rays from n_elements elements, spread over the order, and drops what they meet: for their time. */
void rays_cast_some(const mesh *m, const visibility *v, const uint32_t *order, size_t n_elements,
                    size_t rays);

#endif
