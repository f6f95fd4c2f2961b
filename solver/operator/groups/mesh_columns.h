/* Columns of the elements of a store, read from its mesh: areas and centres. */
#ifndef LAMBERT_OPERATOR_GROUPS_MESH_COLUMNS_H
#define LAMBERT_OPERATOR_GROUPS_MESH_COLUMNS_H

#include "store/status.h"
#include "store/store_map.h"

/* *out: [n] f64, m^2, in place where the store is mapped. Errors: LAM_ERR_FORMAT names an area that is
 * negative or not finite, LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status areas_view(store *s, size_t n, store_view *out, lam_error *error);

/* *out [n][3], area centroids, m, in the axes of the scene; freed with free(). Vertices are read meanwhile.
 * O(n). Errors: LAM_ERR_FORMAT names a corner that is no vertex, LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status centres_load(store *s, size_t n, float **out, lam_error *error);

#endif
