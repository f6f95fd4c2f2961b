/* The all-weather sky of Perez et al. 1993: the relative luminance of every direction from direct and diffuse
 * irradiance. Knows neither tiles nor files. */
#ifndef LAMBERT_DAYLIGHT_PEREZ_H
#define LAMBERT_DAYLIGHT_PEREZ_H

#include "solver/daylight/sun.h"

#define PEREZ_WATER 2. /* cm of precipitable water, assumed where the dew point is unknown */

#define PEREZ_SOLAR 1367. /* W/m2 normal to the sun outside of the atmosphere, at one astronomical unit */

/* Relative optical air mass by Kasten 1966, of an angle from the zenith in radians. */
double perez_air_mass(double zenith);

typedef struct perez_sky {
    double zenith;        /* of the sun, radians, at most pi/2 */
    double clearness;     /* epsilon, from 1 (overcast); infinite without diffuse light */
    double brightness;    /* Delta, held to .01 ... .6, where the model was made */
    int bin;              /* of clearness, 0 to 7 */
    double a, b, c, d, e; /* of the relative luminance; b <= 0 */
} perez_sky;

/* The sky for a direct normal and a diffuse horizontal irradiance, W/m2. A sun below the horizon is moved to
 * the horizon at its azimuth. The air mass is by Kasten 1966, the solar constant 1367 W/m2 over the squared
 * distance. Source: Perez, Seals, Michalsky 1993, Solar Energy 50(3):235-245, eq. 2 to 8 and table 1. */
perez_sky perez_sky_of(const sun_position *sun, double direct, double diffuse);

/* The two factors of the relative luminance (eq. 1), both at least 0: the gradation 1 + a exp(b / cos zeta)
 * with the zenith angle zeta, and the scattering 1 + c exp(d gamma) + e cos^2 gamma with the angle gamma to
 * the sun. */
double perez_gradation(const perez_sky *p, double cos_zeta);
double perez_scattering(const perez_sky *p, double cos_gamma);

/* Precipitable water, cm, from the dew point in degrees Celsius; PEREZ_WATER for NAN. */
double perez_water(double dew_point);

/* Luminous efficacy, lm/W, of diffuse and of direct light, at least 0. Source: Perez, Ineichen, Seals,
 * Michalsky, Stewart 1990, Solar Energy 44(5):271-289, eq. 3, 7, 8 and table 4. */
double perez_diffuse_efficacy(const perez_sky *p, double water);
double perez_direct_efficacy(const perez_sky *p, double water);

#endif
