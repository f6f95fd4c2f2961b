/* An answer of three elements of two groups, desk and lamp, in two channels under a sky of two tiles, and
 * what a store states of it: for tests that compare its errors with plain sums. */
#ifndef LAMBERT_TESTS_ANSWER_SCENE_H
#define LAMBERT_TESTS_ANSWER_SCENE_H

#include "solver/operator/stated/answer_error.h"

enum { N = 3, C = 2, G = 2, TILES = 2 };
extern const double answer_area[N];
extern const float answer_rho[C * N];
extern const uint32_t answer_members[N];
extern const error_scene answer_scene;

/* Figures of the groups, as a store states them. */
extern double answer_one[G], answer_many[G], answer_even[G], answer_mean_even[G], answer_squares[G],
    answer_sky_power[C * TILES];
extern uint32_t answer_bin[N];
extern const error_by_group answer_stated;

/* The emission of elements 0 and 2, the direct light of a sky, its radiances, and the reflected light. */
extern const float answer_E[C * N], answer_H0[C * N], answer_L[C * TILES];
extern const double answer_reflected[C * N];

/* P^2 and sum A^2 E^2 of the emission; of the sky P^2, sum (L Q)^2, S, D, and D of irradiance. */
extern const double answer_P2, answer_A2E2, answer_sky_P2, answer_sky_squares, answer_sky_S, answer_sky_D[G],
    answer_white_D[G];

/* P^2 (a^2 / N^2 + b^2 (1 - 1 / N) / N + c^2). */
double answer_law(double P2, double number, double a, double b, double c);

/* An error over the light without it, and where it is more than half of that, over half of it. */
double answer_ratio(double off2, double light2);

/* D / 4 + tiles^2 S + even^2 P^2, the last two over rho^2; and the law of light that is reflected alone. */
double answer_law_over(double D, double tiles, double evenly, double rho2);
double answer_law_of_sent(double tiles, double evenly, double a, double b, double c);

/* The values of a quantity, under the sky where it is lit; and that answer. */
void answer_fill(lam_quantity quantity, bool lit, float values[C * N]);
error_answer answer_of(lam_quantity quantity, const float *values);

#endif
