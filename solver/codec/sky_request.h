/* The bodies of requests for skies, for positions of the sun and for rows of weather: words and numbers,
 * checked one by one. They must not know models of skies, times or places. No I/O. */
#ifndef LAMBERT_CODEC_SKY_REQUEST_H
#define LAMBERT_CODEC_SKY_REQUEST_H

#include "solver/codec/problem.h"
#include "solver/codec/request.h"

enum { SKY_REQUEST_MOST = 64, SKY_REQUEST_TEXT = 48 };

/* The member that names a sky: `name`, `diffuse` with or without `direct`, or `weather`. */
typedef enum sky_source { SKY_BY_NAME, SKY_BY_LIGHT, SKY_BY_WEATHER } sky_source;

/* Degrees, to the north and to the east, and hours ahead of UTC. */
typedef struct request_place {
    double latitude, longitude, zone;
} request_place;

/* One sky. Texts are "" and numbers NAN where they were not given. */
typedef struct sky_request {
    sky_source source;
    char name[SKY_REQUEST_TEXT], date[SKY_REQUEST_TEXT], gaps[SKY_REQUEST_TEXT];
    double direct, direct_horizontal, diffuse, dew_point, lux_outside; /* at most one of the first two */
    double azimuth, altitude;                                          /* of `sun`, degrees; both or none */
    request_place place;                                               /* all or none */
    double hour, north, year;
    bool photometric, sun_in_tiles; /* as the scene counts light; true */
    bool sun_spread, dark;          /* over tiles near it; a dark sky is answered: both false */
} sky_request;

/* Reads {"sky": SKY} or {"skies": [SKY, ...]}: skies [SKY_REQUEST_MOST]. False with why. */
bool codec_read_skies_json(const codec_scene *scene, const char *text, size_t length, sky_request *skies,
                           size_t *n_skies, problem *why);

enum { SUN_REQUEST_MOST = 1 << 17 };

/* Hours of a year, at a place. */
typedef struct sun_request {
    request_place place;
    double year; /* 2001 where none was given */
    size_t n_hours;
    double *hours; /* [SUN_REQUEST_MOST], the caller's */
} sun_request;

/* Reads {"place": PLACE, "hours": [h, ...], "year": Y}: sets *out but for the pointer. False with why. */
bool codec_read_sun_json(const codec_scene *scene, const char *text, size_t length, sun_request *out,
                         problem *why);

/* The text of a weather file, and the way of gaps. */
typedef struct weather_request {
    char *text; /* [length], freed by the caller */
    size_t length;
    char gaps[SKY_REQUEST_TEXT]; /* "": none was given */
} weather_request;

/* Reads {"text": TEXT, "gaps": WORD}, without the text where `beside` says that it is known. Takes twice the
 * length of the body of memory. False with why. */
bool codec_read_weather_json(const codec_scene *scene, bool beside, const char *body, size_t length,
                             weather_request *out, problem *why);

#endif
