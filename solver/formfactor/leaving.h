/* The balance of a row of form factors: what the rays of element i do not deliver to other elements,
 *     1 = sum_j F_ij + leaving_i + absorbed_i,
 * with leaving_i the share of rays that leave the scene and absorbed_i the share that hits back faces. A
 * scene is closed where rays leave through nothing but cracks, gaps that are narrower than a stated width
 * (visibility/openings.h); no share of all light decides it, so that a small skylight lights a large hall. A
 * pane is none of its gaps: a room whose panes look outside is open, but the cracks of its walls are cracks.
 */
#ifndef LAMBERT_FORMFACTOR_LEAVING_H
#define LAMBERT_FORMFACTOR_LEAVING_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"

/* Openings let light out where more than this share of the lost light that was followed passes gaps wider
 * than a crack. */
#define LEAVING_OPEN .1

/* Sets f->leaving_share and absorbed_share, area-weighted means of f->leaving and absorbed, f->closed and
 * f->outlet. Light that leaves through cracks, or meets backs through cracks, counts as noise: the repair
 * distributes it over the row. Buried elements (buried.h) and panes have no part in it. f->recipe.closure
 * overrules what rays find. Of each kind of lost light 64 rays are followed, which are found by the recipe's
 * seed. Cost: for each of them 400 rays, and those that are cast until one is lost. */
void leaving_measure(form_factors *f, const mesh *m, const visibility *v);

/* True where rows must sum to 1: no ray leaves or hits a back face but through cracks. Needs leaving_measure.
 */
bool leaving_nothing(const form_factors *f);

/* True where light leaves from panes, and else through cracks alone. Needs leaving_measure. */
bool leaving_by_panes(const form_factors *f);

/* leaving_i + absorbed_i as the repair takes it: 0 where only cracks let rays through, but as the rays found
 * it for a buried element, whose row is nearly empty, and for panes that look outside. Needs leaving_measure.
 */
double leaving_outside(const form_factors *f, const mesh *m, size_t element);

/* Turns f->sky from shares of rays into first_bounce: the part that the repaired row leaves, 1 - row_sums_i
 * with what comes through panes left out, is distributed over the tiles, the ground and back faces as the
 * rays were. Errors: LAM_ERR_MEMORY. */
lam_status leaving_to_sky(form_factors *f, const mesh *m, lam_error *error);

#endif
