/* The body of a request for skies: words and numbers, checked one by one. It must not know models of skies,
 * times or places. No I/O. */
#ifndef LAMBERT_CODEC_SKY_REQUEST_H
#define LAMBERT_CODEC_SKY_REQUEST_H

#include "solver/codec/problem.h"
#include "solver/codec/request.h"

enum { SKY_REQUEST_MOST = 64, SKY_REQUEST_TEXT = 48 };

/* The member that names a sky: `name`, `diffuse` with or without `direct`, or `weather`. */
typedef enum sky_source { SKY_BY_NAME, SKY_BY_LIGHT, SKY_BY_WEATHER } sky_source;

/* One sky. Texts are "" and numbers NAN where they were not given. */
typedef struct sky_request {
    sky_source source;
    char name[SKY_REQUEST_TEXT], date[SKY_REQUEST_TEXT], gaps[SKY_REQUEST_TEXT];
    double direct, diffuse, dew_point, lux_outside;
    double azimuth, altitude;         /* of `sun`, degrees; both or none */
    double latitude, longitude, zone; /* of `place`; all or none */
    double hour, north;
    bool photometric, sun_in_tiles; /* as the scene counts light; true */
} sky_request;

/* Reads {"sky": SKY} or {"skies": [SKY, ...]}: skies [SKY_REQUEST_MOST]. False with why. */
bool codec_read_skies_json(const codec_scene *scene, const char *text, size_t length, sky_request *skies,
                           size_t *n_skies, problem *why);

#endif
