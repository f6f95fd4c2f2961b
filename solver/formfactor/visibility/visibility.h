/* What a ray hits: the only room with Embree in it. Immutable once made, so any number of threads may ask. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_VISIBILITY_H
#define LAMBERT_FORMFACTOR_VISIBILITY_VISIBILITY_H

#include "solver/scene/mesh.h"

typedef struct visibility visibility;

#define VISIBILITY_NOTHING 0xFFFFFFFFu
#define VISIBILITY_PACKET 8

/* Eight rays, recentred coordinates (visibility_recentre), one array a component as vector units like it. */
typedef struct ray_packet {
    float origin[3][VISIBILITY_PACKET];
    float direction[3][VISIBILITY_PACKET];
} ray_packet;

/* What each ray of a packet met: the element whose front (or, with back set, whose back) it hit, or
 * VISIBILITY_NOTHING; the distance along the direction, whose length is the unit. */
typedef struct hit_packet {
    uint32_t element[VISIBILITY_PACKET];
    bool back[VISIBILITY_PACKET];
    float distance[VISIBILITY_PACKET];
} hit_packet;

/* Builds the acceleration structure over a mesh, which must outlive it, and not over its elements but over
 * the facets that they lie in (solver/scene/facet/facets.h): a room has few of those however finely it is
 * divided. Errors: LAM_ERR_MEMORY, _INTERNAL. */
lam_status visibility_create(const mesh *m, visibility **out, lam_error *error);

/* The same over the elements one by one: what the other is measured by. */
lam_status visibility_create_of_elements(const mesh *m, visibility **out, lam_error *error);
void visibility_destroy(visibility *v);

/* A point of the scene in the recentred single precision that rays are given in. */
void visibility_recentre(const visibility *v, const double point[3], float recentred[3]);

/* The same for a packet of points. */
void visibility_recentre_packet(const visibility *v, const double points[3][VISIBILITY_PACKET],
                                float recentred[3][VISIBILITY_PACKET]);

/* How far single precision may move a point of the scene, metres. */
double visibility_rounding(const visibility *v);

/* CULL_BACK looks through back faces instead of reporting them. TOGETHER: the rays of a packet start in one
 * place and go almost one way, as those of an image do; they meet the same, twice as fast (and two thirds as
 * fast where it is not so). */
enum { VISIBILITY_CULL_BACK = 1, VISIBILITY_TOGETHER = 2 };

/* Casts the first n_rays rays of a packet. self[i] is the element a ray leaves (itself and, if two-sided, its
 * back are never hit), or VISIBILITY_NOTHING. how: VISIBILITY_CULL_BACK | VISIBILITY_TOGETHER, either or 0.
 */
void visibility_cast(const visibility *v, const ray_packet *rays, size_t n_rays, const uint32_t *self,
                     unsigned how, hit_packet *hits);

/* Which of the first n_segments segments meet something on their way: bit i for segment i, from rays->origin
 * to origin + direction, points of the elements from[i] and to[i]. Neither those nor faces in the same place
 * count. */
unsigned visibility_blocked(const visibility *v, const ray_packet *segments, size_t n_segments,
                            const uint32_t *from, const uint32_t *to);

/* How fast Embree alone is: what visibility_cast is measured by. Casts packets that are in memory already, on
 * the hierarchy of v, by all threads, without a filter and without a look at what was met; packet p leaves
 * element self[p], above which its rays begin by more than rounding. own, unless NULL, gets how many rays met
 * their own facet all the same, counted afterwards. Errors: LAM_ERR_MEMORY. */
lam_status visibility_bare_seconds(const visibility *v, const ray_packet *packets, const uint32_t *self,
                                   size_t n_packets, double *seconds, size_t *own, lam_error *error);

#endif
