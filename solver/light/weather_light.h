/* Light of a weather file: the skies of its hours on the tiles of a store, and the sun. */
#ifndef LAMBERT_LIGHT_WEATHER_LIGHT_H
#define LAMBERT_LIGHT_WEATHER_LIGHT_H

#include "solver/base/terminal.h"
#include "solver/daylight/moment.h"
#include "solver/daylight/year.h"
#include "solver/light/emission.h"
#include "solver/light/sun_way.h"
#include "solver/shadow/sun_shares.h"

/* The times of the rows of weather. */
typedef struct weather_span {
    size_t n;
    double step;    /* h, that each row stands for */
    bool apart;     /* no two rows are neighbours, so that an hour is but assumed */
    double *middle; /* [n], of each row: hour of the day, standard time */
    double *begins; /* [n], of each row: hours from the beginning of the year, which has a 29 February where
                       the file has one */
    double (*suns)[3]; /* [n], the way to the sun in the axes of the scene, 0 without; NULL: not known */
    weather_mended mended;
} weather_span;

void weather_span_free(weather_span *s);

typedef struct weather_skies {
    size_t n;
    float *L;       /* [n][n_tiles] */
    year_sun *suns; /* [n] */
    weather_span span;
} weather_skies;

void weather_skies_free(weather_skies *w);

/* Points of an element that are tested for the sun of figures of a year; SUN_POINTS: of hours by themselves.
 */
enum { SUN_POINTS_YEAR = 4 };

/* The tiling of a store's sky, without what it holds. Freed by sky_tiling_free. Errors: those of the store,
 * LAM_ERR_FORMAT where the sky has other tiles. */
lam_status weather_tiling_load(store *s, const lam_sky *sky, sky_tiling *out, lam_error *error);

/* Reads a file, makes the skies of its rows, or, unless `at` is NULL, of the row that covers this moment, and
 * logs a summary, with what was missing. Errors: those of the file, LAM_ERR_ARGUMENT where no hour has any
 * light, LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status weather_skies_read(const char *path, weather_gaps gaps, const moment *at, const sky_tiling *tiling,
                              const year_options *options, terminal *t, weather_skies *out, lam_error *error);

/* The row of --gaps, a weather_gaps. */
#define OPTION_ROW_GAPS(place)                                                                               \
    {.name = "gaps",                                                                                         \
     .kind = OPTION_WORD,                                                                                    \
     .offset = (place),                                                                                      \
     .choices = "refuse|fill|skip",                                                                          \
     .preset = "refuse",                                                                                     \
     .help = "Weather that is missing by day, and rows that are missing, repeated or out of order. fill: "   \
             "up to 3 h from the rows beside the gap, more, up to 6 days, from the same time of other "      \
             "days. skip: they are left out, and shares are of the other hours. Both drop the later one of " \
             "repeated rows, and say how many hours are concerned"}

/* The options of a command line about weather. */
typedef struct weather_options {
    const char *path; /* --weather */
    bool photometric; /* --photometric */
    bool exact;       /* --sun exact */
    bool
        at_sensors; /* with exact: at sensors alone; elements have the light of the tile that holds the sun */
    size_t sun_points; /* --sun-points */
    weather_gaps gaps; /* --gaps */
    const moment *at;  /* --date or --hour; NULL: all rows, a batch */
    double north;      /* degrees */
    sun_way *way;      /* the difference that the way of the sun makes is measured there; NULL: it is not */
} weather_options;

/* Puts e under the rows of a file, on the tiles of an open store. With an exact sun, *sun holds it for the
 * elements selected (NULL: all), and e points there: sunlight_free it after the last use of e. *span, freed
 * by weather_span_free, is of the rows. Errors: also LAM_ERR_ARGUMENT for a store without a sky. */
lam_status weather_light_add(const weather_options *options, store *s, const mesh *m, const lam_operator *op,
                             const lam_sky *sky, size_t n_selected, const uint32_t *selected, terminal *t,
                             emission *e, sunlight *sun, weather_span *span, lam_error *error);

#endif
