/* Ray counting: how many of an element's rays first meet each other element. */
#ifndef LAMBERT_FORMFACTOR_RAYS_RAYS_H
#define LAMBERT_FORMFACTOR_RAYS_RAYS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rows/row_code.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/formfactor/visibility/visibility.h"

/* counts gets rows of hits; leaving and absorbed, [n], the shares that met nothing or a back face. The caller
 * frees counts with packed_rows_free. */
lam_status rays_count(const mesh *m, const visibility *v, const uint32_t *order,
                      const form_factor_options *options, packed_rows *counts, double *leaving,
                      double *absorbed, lam_error *error);

/* What the rays of every element share. */
typedef struct ray_context {
    const mesh *m;
    const visibility *v;
    uint64_t seed;
    const sky_bounce *sky; /* NULL: nobody asks where what leaves goes */
} ray_context;

/* Where an element's rays went that met no front. */
typedef struct ray_tally {
    size_t left, lost; /* out of the scene, to back faces */
} ray_tally;

/* Casts rays first ... last-1 of an element, first a multiple of VISIBILITY_PACKET: met, with room for all of
 * them, gets the elements whose fronts they meet, in their order, once for each ray; tally and sky, [m + 1]
 * where the context has one, have what does not added. Returns how many met one. Depends on nothing but the
 * element and the seed. */
size_t rays_meet(const ray_context *c, const element_sampler *sampler, size_t element, size_t first,
                 size_t last, uint32_t *met, ray_tally *tally, double *sky);

/* Casts rays from n_elements elements, spread over the order, and drops what they meet: for their time. */
void rays_cast_some(const mesh *m, const visibility *v, const uint32_t *order, size_t n_elements,
                    size_t rays);

#endif
