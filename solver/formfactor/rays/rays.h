/* Ray counting: F_ij ~ c_ij / rays, with c_ij the number of cosine-distributed rays of element i whose first
 * hit is j.
 */
#ifndef LAMBERT_FORMFACTOR_RAYS_RAYS_H
#define LAMBERT_FORMFACTOR_RAYS_RAYS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rays/portal_aim.h"
#include "solver/formfactor/rows/row_code.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/formfactor/visibility/visibility.h"

/* The rows of counts c_ij; leaving and absorbed, [n], are the shares of rays that hit nothing or a back face.
 * The caller frees counts with packed_rows_free. Errors: those of row_pool_make. */
lam_status rays_count(const mesh *m, const visibility *v, const uint32_t *order,
                      const form_factor_options *options, packed_rows *counts, double *leaving,
                      double *absorbed, lam_error *error);

/* The context that the rays of all elements share. */
typedef struct ray_context {
    const mesh *m;
    const visibility *v;
    uint64_t seed;
    const sky_bounce *sky;  /* bins the rays that leave; NULL: no sky */
    const portals *portals; /* rays are aimed at these, too; NULL: none */
    portal_aim aim;         /* the groups that the present element aims at */
    size_t n_rays;          /* of the present element by the cosine, where there are portals */
} ray_context;

/* An element's rays that hit no front. */
typedef struct ray_tally {
    double left, squares; /* weights of the rays that left the scene, and of their squares: 1 each without
                             portals (portals.h) */
    size_t count;         /* of these rays */
    size_t lost;          /* rays that hit back faces */
} ray_tally;

static inline void ray_tally_leave(ray_tally *t, double weight) {
    t->left += weight;
    t->squares += weight * weight;
    t->count++;
}

/* Rays that are cast and counted together. */
enum { RAYS_AT_ONCE = SAMPLE_ORDERED };

/* Casts rays first ... last-1 of an element, at most RAYS_AT_ONCE, in the order of element_sampler_order.
 * Writes to met, with room for all of them, the elements whose fronts they hit, ray by ray, and returns how
 * many. The others are added to tally and, where the context has a sky, to its bins sky, [m + 1]. Depends on
 * the element and the seed alone. */
size_t rays_meet(const ray_context *c, const element_sampler *sampler, size_t element, size_t first,
                 size_t last, uint32_t *met, ray_tally *tally, double *sky);

/* Makes a context with portals ready for an element, its sampler and its number of rays by the cosine. */
void rays_aim(ray_context *c, const element_sampler *sampler, size_t element, size_t n_rays);

/* The variance of left / n_rays, at least that of one ray of the mean weight, or, where none left, of weight
 * 1, a sixteenth where rays are aimed at portals. */
double rays_variance(const ray_tally *tally, size_t n_rays, bool aimed);

/* Casts rays, at most RAYS_AT_ONCE, from each of n_elements elements, spread over the order, and ignores
 * their hits: to time them. */
void rays_cast_some(const mesh *m, const visibility *v, const uint32_t *order, size_t n_elements,
                    size_t rays);

#endif
