/* How many elements each one sees, as values to draw (Aguerre 2016, figures 4.2 and 4.8). */
#ifndef LAMBERT_RENDER_VISIBLE_VIEW_H
#define LAMBERT_RENDER_VISIBLE_VIEW_H

#include "store/store.h"

/* values [n] in mesh order, freed by the caller: how many form factors of a row are not 0; *mean and *most of
 * them. Errors: LAM_ERR_ARGUMENT where the store keeps no form factors, LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
lam_status visible_view_counts(store *s, size_t n, float **values, double *mean, double *most,
                               lam_error *error);

#endif
