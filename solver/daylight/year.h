/* From the weather of every hour to the radiance of every tile of a sky. */
#ifndef LAMBERT_DAYLIGHT_YEAR_H
#define LAMBERT_DAYLIGHT_YEAR_H

#include "solver/base/progress.h"
#include "solver/daylight/perez.h"
#include "solver/daylight/sky_tiles.h"
#include "solver/daylight/weather.h"

/* L [n_tiles] becomes the sky p without its sun, a mean over each tile (directions about 3 degrees apart,
 * each for its solid angle), scaled so that sum L cosine is diffuse. Where the model has no light at all
 * the sky is the same everywhere. Cost: O(n_tiles), at least some 2000 directions. */
void year_add_sky(const sky_tiling *s, const perez_sky *p, const sun_position *sun, double diffuse,
                  double *L);

/* The tile that holds a sun above the horizon, in this direction (east, north, up). */
size_t year_sun_tile(const sky_tiling *s, const double sun[3]);

/* Adds a sun above the horizon, in such a direction, that gives a horizontal plane the irradiance horizontal:
 * to the one tile that it stands in, L += horizontal / cosine. What a horizontal plane receives is exact so;
 * the power that comes from the tile is not: it is that of the sun times sin(altitude) over the tile's mean
 * cosine, too little for a sun low in its tile, too much for a high one, which matters for walls under a low
 * sun and coarse tiles.
 */
void year_add_sun(const sky_tiling *s, const double sun[3], double horizontal, double *L);

/* What a year was made of. Sums are of a horizontal plane, Wh/m2 where a row is an hour. */
typedef struct year_summary {
    double direct, diffuse;
    double light;    /* the same of both in what was made: lm h/m2 for photometric skies */
    size_t lit;      /* rows with light */
    size_t sunny;    /* rows with direct light from above the horizon */
    size_t sunless;  /* rows with direct light of a sun below the horizon at their middle: left out */
    double left_out; /* the largest of these, W/m2 */
} year_summary;

/* The sun of a row. */
typedef struct year_sun {
    double direction[3]; /* unit vector: east, north, up */
    double horizontal;   /* what a horizontal plane receives, W/m2 or lux; 0: none */
    double normal;       /* what a plane that faces it receives; where a file has only the other, no more than
                            comes from above the air, which a sun that just rises would seem to exceed */
} year_sun;

/* What is made of a year. */
typedef struct year_options {
    bool photometric;  /* cd/m2 and lux */
    bool sun_in_tiles; /* each sun in the tile that holds it */
} year_options;

/* L [w->n][n_tiles], W/(m2 sr), or cd/m2; suns [w->n], or NULL for none. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED. */
lam_status year_skies(const weather *w, const sky_tiling *s, const year_options *options,
                      const progress *steps, float *L, year_sun *suns, year_summary *summary,
                      lam_error *error);

#endif
