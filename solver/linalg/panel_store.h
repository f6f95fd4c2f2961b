/* Panels in a store. */
#ifndef LAMBERT_LINALG_PANEL_STORE_H
#define LAMBERT_LINALG_PANEL_STORE_H

#include "solver/linalg/panel.h"
#include "store/store.h"

/* Reads a panel [n][*k] with NAME_scale in its stored precision; a large array of a mapped store
 * (store_map_file) stays in the mapping. *k = SIZE_MAX takes any k. The caller frees with panel_free. Errors:
 * LAM_ERR_FORMAT, which names the array found, LAM_ERR_MEMORY. */
lam_status panel_load(store *s, const char *name, size_t n, size_t *k, panel *a, lam_error *error);

/* a from values [n][k] of a view, from offset bytes on. Mapped values are not copied, and a holds the
 * mapping. Errors: as panel_create_kept. */
lam_status panel_from_view(size_t n, size_t k, panel_precision precision, const store_view *values,
                           size_t offset, const float *scale, const char *name, panel *a, lam_error *error);

/* Writes a and, where it has one, its scale. */
lam_status panel_save(const panel *a, store *s, const char *name, lam_error *error);

/* LAM_ERR_FORMAT when the attribute precision of /operator names another one. */
lam_status panel_check_precision(store *s, panel_precision precision, lam_error *error);

#endif
