/* The unoccluded exchange area of two planar convex polygons by quadrature, without sampling noise:
 *     A_a F_ab = integral integral cos cos' / (pi r^2) = 1/(4 pi) sum over edges of cos(d, d') integral
 * integral ln r^2 the double area integral where they are far apart, the double contour integral (Sparrow
 * 1963) where they are near. */
#ifndef LAMBERT_FORMFACTOR_EXCHANGE_PAIR_FACTOR_H
#define LAMBERT_FORMFACTOR_EXCHANGE_PAIR_FACTOR_H

#include "solver/formfactor/exchange/pair_rules.h"
#include "solver/formfactor/exchange/polygon.h"

/* q: a product rule of nodes x nodes points on each polygon keeps the relative tolerance where the centres
 * are 1 + q radii of the larger polygon apart. */
double pair_factor_distance(int nodes, double tolerance);

/* A_a F_ab = A_b F_ba, m^2, without occlusion: only the part of each polygon in front of the other's plane
 * counts. To the relative tolerance, at best 1e-8 (and 1e-10 of A_a), also where they touch or cross one
 * another's planes. Cost: about 0.1 us far, 1 us near, 100 us for touching edges that are not parallel. */
double pair_factor_exchange(const pair_factor_rules *rules, const polygon *a, const polygon *b,
                            double tolerance);

#endif
