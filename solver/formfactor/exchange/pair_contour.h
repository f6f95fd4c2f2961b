/* The unoccluded exchange area of two near polygons by the double contour integral (Sparrow 1963),
 *     A_a F_ab = 1/(4 pi) sum over edges of cos(d, d') integral integral ln r^2 ds dt.
 * Two edges whose lines are h apart and cross at the angle phi, s and t measured from their nearest points,
 * have integral integral ln r^2 = 1/2 sum over the four ends of +-s P(s), +-t P(t) - L L' + h^2 integral
 * integral 1/r^2 by the divergence of (s, t) ln r^2. P, the integral over one edge from an end of the other,
 * has a closed form, and edges that meet in a corner have h = 0. With s = (h / sin phi) sinh u and t likewise
 * the rest is h^2 integral integral 1/r^2 = h^2 / sin phi integral theta(u) du, where theta is the angle that
 * one edge subtends from a point of the other. */
#ifndef LAMBERT_FORMFACTOR_EXCHANGE_PAIR_CONTOUR_H
#define LAMBERT_FORMFACTOR_EXCHANGE_PAIR_CONTOUR_H

#include "solver/formfactor/exchange/pair_rules.h"
#include "solver/formfactor/exchange/polygon.h"

/* A_a F_ab, m^2, of convex polygons that lie in front of each other; distance: that of their centres. To the
 * relative tolerance, at best 1e-8. Cost: about .5 us. */
double pair_contour(const pair_factor_rules *rules, const polygon *a, const polygon *b, double distance,
                    double tolerance);

#endif
