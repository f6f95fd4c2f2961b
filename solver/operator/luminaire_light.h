/* The runtime half of luminaires: names, dimmers and the direct light of each of them, of an open store. */
#ifndef LAMBERT_OPERATOR_LUMINAIRE_LIGHT_H
#define LAMBERT_OPERATOR_LUMINAIRE_LIGHT_H

#include "solver/base/luminaire_shape.h"
#include "store/store.h"

#define LUMINAIRE_NO_GROUP 0xFFFFFFFFu

/* The part of a luminaire that people are shown. */
typedef struct luminaire_shown {
    const char *name, *group; /* group: NULL where it has none */
    double at[3];             /* the middle of its opening, m */
    double x[3], y[3], z[3];  /* its frame: x is C0, y is C90, -z is gamma 0 */
    double dimmer;            /* that its list gives it */
    double lumens;            /* at dimmer 1 */
    double colour[3];         /* factors of the channels, of luminance 1 */
    luminaire_shape shape;    /* of its opening */
    double size[3];           /* of its opening along x, y and z, m */
} luminaire_shown;

/* Loads /luminaires for n elements of C channels, or NULL where the store has none; freed by
 * lam_luminaires_close. Errors: LAM_ERR_FORMAT (another shape, a value that is negative or not finite),
 * LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status luminaires_load(store *s, size_t n, size_t C, lam_luminaires **out, lam_error *error);

/* Luminaires of which the light alone is known: copies irradiance [k][n] at dimmer 1 and their colours,
 * factors [C][k]. Errors: LAM_ERR_MEMORY. */
lam_status luminaires_create(size_t k, size_t n, size_t C, const float *irradiance, const double *factors,
                             lam_luminaires **out, lam_error *error);

/* Texts of it are owned by l. */
luminaire_shown luminaires_shown(const lam_luminaires *l, size_t luminaire);

/* Groups of luminaires, the name of one, and the group of a luminaire, or LUMINAIRE_NO_GROUP. */
size_t luminaires_groups(const lam_luminaires *l);
const char *luminaires_group_name(const lam_luminaires *l, size_t group);
uint32_t luminaires_group_of(const lam_luminaires *l, size_t luminaire);

/* lam_luminaires_irradiance for refined answers, in double: likewise added. */
void luminaires_irradiance_double(const lam_luminaires *l, size_t n_rhs, const double *D, double *H0);

/* Their colours, factors of the irradiance in each channel, [C][k]. */
const double *luminaires_factors(const lam_luminaires *l);

/* The irradiance of every element at dimmer 1, [k][n], without colours. */
const float *luminaires_irradiance(const lam_luminaires *l);

/* Their fluxes at dimmer 1, [k], lm. */
const double *luminaires_lumens(const lam_luminaires *l);

/* The mean squared error of it by the scene's groups, of elements (by area) and of the group's mean, lx^2,
 * [k][n_groups] both; n_groups 0: not known. */
size_t luminaires_error_groups(const lam_luminaires *l);
const double *luminaires_elements_off(const lam_luminaires *l);
const double *luminaires_means_off(const lam_luminaires *l);

#endif
