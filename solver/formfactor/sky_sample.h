/* The first bounce of a sky by rays alone: an estimate without bias, that shares nothing with one by what
 * pairs or blocks leave of a row. */
#ifndef LAMBERT_FORMFACTOR_SKY_SAMPLE_H
#define LAMBERT_FORMFACTOR_SKY_SAMPLE_H

#include "solver/formfactor/sky_bounce.h"
#include "solver/scene/mesh.h"

/* As `like`, its tiling and ground, by this many rays from each element. order as for form_factors_make.
 * Cost: n rays rays and 4 m n bytes. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status sky_sample_make(const mesh *m, const uint32_t *order, const sky_bounce *like, size_t rays,
                           uint64_t seed, const progress *steps, sky_bounce *out, lam_error *error);

#endif
