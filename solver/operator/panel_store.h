/* Panels in a store. */
#ifndef LAMBERT_OPERATOR_PANEL_STORE_H
#define LAMBERT_OPERATOR_PANEL_STORE_H

#include "solver/operator/panel.h"
#include "store/store.h"

/* Reads a panel [n][*k] in the precision it is kept in, with name_scale; *k may be SIZE_MAX: as found. The
 * caller frees with panel_free. Errors: LAM_ERR_FORMAT names what the file has, LAM_ERR_MEMORY. */
lam_status panel_load(store *s, const char *name, size_t n, size_t *k, panel *a, lam_error *error);

/* Writes a and, where it has one, its scale. */
lam_status panel_save(const panel *a, store *s, const char *name, lam_error *error);

/* LAM_ERR_FORMAT when /operator has the attribute precision and that is another one. */
lam_status panel_check_precision(store *s, panel_precision precision, lam_error *error);

#endif
