/* Weather that a request brings or that stands beside a store, read by solver/daylight. */
#ifndef LAMBERT_SERVER_ROUTE_WEATHER_SOURCE_H
#define LAMBERT_SERVER_ROUTE_WEATHER_SOURCE_H

#include "server/route/call.h"
#include "solver/daylight/weather.h"

/* The text of a weather file. */
typedef struct weather_source {
    const char *bytes;
    size_t length;
    const char *format; /* "epw" or "wea" */
} weather_source;

/* The format that a text begins as; NULL: neither. */
const char *weather_source_format(const char *bytes, size_t length);

/* Reads a text with a way of gaps ("" is refuse), in memory that the request takes. False with why, whose
 * class is `wrong` where the text is, and whose detail begins with `what`. *out is freed by weather_free. */
bool weather_source_read(const call *in, const weather_source *text, const char *gaps, problem_kind wrong,
                         const char *what, weather *out, problem *why);

/* The same of the file beside the store of the call's scene. */
bool weather_source_read_beside(const call *in, const char *gaps, const char *what, weather *out,
                                problem *why);

#endif
