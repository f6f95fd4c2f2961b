/* The balance of a row of form factors: what the rays of element i do not deliver to other elements,
 *     1 = sum_j F_ij + leaving_i + absorbed_i,
 * with leaving_i the share of rays that leave the scene and absorbed_i the share that hits back faces. Both
 * are 0 in a closed scene, where the few rays that slip through cracks between elements count as noise. */
#ifndef LAMBERT_FORMFACTOR_LEAVING_H
#define LAMBERT_FORMFACTOR_LEAVING_H

#include "solver/formfactor/formfactor.h"

/* A scene is closed where a smaller share of its rays than this leaves. In single precision a few rays slip
 * between elements that meet without sharing vertices, or start behind a neighbour and hit its back. The
 * repair distributes their share over the row. */
#define LEAVING_CRACKS 1e-4

/* Sets f->closed and the area-weighted means leaving_share and absorbed_share from f->leaving and absorbed.
 */
void leaving_measure(form_factors *f, const mesh *m);

/* True where rows must sum to 1: no ray leaves or hits a back face but through cracks. Needs leaving_measure.
 */
bool leaving_nothing(const form_factors *f);

/* leaving_i + absorbed_i as the repair takes it: 0 where only cracks let rays through. Needs leaving_measure.
 */
double leaving_outside(const form_factors *f, size_t element);

/* Turns f->sky from shares of rays into first_bounce: the part 1 - row_sums_i that the repaired row leaves is
 * distributed over the tiles, the ground and back faces as the rays were. Errors: LAM_ERR_MEMORY. */
lam_status leaving_to_sky(form_factors *f, size_t n, lam_error *error);

#endif
