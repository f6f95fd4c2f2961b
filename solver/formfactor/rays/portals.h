/* Rays towards openings. An element that sees little of the sky through a window finds it with few of its
 * rays; rays towards points of the window find it with nearly all of theirs. Both are weighted by the balance
 * heuristic (Veach and Guibas 1995): a ray that leaves the scene in direction w counts
 *     p(w) / (N p(w) + M q(w)),    p(w) = cos / pi,    q(w): portal_aim.h,
 * with N rays by the cosine and M towards openings. The estimate has no bias, wherever the openings are and
 * whatever stands before them. */
#ifndef LAMBERT_FORMFACTOR_RAYS_PORTALS_H
#define LAMBERT_FORMFACTOR_RAYS_PORTALS_H

#include "solver/formfactor/rays/rays.h"

/* The openings that rays are aimed at: those given, as they are, and of others (openings; NULL: those of the
 * mesh itself, face_openings_find) those with lines through them along which an element on one side gets
 * light of the sky from the other side, as far as some rays show, unless more than a tenth of the light in
 * the space on that side leaves the scene: rays find the sky from there by themselves, and of_open takes such
 * openings too. rays is the number
 * that an element aims. Freed by portals_free. The same for any number of threads. Cost: some hundred rays
 * for each opening. Errors: LAM_ERR_MEMORY. */
lam_status portals_find(const mesh *m, const visibility *v, uint64_t seed, size_t rays,
                        const face_openings *openings, bool of_open, portals *out, lam_error *error);

/* Changes the shares of the groups of the present element by eight rays to each, where there are several.
 * The rays of portals_cast are others, so that they stay without bias. */
void portals_try(ray_context *c, const element_sampler *sampler, size_t element);

/* The weight of a ray that leaves the scene, N p / (N p + M q), for an element with N rays by the cosine. 1
 * where the ray passes no portal. direction has length 1, cosine is that at the element. */
double portals_weight(const portals *p, const portal_aim *aim, size_t n_rays, const double origin[3],
                      const double direction[3], double cosine);

/* Eight rays from points of an element to points of its portals, by points x of the unit cube; direction has
 * length 1. A lane whose point lies behind the element is cast along its normal, and its cosine is 0. */
void portals_rays(const portals *p, const portal_aim *to_groups, const element_sampler *sampler,
                  const double x[4][VISIBILITY_PACKET], ray_packet *rays,
                  double direction[VISIBILITY_PACKET][3], double cosine[VISIBILITY_PACKET]);

/* Casts the rays of the present element of a context (rays_aim) towards its portals; those that leave the
 * scene are added with their weights to tally and, where the context has a sky, to its bins. */
void portals_cast(const ray_context *c, const element_sampler *sampler, size_t element, ray_tally *tally,
                  double *sky);

#endif
