/* The regions of the planes of a scene that its faces leave open, and those that they cover, by their rims.
 * Private to face_openings.c. */
#ifndef LAMBERT_SCENE_FACET_PLANE_REGIONS_H
#define LAMBERT_SCENE_FACET_PLANE_REGIONS_H

#include "solver/scene/facet/face_edges.h"

typedef struct plane_region {
    size_t first, count; /* in corners, counter-clockwise seen from the tip of normal */
    double area;
    double normal[3], level; /* unit; normal . x of the plane */
    uint32_t plane;          /* regions of one plane whose edges are connected have the same */
} plane_region;

typedef struct plane_regions {
    size_t n_open, n_covered, n_corners;
    plane_region *open, *covered;
    uint32_t *corners; /* places */
    size_t open_capacity, covered_capacity, corner_capacity;
} plane_regions;

/* Open regions as face_openings.h lists them, and the outlines of what is covered, of faces 0 ... n_faces-1.
 * A point no further than slack metres from a plane lies in it. Regions narrower than `narrow` metres are
 * left out. Freed by plane_regions_free. Errors: LAM_ERR_MEMORY. */
lam_status plane_regions_find(const mesh *m, size_t n_faces, const face_edges *e, double slack, double narrow,
                              plane_regions *out, lam_error *error);
void plane_regions_free(plane_regions *r);

#endif
