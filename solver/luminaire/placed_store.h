/* Placed luminaires in a store (/luminaires, store/FORMAT.md), with the tables of their light, so that later
 * work needs no files of luminaires. Their direct light is there too, but no part of this. */
#ifndef LAMBERT_LUMINAIRE_PLACED_STORE_H
#define LAMBERT_LUMINAIRE_PLACED_STORE_H

#include "solver/luminaire/placed.h"
#include "store/store.h"

/* A luminaire, and a group of the scene that does not hide it. */
typedef struct placed_ignoring {
    uint32_t luminaire, group;
} placed_ignoring;

/* Writes all but the direct light. scale [n]: factors of candela at dim 1, with that of TILT; ignoring
 * [n_ignoring], ascending. Errors: those of the store, LAM_ERR_MEMORY. */
lam_status placed_save(const placed_luminaires *p, const double *scale, size_t n_ignoring,
                       const placed_ignoring *ignoring, store *s, lam_error *error);

/* Reads them, as a list that gives the same light: fluxes stand for all factors, and no table has TILT.
 * Groups are those of the scene, of which they ignore some. *out is empty where the store has none; freed by
 * placed_free. Errors: LAM_ERR_FORMAT, LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status placed_load(store *s, size_t n_groups, char *const *group_names, placed_luminaires *out,
                       lam_error *error);

/* True where two luminaires light a scene alike at dim 1, but for a factor of all of it, if the same groups
 * hide them: they have the same place, frame, opening and table. */
bool placed_lights_alike(const placed_luminaires *a, size_t i, const placed_luminaires *b, size_t j);

#endif
