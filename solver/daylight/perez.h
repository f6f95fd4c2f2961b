/* The all-weather sky of Perez, Seals and Michalsky: how bright every direction is, from two measured
 * numbers. Knows neither tiles nor files. */
#ifndef LAMBERT_DAYLIGHT_PEREZ_H
#define LAMBERT_DAYLIGHT_PEREZ_H

#include "solver/daylight/sun.h"

#define PEREZ_WATER 2. /* cm: what is taken where no dew point is known */

typedef struct perez_sky {
    double zenith;        /* of the sun, radians, at most pi/2 */
    double clearness;     /* epsilon, from 1 (overcast); infinite without diffuse light */
    double brightness;    /* Delta, held to .01 ... .6, where the model was made */
    int bin;              /* of clearness, 0 to 7 */
    double a, b, c, d, e; /* of the relative luminance; b <= 0 */
} perez_sky;

/* The sky under a sun with this direct (facing it) and diffuse horizontal irradiance, W/m2. A sun below the
 * horizon is taken to stand at it: twilight is its azimuth's. The air mass is Kasten's (1966), the solar
 * constant 1367 W/m2 over the square of the distance.
 * Source: Perez, Seals, Michalsky 1993, Solar Energy 50(3):235-245, eq. 2 to 8 and table 1. */
perez_sky perez_sky_of(const sun_position *sun, double direct, double diffuse);

/* Relative luminance is the product of the gradation from horizon to zenith, 1 + a exp(b / cos zeta), and the
 * scattering around the sun, 1 + c exp(d gamma) + e cos^2 gamma (eq. 1); neither is ever below 0. */
double perez_gradation(const perez_sky *p, double cos_zeta);
double perez_scattering(const perez_sky *p, double cos_gamma);

/* Precipitable water, cm, from the dew point in degrees Celsius; PEREZ_WATER for NAN. */
double perez_water(double dew_point);

/* Lumens in a watt of diffuse and of direct light, never below 0. Source: Perez, Ineichen, Seals, Michalsky,
 * Stewart 1990, Solar Energy 44(5):271-289, eq. 3, 7, 8 and table 4. */
double perez_diffuse_efficacy(const perez_sky *p, double water);
double perez_direct_efficacy(const perez_sky *p, double water);

#endif
