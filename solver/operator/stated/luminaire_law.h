/* The errors of the direct light of luminaires, of which a store states the mean squares by group
 * (/luminaires/elements_off, means_off). Errors of two luminaires are independent, so that under dimmers d
 * and colours f the direct light is off by D_g = sum_c rho_gc^2 sum_k (d_kc f_kc)^2 off_kg in squares, of
 * irradiance without rho. The part of them that is reflected once more is left out: it has both signs. */
#ifndef LAMBERT_OPERATOR_STATED_LUMINAIRE_LAW_H
#define LAMBERT_OPERATOR_STATED_LUMINAIRE_LAW_H

#include "lambert/lambert.h"

#include <stdbool.h>

/* The luminaires of an answer; views. Zeroed: there are none. */
typedef struct lit_luminaires {
    size_t k;
    const float *dimmers;                   /* [C][k] */
    const double *factors;                  /* [C][k], colours */
    const double *elements_off, *means_off; /* [k][n_groups] */
    const double *lumens;                   /* [k], at dimmer 1 */
    double power2; /* sum over channels of (sum A rho H0)^2 of their direct light; set by the caller */
} lit_luminaires;

/* The luminaires of a store under dimmers [C][k]; NULL: none. Both must outlive it. */
lit_luminaires lit_luminaires_of(const lam_luminaires *luminaires, const float *dimmers);

/* The effective number of luminaires that shine, (sum P)^2 / sum P^2 of their fluxes, channels added up; 0:
 * none. */
double lit_luminaires_number(const lit_luminaires *lit, size_t n_channels);

/* True where the store states their errors for this number of groups. */
bool luminaires_know_errors(const lam_luminaires *luminaires, size_t n_groups);

/* D of a group by off [k][n_groups] and the mean reflectances [C][n_groups] of groups; NULL: 1. O(C k). */
double luminaire_law(const lit_luminaires *lit, const double *off, size_t n_channels, size_t n_groups,
                     size_t group, const double *reflectance);

#endif
