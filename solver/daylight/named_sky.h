/* Skies by name, and those of a direct and a diffuse irradiance. Knows neither files nor scenes. */
#ifndef LAMBERT_DAYLIGHT_NAMED_SKY_H
#define LAMBERT_DAYLIGHT_NAMED_SKY_H

#include "solver/daylight/year.h"

/* The light of each, of which the sun is apart:
 *   even       one luminance
 *   overcast   the CIE overcast sky: (1 + 2 sin altitude) / 3 of the zenith's (Moon and Spencer 1942)
 *   clear      the CIE clear sky, low turbidity, type 12 of CIE S 011 (ISO 15469): (1 - exp(-.32 / cos zeta))
 *              (1 + 10 (exp(-3 gamma) - exp(-3 pi / 2)) + .45 cos^2 gamma). Of the normal irradiance outside
 * of the atmosphere .7 to the power of m^.678 is left after an air mass m (Meinel and Meinel 1976), and the
 * sky has a tenth of that on a horizontal plane turbidity  of Linke, for an air mass of 2: direct and diffuse
 * light at sea level by the European Solar Radiation Atlas (Rigollier, Bauer and Wald 2000, Solar Energy
 * 68(1):33-48), made for 2 to 7, with the optical thickness of Kasten 1996; their distribution by Perez et
 * al. 1993 given      direct and diffuse light as stated, by Perez et al. 1993 */
typedef enum sky_model { SKY_EVEN, SKY_OVERCAST, SKY_CLEAR, SKY_TURBID, SKY_GIVEN } sky_model;

#define SKY_LUX_OUTSIDE 10000. /* of even and overcast, unless it is stated */

typedef struct named_sky {
    sky_model model;
    double turbidity;       /* 1 to 20 */
    double direct, diffuse; /* of SKY_GIVEN: W/m2, normal to the sun and on a horizontal plane */
    double dew_point;       /* degrees Celsius; NAN: unknown */
    double lux_outside;     /* illuminance of a horizontal plane by sky and sun; 0: the model's own */
    bool photometric;       /* cd/m2 and lx also without lux_outside */
} named_sky;

/* True for a text that may be a name: it is a word, or begins with a word and a colon. */
bool named_sky_is(const char *text);

/* Reads even, overcast, clear or turbidity:T. Errors: LAM_ERR_ARGUMENT, whose message begins with `what`. */
lam_status named_sky_parse(const char *what, const char *text, named_sky *out, lam_error *error);

/* True where the light depends on the position of the sun. */
bool named_sky_needs_sun(const named_sky *k);

/* True where the result is in lx and cd/m2. */
bool named_sky_is_photometric(const named_sky *k);

/* True where the sky has no light: no diffuse light, and no sun above the horizon. `at` is not read where the
 * sky needs no sun. */
bool named_sky_is_dark(const named_sky *k, const sun_position *at);

/* Irradiance of a horizontal plane by the sky and by the sun, W/m2 or lx; and of a sky whose distribution is
 * that of Perez, its clearness (infinite without diffuse light) and its brightness: NAN of others. */
typedef struct sky_horizontal {
    double diffuse, direct;
    double clearness, brightness;
} sky_horizontal;

/* Sets L [n_tiles], W/(m2 sr) or cd/m2, and the sun, which is in its tile too where sun_in_tiles says so.
 * `at` is not read where the sky needs no sun. Errors: LAM_ERR_ARGUMENT where the sky is dark, as its sun is
 * below the horizon. */
lam_status named_sky_make(const named_sky *k, const sun_position *at, const sky_tiling *s, bool sun_in_tiles,
                          double *L, year_sun *sun, sky_horizontal *horizontal, lam_error *error);

#endif
