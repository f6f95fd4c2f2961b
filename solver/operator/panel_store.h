/* Panels in a store, and the cores of an operator that is factored. */
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

/* One panel a channel of core [C][k][k]; the caller frees with core_panels_free, NULL allowed. Errors: as
 * panel_create, LAM_ERR_MEMORY. */
lam_status core_panels_create(size_t n_channels, size_t k, const float *core, panel **out, lam_error *error);
void core_panels_free(panel *cores, size_t n_channels);

/* *core = [C][k][k] again; the caller frees. Errors: LAM_ERR_MEMORY. */
lam_status core_panels_copy(const panel *cores, size_t n_channels, float **core, lam_error *error);

/* Writes /operator/core. */
lam_status core_panels_save(const panel *cores, size_t n_channels, store *s, lam_error *error);

#endif
