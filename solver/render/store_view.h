/* Properties of a store as values to draw: the patches of its operator (Fernández et al. 2011, figures 1d and
 * 2b) and the number of elements that each one sees (Aguerre 2016, figures 4.2 and 4.8). */
#ifndef LAMBERT_RENDER_STORE_VIEW_H
#define LAMBERT_RENDER_STORE_VIEW_H

#include "store/store.h"

/* values [n_channels][n] in mesh order, freed by the caller. LAM_ERR_ARGUMENT where the store's operator has
 * no patches, or was stored without their coherence. */

/* The coherence of each element's patch, in [0, 1]; one channel. *smallest is the smallest of them. */
lam_status store_view_coherence(store *s, float **values, float *smallest, lam_error *error);

/* A colour for each patch, unlike those of its neighbours; three channels, display-linear. */
lam_status store_view_patches(store *s, float **values, size_t *n_patches, lam_error *error);

/* The number of nonzero form factors in each row, [n] in mesh order, freed by the caller; *mean and *most of
 * them. Errors: LAM_ERR_ARGUMENT where the store keeps no form factors, LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
lam_status store_view_visible(store *s, size_t n, float **values, double *mean, double *most,
                              lam_error *error);

#endif
