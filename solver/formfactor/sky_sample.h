/* The first bounce of a sky by rays alone: an estimate without bias, that shares nothing with one by what
 * pairs or blocks leave of a row; and that of single tiles, by rays towards them. */
#ifndef LAMBERT_FORMFACTOR_SKY_SAMPLE_H
#define LAMBERT_FORMFACTOR_SKY_SAMPLE_H

#include "solver/formfactor/formfactor.h"
#include "solver/scene/mesh.h"

/* As `like`, its tiling and ground, by options->recipe.rays rays from each element and recipe.seed, with
 * options->progress, stage and openings: without these, rays are aimed at those of the mesh (portals.h),
 * as they are for the bounce that is judged. order as for form_factors_make. Unlike another bounce it keeps
 * `ground`. Cost: n rays rays, half of them and a quarter towards openings where an element has any, and 4 m
 * n bytes. Errors: LAM_ERR_ARGUMENT, LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status sky_sample_make(const mesh *m, const uint32_t *order, const sky_bounce *like,
                           const form_factor_options *options, sky_bounce *out, lam_error *error);

/* first [n_tiles][n]: the rows of the first bounce of some tiles, by `rays` rays (a multiple of
 * VISIBILITY_PACKET) from each element, even in the solid angle of the tile: where few of an element's other
 * rays meet a tile, all of these do. The shares of the ground, for the light that it reflects, are those
 * of `sampled`, whose tiling is meant. Cost: n_tiles n rays rays at most, as none leave an element below its
 * horizon. Errors: LAM_ERR_MEMORY. */
lam_status sky_sample_tiles(const mesh *m, const sky_bounce *sampled, size_t rays, uint64_t seed,
                            size_t n_tiles, const size_t *tiles, float *first, lam_error *error);

/* first [count]: the same of single elements and tiles. Cost: count rays rays at most. Errors:
 * LAM_ERR_MEMORY. */
lam_status sky_sample_pairs(const mesh *m, const sky_bounce *sampled, size_t rays, uint64_t seed,
                            size_t count, const size_t *elements, const size_t *tiles, float *first,
                            lam_error *error);

#endif
