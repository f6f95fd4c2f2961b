/* A moment of a year: "21 Mar 12:00", or an hour of the year; and the row of weather that covers it. */
#ifndef LAMBERT_DAYLIGHT_MOMENT_H
#define LAMBERT_DAYLIGHT_MOMENT_H

#include "solver/daylight/weather.h"

typedef struct moment {
    int month, day;
    double hour; /* of standard time, 0 to below 24 */
} moment;

/* Reads DAY MONTH HH:MM with the first three letters of an English month or more. Errors: LAM_ERR_ARGUMENT,
 * whose message begins with `what`. */
lam_status moment_parse(const char *what, const char *text, moment *out, lam_error *error);

/* The moment so many hours after the beginning of a year of 365 days; hours from 0 to below 8760. */
moment moment_of_hour(double hours);

enum { MOMENT_BYTES = 24 };
/* "21 Mar 12:00". */
void moment_name(const moment *m, char text[MOMENT_BYTES]);

/* The row of w whose part of the day holds the moment, the first where years repeat it. Errors:
 * LAM_ERR_ARGUMENT where no row does; path names the file. O(n). */
lam_status moment_find(const moment *m, const char *path, const weather *w, weather_hour *out,
                       lam_error *error);

/* Leaves of w that row alone. */
lam_status moment_pick(const moment *m, const char *path, weather *w, lam_error *error);

#endif
