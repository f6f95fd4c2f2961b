/* A planar convex polygon in double: an element, or the part of it in front of another one's plane. */
#ifndef LAMBERT_FORMFACTOR_EXCHANGE_POLYGON_H
#define LAMBERT_FORMFACTOR_EXCHANGE_POLYGON_H

#include "solver/scene/mesh.h"

/* A quad cut by a plane has at most five corners; one more for the cut of a cut. */
enum { POLYGON_CORNERS = 6 };

typedef struct polygon {
    int n;                             /* corners; below 3 it is empty */
    double corner[POLYGON_CORNERS][3]; /* counter-clockwise seen from the front */
    double normal[3];                  /* unit, towards the front */
    double centre[3], radius;          /* of a sphere about all corners */
    bool affine;                       /* a triangle or a parallelogram */
} polygon;

/* Sets normal, centre, radius and affine from the corners, which must span an area. */
void polygon_measure(polygon *p);

/* Sets centre, radius and affine from the corners. */
void polygon_set_extent(polygon *p);

void polygon_of_element(const mesh *m, size_t element, polygon *out);

/* The part of p in front of the plane of other; empty where no corner is in front by more than rounding, and
 * where both lie in one plane (plane_is_shared): then either is empty as seen from the other. */
void polygon_in_front(const polygon *p, const polygon *other, polygon *out);

double polygon_area(const polygon *p);

/* Cuts a triangle in the middle of its longest side, a quad in the middle of its longer pair of sides. */
void polygon_halve(const polygon *p, polygon halves[2]);

/* The point of a triangle or a quad at (u, w) in the unit square; returns the Jacobian of the map there. */
double polygon_point(const polygon *p, double u, double w, double point[3]);

#endif
