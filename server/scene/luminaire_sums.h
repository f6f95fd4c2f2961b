/* Sums over the elements of a scene of the light of its luminaires, by which the size of any dimming, and its
 * mean direct light over a group, is known without a vector. Immutable once made. */
#ifndef LAMBERT_SERVER_SCENE_LUMINAIRE_SUMS_H
#define LAMBERT_SERVER_SCENE_LUMINAIRE_SUMS_H

#include "solver/operator/stated/error_law.h"

#include <stdbool.h>

typedef struct scene scene;

/* Luminaire k has the irradiance h_k at dimmer 1, and the colour f_ck. */
typedef struct luminaire_sums {
    size_t k;
    double *power;   /* [C][k]: sum_i A_i rho_ci h_ki f_ck */
    double *squares; /* [C][k][k]: sum_i (A_i rho_ci)^2 h_ki h_li f_ck f_cl; where that is too much work
                        [C][k], l being k */
    bool whole;      /* squares has all pairs */
    double *first;   /* [groups][k]: the mean of h_k over a group, by area */
    size_t bytes;    /* taken of the ledger of the cache that it is set in */
} luminaire_sums;

void luminaire_sums_free(luminaire_sums *sums);

/* *sums: those of a scene with luminaires, made when first needed and kept with its rows; NULL where the
 * ledger has no room for them. False when memory is short. O(C k^2 n), or O(C k n) where that is more than
 * some tenths of a second. Any thread. */
bool scene_luminaire_sums(const scene *s, const luminaire_sums **sums);

/* True where they are made. */
bool scene_has_luminaire_sums(const scene *s);

/* Adds the power that elements send on by dimmers D [k] in channel c, and sum_i (A_i rho_i H0_i)^2 of it, or,
 * without pairs, the most that this can be, sum_kl |s_k| |s_l|. O(k^2). */
void luminaire_sums_size(const luminaire_sums *sums, size_t c, const float *D, double *power,
                         double *squares);

#endif
