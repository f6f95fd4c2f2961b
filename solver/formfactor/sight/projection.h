/* The visible share of a partly hidden pair without visibility segments: from points of one element the other
 * is cut by the cones of its few occluders, and its visible parts are integrated in closed form,
 *     g V = integral over a of F(x) dx,   F(x) = sum over the parts' edges of angle x cos / (2 pi)
 * (Lambert 1760; Walton 2002 projects occluders alike). Over a the quadrature is adaptive. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_PROJECTION_H
#define LAMBERT_FORMFACTOR_SIGHT_PROJECTION_H

#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/formfactor/sight/pair_occluders.h"

typedef struct projection {
    const pair_factor_rules *rules;
    const occluders *occluders;
    uint64_t seed; /* of the cubature: another seed has other points */
} projection;

/* A partly hidden pair: the parts of elements i and j in front of each other's planes, or parts of these that
 * hold all that sees the other element. */
typedef struct projected_pair {
    uint32_t i, j;
    const polygon *a, *b;
    const pair_occluders *among; /* up to PAIR_OCCLUDERS_MOST */
    double full;                 /* of a cut pair: the unoccluded exchange area of whole elements; else 0 */
} projected_pair;

/* V, from 0 to 1, with an error of about tolerance; exactly 0 or 1 where every point says so. Negative: there
 * are too many parts. Adds to *work the points, each times 1 + the number of occluders that may block there.
 */
double projection_share(const projection *p, const projected_pair *pair, double tolerance, double *work);

/* Lambert's formula with the occluders cut out: F to b from a point x with normal n; b must lie in front of
 * x, and x in front of b. full, unless NULL: without occluders. */
double projection_point_factor(const projection *p, const projected_pair *pair, const double x[3],
                               const double n[3], double *full);

#endif
