/* Eight segments at once between points of two triangles or quads, and the kernel of each. Knows no scene. */
#ifndef LAMBERT_FORMFACTOR_EXCHANGE_AFFINE_SEGMENTS_H
#define LAMBERT_FORMFACTOR_EXCHANGE_AFFINE_SEGMENTS_H

#include "solver/formfactor/exchange/polygon.h"

enum { AFFINE_SEGMENTS = 8 };

/* corner + u side[0] + w side[1] + u w twist over the unit square, which a triangle folds along its diagonal.
 * twist is 0 but for quads that are no parallelograms, whose Jacobian is jacobian . (1, u, w) up to a
 * constant. */
typedef struct affine_map {
    double corner[3], side[2][3], twist[3], normal[3], jacobian[3];
    bool folded, twisted;
} affine_map;

/* p is a triangle or a planar quad. */
affine_map affine_map_of(const polygon *p);

/* Both ends of segments. */
typedef struct affine_pair {
    affine_map from, to;
} affine_pair;

/* The segments from (x[0], x[1]) of the one to (x[2], x[3]) of the other map: origin, relative to centre, and
 * direction in single precision; K = cos cos' / r^2 of each, times both Jacobians, 0 behind either polygon. K
 * leaves out the areas, so that only ratios of it count. Returns the bits of those in front of both. */
unsigned affine_segments(const affine_pair *p, const double x[4][AFFINE_SEGMENTS], const double centre[3],
                         float origin[3][AFFINE_SEGMENTS], float direction[3][AFFINE_SEGMENTS],
                         double K[AFFINE_SEGMENTS]);

#endif
