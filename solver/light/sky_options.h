/* The options of a command line about the place, the time and the brightness of a sky, for every verb that
 * takes one; and skies by name as light of a store. */
#ifndef LAMBERT_LIGHT_SKY_OPTIONS_H
#define LAMBERT_LIGHT_SKY_OPTIONS_H

#include "solver/base/options/options.h"
#include "solver/daylight/moment.h"
#include "solver/daylight/named_sky.h"
#include "solver/light/emission.h"
#include "solver/light/sunlight.h"

/* --place */
typedef struct sky_place {
    bool given;
    double latitude, longitude, zone; /* degrees, north and east positive; hours ahead of UTC */
} sky_place;

/* --date or --hour */
typedef struct sky_moment {
    bool given;
    moment m;
} sky_moment;

typedef struct sky_options {
    double lux_outside; /* --lux-outside; 0: not given */
    sky_place place;
    sky_moment date, hour;
    double north;      /* --north; NAN, as it begins: that of the store */
    bool photometric;  /* --photometric */
    bool sun_in_tiles; /* --sun tiles */
    size_t sun_points; /* --sun-points; 0: the preset. No rows of these two tables */
} sky_options;

/* Rows that fill a sky_options: of time and north, also for weather, and of named skies alone. */
extern const option_row sky_time_rows[], sky_named_rows[];

/* The moment that is asked for; NULL: none. */
const moment *sky_options_moment(const sky_options *o);

/* Checks what goes together: `name` is a named sky, or NULL, `by_weather` says that there is a file of
 * weather, `by_file` one of a sky. Errors: LAM_ERR_ARGUMENT, wrong usage. */
lam_status sky_options_check(const sky_options *o, const char *name, bool by_weather, bool by_file,
                             lam_error *error);

/* The north of an answer: as asked, or that of an open store. Errors: those of the store. */
lam_status sky_options_north(const sky_options *o, store *s, double *north, lam_error *error);

/* A named sky on tiles, L [n_tiles], and its sun, turned to a north. `said` is a line for the log. Errors:
 * LAM_ERR_ARGUMENT as named_sky_make. */
enum { SKY_SAID = 200 };
lam_status sky_options_make(const sky_options *o, const char *name, double north, const sky_tiling *tiling,
                            bool sun_in_tiles, double *L, year_sun *sun, char said[SKY_SAID],
                            lam_error *error);

/* The kind of light of a named sky, or of weather where name is NULL, over a store of this kind: photometric
 * where either says so. */
light_kind sky_options_kind(const sky_options *o, const char *name, light_kind of_store);

/* Puts e under a named sky on the tiles of an open store, of sky_options_kind. A sun that is not in a tile is
 * in *sun, and e points there: sunlight_free it after the last use of e. Errors: also LAM_ERR_ARGUMENT for a
 * store without a sky. */
lam_status named_light_add(const sky_options *o, const char *name, store *s, const mesh *m,
                           const lam_operator *op, const lam_sky *sky, emission *e, sunlight *sun,
                           char said[SKY_SAID], lam_error *error);

#endif
