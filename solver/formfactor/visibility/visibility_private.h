/* The inside of visibility, private to visibility*.c. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_VISIBILITY_PRIVATE_H
#define LAMBERT_FORMFACTOR_VISIBILITY_VISIBILITY_PRIVATE_H

#include "solver/formfactor/visibility/embree.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/facet/facet_grid.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Triangles and quads are two Embree geometries; primitives maps (geometry, primitive) to facets and
 * elements. */
enum { TRIANGLES, QUADS, N_GEOMETRIES };

/* element: the only element of its facet, else MESH_NO_VERTEX: then the piece's grid finds the element. The
 * facet's normal stands beside them, so that a hit reads one place. */
typedef struct primitive {
    float normal[3];
    uint32_t piece, facet, element;
} primitive;

struct visibility {
    RTCDevice device;
    RTCScene scene;
    const mesh *mesh;
    size_t n_fronts; /* elements in the scene: n, or n/2 when two-sided */
    facets facets;   /* the primitives of the acceleration structure */
    facet_grids grids;
    primitive *all; /* [n_pieces]: triangles, then quads */
    primitive *primitives[N_GEOMETRIES];
    double centre[3];
    float rounding; /* see visibility_rounding */
    float *rise;    /* [facets], see visibility_rise; NULL: 0 everywhere */
};

/* Sets rise. Errors: LAM_ERR_MEMORY. */
lam_status visibility_find_contacts(visibility *v, lam_error *error);

static inline float rise_of(const visibility *v, uint32_t facet) {
    return v->rise != NULL ? v->rise[facet] : 0;
}

/* The component of a direction along a facet's normal: negative where the ray hits the front. */
static inline float along_normal(const visibility *v, uint32_t facet, float x, float y, float z) {
    const float *normal = v->facets.normal[facet];
    return normal[0] * x + normal[1] * y + normal[2] * z;
}

static inline uint32_t facet_of(const visibility *v, unsigned geometry, unsigned id) {
    return v->primitives[geometry][id].facet;
}

/* The places of the arrays in Embree's packets, in units of the width: the same for packets of any width. */
enum {
    RAY_DIRECTION = offsetof(struct RTCRay8, dir_x) / (8 * sizeof(float)),
    RAY_DISTANCE = offsetof(struct RTCRay8, tfar) / (8 * sizeof(float)),
    RAY_ID = offsetof(struct RTCRay8, id) / (8 * sizeof(unsigned)),
    HIT_PRIMITIVE = offsetof(struct RTCHit8, primID) / (8 * sizeof(unsigned)),
    HIT_GEOMETRY = offsetof(struct RTCHit8, geomID) / (8 * sizeof(unsigned)),
};

/* The cosine of the angle between the normals of two facets. */
static inline float cosine_between(const visibility *v, uint32_t one, uint32_t other) {
    const float *n = v->facets.normal[one], *m = v->facets.normal[other];
    return n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
}

/* True for a hit in the ray's own plane at its origin: either the element's other side, modelled as a face of
 * its own, or the bottom of an object that stands on the element and occludes the ray by its other faces
 * anyway. Either may rise above the element. */
static inline bool in_own_plane(const visibility *v, uint32_t facet, uint32_t own, float travelled) {
    if (travelled <= v->rounding)
        return fabsf(cosine_between(v, own, facet)) > 1 - (float)plane_same_direction;
    return rise_of(v, own) > 0 && travelled <= v->rounding + rise_of(v, own) &&
           cosine_between(v, own, facet) < (float)-plane_parallel;
}

static inline void packet_set(struct RTCRayHit8 *ray, const ray_packet *rays) {
    memcpy(ray->ray.org_x, rays->origin[0], sizeof rays->origin[0]);
    memcpy(ray->ray.org_y, rays->origin[1], sizeof rays->origin[1]);
    memcpy(ray->ray.org_z, rays->origin[2], sizeof rays->origin[2]);
    memcpy(ray->ray.dir_x, rays->direction[0], sizeof rays->direction[0]);
    memcpy(ray->ray.dir_y, rays->direction[1], sizeof rays->direction[1]);
    memcpy(ray->ray.dir_z, rays->direction[2], sizeof rays->direction[2]);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        ray->ray.tnear[i] = 0;
        ray->ray.tfar[i] = INFINITY;
        ray->ray.time[i] = 0;
        ray->ray.mask[i] = 0xFFFFFFFFu;
        ray->ray.flags[i] = 0;
        ray->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        ray->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
}

#endif
