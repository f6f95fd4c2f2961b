/* The form factor from a point to a polygon whose parts behind convex occluders are cut away. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_SHADOW_CUT_H
#define LAMBERT_FORMFACTOR_SIGHT_SHADOW_CUT_H

#include "solver/formfactor/sight/pair_occluders.h"

/* Coefficients, linear in the point x, of the plane through x and an edge: with y = s e1 + t e2 on the target
 *     plane(y) = -x . none + (one[3] - x . one) s + (two[3] - x . two) t */
typedef struct cone_plane {
    double none[3], one[4], two[4];
} cone_plane;

typedef struct shadow_cone {
    int n;
    cone_plane plane[OCCLUDER_CORNERS];
    double normal[3], level; /* of the occluder */
    double along[2];         /* normal . e1, normal . e2 */
    double low, high;        /* heights of the target above the occluder's plane */
} shadow_cone;

/* A target and its occluders, in coordinates about the target's first corner. */
typedef struct shadow_cut {
    double origin[3], e1[3], e2[3], radius, rounding;
    int n, n_cones;
    double s[POLYGON_CORNERS], t[POLYGON_CORNERS]; /* the target's corners */
    shadow_cone cone[PAIR_OCCLUDERS_MOST];
    int order[PAIR_OCCLUDERS_MOST]; /* of cones: those first that left points nothing to see */
} shadow_cut;

void shadow_cut_init(shadow_cut *c, const occluders *o, const pair_occluders *among, const polygon *target);

/* F from the point x, with unit normal n, to the parts of the target that the occluders of the bits given
 * leave, for a target in front of x and x in front of it; full, unless NULL: to all of it. Negative: there
 * are too many parts. */
double shadow_cut_factor(shadow_cut *c, unsigned bits, const double x[3], const double n[3], double *full);

#endif
