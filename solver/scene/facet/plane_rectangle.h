/* The rectangle around points of a plane. */
#ifndef LAMBERT_SCENE_FACET_PLANE_RECTANGLE_H
#define LAMBERT_SCENE_FACET_PLANE_RECTANGLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The points corner + x edge[0] + y edge[1] with x and y from 0 to 1; the edges are at right angles. */
typedef struct plane_rectangle {
    double corner[3], edge[2][3]; /* metres, in the coordinates of the scene */
} plane_rectangle;

double plane_rectangle_area(const plane_rectangle *r);

/* The rectangle around n points, its first edge along the longest of n_edges pairs of them. False where they
 * lie on a line, or further than flat metres from a plane. */
bool plane_rectangle_around(const double (*points)[3], size_t n, const uint32_t (*edges)[2], size_t n_edges,
                            double flat, plane_rectangle *out);

#endif
