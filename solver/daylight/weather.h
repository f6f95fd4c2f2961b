/* Reads the irradiances of a year, row by row, from a weather file: EPW of EnergyPlus, or WEA of Radiance's
 * gendaymtx. Knows no tiles; of the sun only that values by night cannot matter. */
#ifndef LAMBERT_DAYLIGHT_WEATHER_H
#define LAMBERT_DAYLIGHT_WEATHER_H

#include "store/status.h"

enum { WEATHER_PLACE = 64 };

typedef struct weather_hour {
    int year, month, day;
    double hour;      /* of standard time, 0 to 24: the middle of the interval that the row covers */
    double direct;    /* W/m2, normal to the sun, or on a horizontal plane: see direct_is_horizontal */
    double diffuse;   /* W/m2, on a horizontal plane */
    double dew_point; /* degrees Celsius; NAN: unknown */
} weather_hour;

/* Rows and values by day that are missing, rows that are repeated, and rows out of order. */
typedef enum weather_gaps {
    WEATHER_REFUSE,
    WEATHER_FILL, /* missing light is that of the rows around it; see weather_mend.h */
    WEATHER_SKIP  /* rows without their light are left out */
} weather_gaps;

/* The changes to the rows of a file. */
typedef struct weather_mended {
    size_t night;               /* missing values of radiation by night, which count as 0 */
    size_t below;               /* values from -10 to 0 W/m2, offsets of sensors, which count as 0 */
    size_t no_dew;              /* rows whose dew point is missing */
    size_t repeated, unordered; /* rows that were dropped, and rows that were put in order */
    double between, by_days;    /* h that were filled from the rows beside the gap, and from other days */
    double dark;                /* h of rows that were added by night, without light */
    double skipped;             /* h that were left out */
} weather_mended;

typedef struct weather {
    char place[WEATHER_PLACE];
    double latitude, longitude; /* degrees; north and east are positive */
    double time_zone;           /* hours that standard time is ahead of UTC */
    double elevation;           /* m */
    bool direct_is_horizontal;
    double step;      /* h, that every row stands for */
    bool apart;       /* no two rows are neighbours: each stands for an hour because nothing says otherwise */
    size_t stretches; /* of rows without a gap */
    size_t stated_steps; /* records an hour in the header of an EPW; 0: none is stated */
    size_t outside;      /* rows outside of the periods in the header of an EPW */
    bool days_chosen;    /* of the period in the header of an EPW, of which it holds at most half */
    weather_mended mended;
    size_t n;
    weather_hour *hours; /* [n], freed by weather_free */
} weather;

void weather_free(weather *w);

/* True for a name that ends in .epw or .wea. */
bool weather_is_named(const char *path);

/* Reads a file in the format of its extension. The step between rows comes from their times: an hour, or an
 * hour over a divisor of 60. An EPW row covers its part of the hour h-1 to h and has its own year. WEA rows
 * get the year 2001, or 2000 where the file has a 29 February, and their hours are the middle of the
 * interval; rows of a WEA that fill whole days may also be further apart. Missing radiation (9999 and above,
 * -999, -9999) counts as 0 where the sun is below the horizon for the whole step, and so do values from -10
 * to 0. `gaps` tells what becomes of rows and of values by day that are missing. Errors: LAM_ERR_IO,
 * LAM_ERR_MEMORY, LAM_ERR_FORMAT naming the file, the line, the field, its value and the allowed range, or
 * the first row that is missing, repeated or out of order (weather_times.h). Source of the formats:
 * EnergyPlus, Auxiliary Programs, "EnergyPlus Weather File (EPW) Data Dictionary"; Radiance, gendaymtx(1). */
lam_status weather_read(const char *path, weather_gaps gaps, weather *out, lam_error *error);

/* The same of a text of so many bytes, in the format of the extension of `name`, which messages have for a
 * path. */
lam_status weather_read_text(const char *name, const char *text, size_t length, weather_gaps gaps,
                             weather *out, lam_error *error);

#endif
