/* Panels in a store. */
#ifndef LAMBERT_LINALG_PANEL_STORE_H
#define LAMBERT_LINALG_PANEL_STORE_H

#include "solver/linalg/panel.h"
#include "store/store.h"

/* Reads a panel [n][*k], or of a mapped store (store_map_file) a large one where it lies, in the precision it
 * is kept in, with name_scale; *k may be SIZE_MAX: as found. The
 * caller frees with panel_free. Errors: LAM_ERR_FORMAT names what the file has, LAM_ERR_MEMORY. */
lam_status panel_load(store *s, const char *name, size_t n, size_t *k, panel *a, lam_error *error);

/* a from values [n][k] of a view, from offset bytes on: where they are mapped they stay where they are and a
 * holds the mapping, else they are copied. Errors: as panel_create_kept. */
lam_status panel_from_view(size_t n, size_t k, panel_precision precision, const store_view *values,
                           size_t offset, const float *scale, const char *name, panel *a, lam_error *error);

/* Writes a and, where it has one, its scale. */
lam_status panel_save(const panel *a, store *s, const char *name, lam_error *error);

/* LAM_ERR_FORMAT when /operator has the attribute precision and that is another one. */
lam_status panel_check_precision(store *s, panel_precision precision, lam_error *error);

#endif
