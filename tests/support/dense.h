/* Dense, slow and obvious arithmetic in double, and random factors and orders to use it on. */
#ifndef LAMBERT_TESTS_DENSE_H
#define LAMBERT_TESTS_DENSE_H

#include "support/suite.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void *test_allocate(size_t count, size_t size);

/* Random numbers of [0, 1), by a seed; freed with free(). */
float *test_random_positive(size_t count, uint64_t seed);

/* X := X^-1, [n][n], by Gauss-Jordan with row pivots. */
void invert(size_t n, double *X);

double rho_or_one(float rho);

/* P = rho' F M with M = (I - R F)^-1: row i of F M is the irradiance, whatever rho_i is. */
void bounced_light(size_t n, const double *F, const float *rho, double *P);

/* Form factors G_ij / A_i of rank k with uneven areas and row sums up to .95, as U V^T, both rounded to
 * single precision; every reflectance in (.05, .85), one element in six has none. */
void random_factors(size_t n, size_t k, float *U, float *V, uint64_t *state);

/* [C][n] in (.05, .85); one element in six has none. */
float *random_reflectance(size_t n, size_t n_channels, uint64_t *state);

/* Rows (and columns, when square) of x [n][columns] into position order; the caller frees. */
float *in_positions(const uint32_t *order, size_t n, size_t columns, bool square, const float *x);

uint32_t *random_order(size_t n, uint64_t *state);

#endif
