/* Rays towards openings. An element that sees little of the sky through a window finds it with few of its
 * rays; rays towards points of the window find it with nearly all of theirs. Both are weighted by the balance
 * heuristic (Veach and Guibas 1995): a ray that leaves the scene in direction w counts
 *     p(w) / (N p(w) + sum_k N_k p_k(w)),    p(w) = cos / pi,    p_k(w) = r^2 / (A_k cos_k),
 * with N rays by the cosine and N_k towards the rectangle k, which it passes at the distance r. The estimate
 * has no bias, wherever the rectangles are and whatever stands before them. */
#ifndef LAMBERT_FORMFACTOR_RAYS_PORTALS_H
#define LAMBERT_FORMFACTOR_RAYS_PORTALS_H

#include "solver/formfactor/rays/rays.h"
#include "solver/scene/facet/facet_holes.h"

enum { PORTALS_MOST = 16 };

/* A rectangle in recentred coordinates. */
typedef struct portal {
    double corner[3], edge[2][3], normal[3], area;
} portal;

typedef struct portals {
    size_t n;
    portal portal[PORTALS_MOST];
    size_t rays; /* N_k of each, a multiple of VISIBILITY_PACKET */
} portals;

/* The rectangles through which rays are aimed: those given, and where there are none the holes of the mesh
 * through which light leaves, as far as some rays show. None where more than a tenth of the light leaves the
 * scene, whose rays find the sky by themselves, nor rectangles of more than a twentieth of all area. rays is
 * the number of an element's rays towards all of them together. The same for any number of threads. Cost:
 * some 20,000 rays. Errors: LAM_ERR_ARGUMENT (more than PORTALS_MOST given), LAM_ERR_MEMORY. */
lam_status portals_find(const mesh *m, const visibility *v, uint64_t seed, size_t rays,
                        const plane_rectangle *given, size_t n_given, portals *out, lam_error *error);

/* Bit k is set where rays of an element are aimed at portal k: some of it lies in front of the element. */
unsigned portals_in_front(const portals *p, const mesh *m, const visibility *v, size_t element);

/* The weight of a ray that leaves the scene, N p / (N p + sum_k N_k p_k), for an element with N rays by the
 * cosine. 1 where the ray passes no portal. direction has length 1, cosine is that at the element. */
double portals_weight(const portals *p, unsigned in_front, size_t n_rays, const double origin[3],
                      const double direction[3], double cosine);

/* Casts the rays of an element towards the portals in front of it; those that leave the scene are added with
 * their weights to tally and, where the context has a sky, to its bins. */
void portals_cast(const portals *p, unsigned in_front, const ray_context *c, const element_sampler *sampler,
                  size_t element, size_t n_rays, ray_tally *tally, double *sky);

#endif
