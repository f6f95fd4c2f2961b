/* Ray casting and visibility segments over a mesh: this and its parts alone know Embree. Immutable once
 * created, so that any number of threads may cast. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_VISIBILITY_H
#define LAMBERT_FORMFACTOR_VISIBILITY_VISIBILITY_H

#include "solver/scene/facet/facets.h"

typedef struct visibility visibility;

#define VISIBILITY_NOTHING 0xFFFFFFFFu
#define VISIBILITY_PACKET 8

/* Eight rays in recentred coordinates (visibility_recentre), one array for each component. */
typedef struct ray_packet {
    float origin[3][VISIBILITY_PACKET];
    float direction[3][VISIBILITY_PACKET];
} ray_packet;

/* The first hit of each ray of a packet: the element whose front (or, with back set, whose back) it hit, or
 * VISIBILITY_NOTHING; the distance in units of the direction's length. */
typedef struct hit_packet {
    uint32_t element[VISIBILITY_PACKET];
    bool back[VISIBILITY_PACKET];
    float distance[VISIBILITY_PACKET];
} hit_packet;

/* Builds the acceleration structure over a mesh, which must outlive it. Its primitives are facets, plane
 * regions of many elements (solver/scene/facet/facets.h): a room has few of those at any subdivision. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status visibility_create(const mesh *m, visibility **out, lam_error *error);

/* The same with every element as a primitive: the reference that tests compare facets with. */
lam_status visibility_create_of_elements(const mesh *m, visibility **out, lam_error *error);
void visibility_destroy(visibility *v);

/* A point of the scene relative to the scene's centre, in single precision. */
void visibility_recentre(const visibility *v, const double point[3], float recentred[3]);

/* The scene's centre, [3]. */
const double *visibility_centre(const visibility *v);

/* The primitives. */
const facets *visibility_facets(const visibility *v);

/* The distance, in metres, by which single precision may move a point of the scene. */
double visibility_rounding(const visibility *v);

/* The height, in metres, by which faces of the plane of an element that look at it rise above it, as their
 * coordinates are rounded: the back of a sheet, the bottom of a box on a floor. They block nothing that the
 * element sees, and its rays begin above them. 0 where that is below a quarter of visibility_rounding, as
 * nearly everywhere. */
double visibility_rise(const visibility *v, size_t element);

/* CULL_BACK ignores back faces instead of reporting them. TOGETHER declares a coherent packet (near
 * origins, similar directions): the hits are the same, twice as fast (an incoherent packet is cast at two
 * thirds of the speed). */
enum { VISIBILITY_CULL_BACK = 1, VISIBILITY_TOGETHER = 2 };

/* Casts the first n_rays rays of a packet. self[i] is the element that a ray leaves, which it never hits
 * (nor, if two-sided, its back), or VISIBILITY_NOTHING. how: VISIBILITY_CULL_BACK | VISIBILITY_TOGETHER,
 * either or 0. */
void visibility_cast(const visibility *v, const ray_packet *rays, size_t n_rays, const uint32_t *self,
                     unsigned how, hit_packet *hits);

/* visibility_cast with how = 0 for rays that start above the plane of their element by 2 visibility_rounding
 * and visibility_rise, as walks make them, n_rays in packets: facet[i] is the facet of self[i]
 * (visibility_facets), or both are VISIBILITY_NOTHING. Many together are faster than a packet alone. */
void visibility_cast_lifted(const visibility *v, const ray_packet *rays, size_t n_rays, const uint32_t *self,
                            const uint32_t *facet, hit_packet *hits);

/* Bit i of the result is set where segment i < n_segments is blocked, from its origin to origin + direction,
 * points of the elements from[i] and to[i]. Neither these two nor faces in their planes block it. */
unsigned visibility_blocked(const visibility *v, const ray_packet *segments, size_t n_segments,
                            const uint32_t *from, const uint32_t *to);

/* The same for segments that touch no face at their ends: everything between them blocks. They are all cast
 * as a coherent packet (VISIBILITY_TOGETHER). */
unsigned visibility_between(const visibility *v, const ray_packet *segments, size_t n_segments);

/* The speed of Embree alone, as a measure for visibility_cast: casts packets in memory, by all threads,
 * without a filter and without reading the hits. Packet p leaves element self[p]; its rays start above it by
 * more than rounding; with self NULL they are cast from where they are. own, unless NULL, is set to the
 * number of rays that hit their own facet nevertheless, by a second, untimed cast. Errors: LAM_ERR_MEMORY. */
lam_status visibility_bare_seconds(const visibility *v, const ray_packet *packets, const uint32_t *self,
                                   size_t n_packets, double *seconds, size_t *own, lam_error *error);

#endif
