/* The radiance of every tile of a sky for every row of weather, by the sky of Perez et al. 1993. */
#ifndef LAMBERT_DAYLIGHT_YEAR_H
#define LAMBERT_DAYLIGHT_YEAR_H

#include "solver/base/progress.h"
#include "solver/daylight/perez.h"
#include "solver/daylight/sky_tiles.h"
#include "solver/daylight/weather.h"

/* Sets L [n_tiles] to the sky p without its sun: the mean luminance of each tile over directions about 3
 * degrees apart, weighted by solid angle, scaled so that sum L cosine = diffuse. Where the model gives no
 * light the sky is uniform. Cost: O(n_tiles), at least some 2000 directions. */
void year_add_sky(const sky_tiling *s, const perez_sky *p, const sun_position *sun, double diffuse,
                  double *L);

/* The tile in the direction (east, north, up) of a sun above the horizon. */
size_t year_sun_tile(const sky_tiling *s, const double sun[3]);

/* Adds a sun above the horizon that gives a horizontal plane the irradiance `horizontal` to the tile in its
 * direction: L += horizontal / cosine. This is exact for a horizontal plane. The power of the tile is that of
 * the sun times sin(altitude) over the tile's mean cosine: too little for a sun low in its tile, too much for
 * a high one. The error matters for walls under a low sun and coarse tiles. */
void year_add_sun(const sky_tiling *s, const double sun[3], double horizontal, double *L);

/* The same light over the tiles whose middles are within a tile and a half of the sun, by their distance, so
 * that a sun that moves brightens no tile in a step. O(n_tiles). */
void year_spread_sun(const sky_tiling *s, const double sun[3], double horizontal, double *L);

/* Sums over the rows of a year, on a horizontal plane, W/m2: times the step of the rows they are Wh/m2. */
typedef struct year_summary {
    double direct, diffuse;
    double light;    /* direct and diffuse in the unit of the result: lux for photometric skies */
    size_t lit;      /* rows with light */
    size_t sunny;    /* rows with direct light from above the horizon */
    size_t sunless;  /* rows whose direct light is omitted: the sun is below the horizon at their middle */
    double left_out; /* the largest omitted direct light, W/m2 */
} year_summary;

/* The sun of a row. */
typedef struct year_sun {
    double direction[3]; /* unit vector: east, north, up */
    double horizontal;   /* irradiance of a horizontal plane, W/m2 or lux; 0: no sun */
    double normal; /* irradiance of a plane normal to the sun. Where a file has only the horizontal one, it is
                      at most the extraterrestrial irradiance: the quotient is unbounded for a rising sun */
} year_sun;

typedef struct year_options {
    bool photometric;  /* cd/m2 and lux in place of W/(m2 sr) and W/m2 */
    bool sun_in_tiles; /* adds each sun to the tile in its direction */
    double north;      /* degrees: see sun_turned */
} year_options;

/* L [w->n][n_tiles], W/(m2 sr), or cd/m2; suns [w->n], or NULL for none. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED. */
lam_status year_skies(const weather *w, const sky_tiling *s, const year_options *options,
                      const progress *steps, float *L, year_sun *suns, year_summary *summary,
                      lam_error *error);

#endif
