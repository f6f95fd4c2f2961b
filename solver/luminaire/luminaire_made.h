/* Luminaires whose light is a formula and not of a file: the point and spot lights of scene files. */
#ifndef LAMBERT_LUMINAIRE_MADE_H
#define LAMBERT_LUMINAIRE_MADE_H

#include "solver/luminaire/luminaire.h"

/* A point that shines alike in all directions, of intensity cd from 0 to 1e15: 4 pi intensity lm. The caller
 * frees *out by luminaire_free. Errors: LAM_ERR_MEMORY. */
lam_status luminaire_of_point(double intensity, luminaire *out, lam_error *error);

/* A point with a cone of light about gamma 0, from full light within inner to none from outer on, rad, 0 <=
 * inner <= outer, 1e-6 <= outer <= pi/2:
 *     I(gamma) = intensity saturate((cos gamma - cos outer) / max(.001, cos inner - cos outer))^2,
 * a table of at most 105 angles whose interpolation is within 1e-4 of its peak. The peak is below the
 * intensity where cos outer is above .999. Source: KHR_lights_punctual. Errors: LAM_ERR_MEMORY. */
lam_status luminaire_of_spot(double intensity, double inner, double outer, luminaire *out, lam_error *error);

#endif
