/* The light that comes to elements through panes, which the rows of opaque faces do not have: with T(w) what
 * all panes along a ray w pass, and V = 1 where the ray's first hit is a pane,
 *     F_ij = 1/(A_i pi) int_Ai int_j V T(w) cos dw dA.
 * Half of the rays are aimed at panes, and weighted against others as in rays/portals.h. */
#ifndef LAMBERT_FORMFACTOR_GLASS_PANE_LIGHT_H
#define LAMBERT_FORMFACTOR_GLASS_PANE_LIGHT_H

#include "solver/base/progress.h"
#include "solver/formfactor/recipe.h"
#include "solver/formfactor/rows/row_code.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/formfactor/visibility/visibility.h"

typedef struct pane_light_options {
    const recipe *recipe; /* its seed */
    size_t rays;          /* of an element by the cosine, and as many towards panes; a multiple of
                             VISIBILITY_PACKET */
    sky_bounce *sky;      /* gets the shares of rays that leave; NULL: none */
    bool without_rows;
    const progress *progress;
    const char *stage;
} pane_light_options;

/* rows: the F_ij above, one-sided, of the fronts of opaque faces and of further panes; sky: the share of each
 * tile and of the ground. order as for form_factors_make. The same for any number of threads. The caller
 * frees rows with packed_rows_free. Cost: 2 rays rays and those behind panes for each element that has a pane
 * before it. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status pane_light_make(const mesh *m, const visibility *v, const uint32_t *order,
                           const pane_light_options *options, packed_rows *rows, lam_error *error);

#endif
