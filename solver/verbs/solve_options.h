/* The command line of `lambert solve`: its options, and what goes together. */
#ifndef LAMBERT_VERBS_SOLVE_OPTIONS_H
#define LAMBERT_VERBS_SOLVE_OPTIONS_H

#include "solver/light/annual.h"
#include "solver/light/weather_light.h"
#include "solver/verbs/light_options.h"

/* --sun: the light of its tile, or the sun itself. */
typedef enum sun_asked { SUN_TILES, SUN_EXACT } sun_asked;

/* --at: the places of the values. */
typedef enum place_asked { AT_ELEMENTS, AT_FACES, AT_TEXELS } place_asked;

typedef struct solve_options {
    light_options light;
    option_list reduce, annual;
    const char *weather, *quantity, *output, *occupied, *figure, *sensors, *at_least;
    double hours, tolerance, texel;
    sun_asked sun;
    place_asked at;
    uint64_t sun_points;
    weather_gaps gaps;
    bool json, verbose, smooth, linear, emissive;
    bool sun_given; /* --sun was */
} solve_options;

/* The tables of rows that fill a solve_options. */
extern const option_row solve_weather_rows[], solve_answer_rows[], solve_year_rows[];

/* Checks what goes together, sets what follows from other options, and reads the figures of a year; an error
 * is wrong usage. */
lam_status solve_options_check(solve_options *f, const option_result *given, annual_options *year,
                               lam_error *error);

#endif
