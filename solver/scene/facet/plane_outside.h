/* The parts of its convex hull that a polygon leaves. Private to plane_regions.c. */
#ifndef LAMBERT_SCENE_FACET_PLANE_OUTSIDE_H
#define LAMBERT_SCENE_FACET_PLANE_OUTSIDE_H

#include "store/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Polygons, each between a part of an outline and an edge of its hull; arrays are used again. Freed by
 * plane_outside_free. */
typedef struct plane_outside {
    size_t n;
    size_t *first;    /* [n + 1] */
    uint32_t *points; /* [first[n]] */
    size_t first_capacity, point_capacity, hull_capacity, sorted_capacity, is_capacity;
    struct placed *sorted, *hull; /* scratch */
    bool *is_corner;
} plane_outside;

/* ring [count]: the points of an outline, clockwise around the polygon. A point no further than slack from an
 * edge of the hull ends a polygon. Polygons without area and those that turn the other way are left out.
 * Cost: O(count log count). Errors: LAM_ERR_MEMORY. */
lam_status plane_outside_find(const double (*points)[2], size_t count, const uint32_t *ring, double slack,
                              plane_outside *out, lam_error *error);
void plane_outside_free(plane_outside *o);

#endif
