/* Errors of the irradiance of a group of a scene from those of its radiosity, which stores state. An element
 * of reflectance rho is off by rho times as much in B as in H, and light that is the same in all channels by
 * as much of H in each, so that with means over elements and channels
 *     mean e_B^2 = mean rho^2 mean e_H^2,    and of the means of a group    e_B^2 = (mean rho)^2 e_H^2.
 * A group that reflects nothing has no error of B, and what stores state of it is that of H. */
#ifndef LAMBERT_OPERATOR_STATED_REFLECTING_H
#define LAMBERT_OPERATOR_STATED_REFLECTING_H

#include "lambert/lambert.h"
#include "store/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct reflecting {
    double square;      /* mean rho^2; 1 where nothing is reflected */
    double mean_square; /* mean of the squared mean rho of each channel; likewise */
    bool black;         /* nothing is reflected */
} reflecting;

/* *out [n_groups] of groups [n] by element; freed with free(). Cost: O(C n). Errors: LAM_ERR_MEMORY. */
lam_status reflecting_make(size_t n, size_t n_channels, const double *area, const float *reflectance,
                           size_t n_groups, const uint32_t *group, reflecting **out, lam_error *error);

/* Squared errors of a quantity of which those of B are given. */
static inline double reflecting_of_elements(const reflecting *r, lam_quantity quantity, double square) {
    return quantity == LAM_IRRADIANCE ? square / r->square : r->black ? 0 : square;
}

static inline double reflecting_of_mean(const reflecting *r, lam_quantity quantity, double square) {
    return quantity == LAM_IRRADIANCE ? square / r->mean_square : r->black ? 0 : square;
}

#endif
