/* Holes of a surface: rectangles around the plane loops of edges that belong to one piece of a facet alone.
 * A loop may be a window, the open side of a box or the rim of a table: rays have to tell these apart. */
#ifndef LAMBERT_SCENE_FACET_FACET_HOLES_H
#define LAMBERT_SCENE_FACET_FACET_HOLES_H

#include "solver/scene/facet/facets.h"

/* The points corner + x edge[0] + y edge[1] with x and y from 0 to 1; the edges are at right angles. */
typedef struct plane_rectangle {
    double corner[3], edge[2][3]; /* metres, in the coordinates of the scene */
} plane_rectangle;

double plane_rectangle_area(const plane_rectangle *r);

/* The rectangle around n points, its first edge along the longest of n_edges pairs of them. False where they
 * lie on a line, or further than flat metres from a plane. */
bool plane_rectangle_around(const double (*points)[3], size_t n, const uint32_t (*edges)[2], size_t n_edges,
                            double flat, plane_rectangle *out);

/* The rectangles around all plane loops, the largest first, *out freed with free(). Edges are one where
 * their ends are at the same points; loops that share a point are one. Loops narrower than flat metres are
 * left out, among them those of T-vertices. Cost: O(p log p) for p pieces. Errors: LAM_ERR_MEMORY. */
lam_status facet_holes(const mesh *m, const facets *f, double flat, plane_rectangle **out, size_t *n,
                       lam_error *error);

#endif
