/* Form factors and the first bounce of a sky with the light that panes let pass (pane_light.h). */
#ifndef LAMBERT_FORMFACTOR_GLASS_PANE_FACTORS_H
#define LAMBERT_FORMFACTOR_GLASS_PANE_FACTORS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"

/* The samples whose mean is taken: of each of the seeds by so many rays by the cosine, and as many towards
 * panes, from an element, rounded up to a multiple of 8. */
typedef struct pane_samples {
    size_t rays, n_seeds;
    uint64_t seeds[2];
} pane_samples;

/* The sample beside form factors of a recipe: by half of its own rays, from 512 on, and its seed. */
pane_samples panes_beside(const recipe *r);

/* Adds to closed form factors, whose upper triangle f has, the exchange through panes,
 *     A_i F_ij += A_i F_ij through panes,
 * and to f->sky, unless that is zero, what comes from the tiles and the ground through panes. Row sums then
 * are up to 1 + T where a pane is in sight: it receives all of the light that it passes on. Does nothing
 * where there are no panes. Cost: as pane_light_make. Errors: LAM_ERR_MEMORY, LAM_ERR_IO, LAM_ERR_CANCELLED.
 */
lam_status panes_add(const mesh *m, const visibility *v, const uint32_t *order,
                     const form_factor_options *options, const pane_samples *samples, form_factors *f,
                     lam_error *error);

/* The same for a sky alone: first bounces of a sky that is closed (sky_bounce_close), whose tiling and ground
 * it has; ground, [n] or NULL, gets the shares of the ground through panes added. */
lam_status panes_add_bounce(const mesh *m, const visibility *v, const uint32_t *order,
                            const form_factor_options *options, const pane_samples *samples,
                            sky_bounce *bounce, double *ground, lam_error *error);

#endif
