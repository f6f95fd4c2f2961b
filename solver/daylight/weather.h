/* A year of sun and sky from a weather file: EnergyPlus's EPW or the WEA that gendaymtx of Radiance reads.
 * Knows neither where the sun stands nor tiles. */
#ifndef LAMBERT_DAYLIGHT_WEATHER_H
#define LAMBERT_DAYLIGHT_WEATHER_H

#include "store/status.h"

enum { WEATHER_PLACE = 64 };

typedef struct weather_hour {
    int year, month, day;
    double hour;      /* of standard time, 0 to 24: the middle of what the row covers */
    double direct;    /* W/m2, on a plane that faces the sun, or a horizontal one: see direct_is_horizontal */
    double diffuse;   /* W/m2, on a horizontal plane */
    double dew_point; /* degrees Celsius; NAN: unknown */
} weather_hour;

typedef struct weather {
    char place[WEATHER_PLACE];
    double latitude, longitude; /* degrees; north and east are positive */
    double time_zone;           /* hours of standard time before UTC */
    double elevation;           /* m */
    bool direct_is_horizontal;
    size_t n;
    weather_hour *hours; /* [n], freed by weather_free */
} weather;

void weather_free(weather *w);

/* Whether the name ends in .epw or .wea. */
bool weather_is_named(const char *path);

/* Reads the file whose kind its name tells. An EPW row of hour h covers h-1 to h and has its own year; those
 * of a WEA are of 2001, or of 2000 where it has a 29 February, and their hours are the middle already.
 * Errors: LAM_ERR_IO, LAM_ERR_MEMORY, LAM_ERR_FORMAT: the file, the line, the field, its value and what is
 * allowed. A radiation that an EPW gives as missing (9999) is such an error.
 * Source of the formats: EnergyPlus, Auxiliary Programs, "EnergyPlus Weather File (EPW) Data Dictionary";
 * Radiance, gendaymtx(1). */
lam_status weather_read(const char *path, weather *out, lam_error *error);

#endif
