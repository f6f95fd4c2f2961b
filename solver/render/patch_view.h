/* The patches of a store as values to draw (figures 1d and 2b of Fernández et al. 2011). */
#ifndef LAMBERT_RENDER_PATCH_VIEW_H
#define LAMBERT_RENDER_PATCH_VIEW_H

#include "store/store.h"

/* values [n_channels][n] in mesh order, freed by the caller. LAM_ERR_ARGUMENT where the store's operator has
 * no patches, or was stored without their coherence. */

/* Of each element the coherence of its patch, in [0, 1]; one channel. *smallest is the smallest of them. */
lam_status patch_view_coherence(store *s, float **values, float *smallest, lam_error *error);

/* A colour for each patch, unlike those of its neighbours; three channels, display-linear. */
lam_status patch_view_colors(store *s, float **values, size_t *n_patches, lam_error *error);

#endif
