/* The times of the rows of a weather file: the step between them, and the rows that are missing, repeated or
 * out of order. Knows neither files nor light; for weather.c. */
#ifndef LAMBERT_DAYLIGHT_WEATHER_TIMES_H
#define LAMBERT_DAYLIGHT_WEATHER_TIMES_H

#include "solver/daylight/weather.h"

/* The part of a row that is no weather. */
typedef struct weather_row {
    size_t line;
    double minute; /* of an EPW; NAN: no whole number from 0 to 60 */
} weather_row;

/* The header of an EPW about its rows. */
enum { WEATHER_PERIODS = 16 };
typedef struct weather_date {
    int year, month, day; /* year 0: not stated */
} weather_date;
typedef struct weather_stated {
    size_t line, per_hour, n; /* n periods; 0: none is stated */
    weather_date from[WEATHER_PERIODS], to[WEATHER_PERIODS];
} weather_stated;

/* A file whose times are looked at. */
typedef struct weather_times {
    const char *path;
    const weather_row *rows;      /* [w->n] */
    const weather_stated *stated; /* NULL: a WEA, which states nothing */
    weather *w;
    bool all_days; /* days of an EPW are missing that else may be chosen */
} weather_times;

/* Times that are this close to a multiple of the step are on it: decimals of hours are rounded to .001 or .01
 * of an hour. */
double weather_tolerance(double step);

/* Days from 1 January, 0 to 365, of a year that has a 29 February. */
int weather_day(int month, int day);

/* Hours from one row to the next by the clock, forward and less than a year: 29 February counts where one of
 * them is in it. *back is true where the second is before the first: a file turns the year only forward, by
 * at most half of one. */
double weather_ahead(const weather_hour *from, const weather_hour *to, bool *back);

/* Sets w->step, w->apart and, of an EPW, whose hours come as hour - 1, the middles of the parts of hours:
 *   step = 1/N with the most common distance of neighbours of at most an hour, N a divisor of 60;
 *   of a WEA also longer steps, where rows at equal distances fill whole days.
 * Rows of which no two are neighbours are apart, with a step of one hour. LAM_ERR_FORMAT names the line where
 * a distance is no multiple of the step, or where an EPW has no minute. O(n). */
lam_status weather_find_step(const weather_times *t, lam_error *error);

/* The number of rows at or before the time of a row above them; *first is the first of them. O(n). */
size_t weather_rows_behind(const weather *w, size_t *first);

/* The end of messages about missing hours. */
#define WEATHER_ADVICE "fill the gap, or give --gaps fill or --gaps skip"

/* A gap before a row. */
typedef struct weather_gap {
    size_t row;
    double hours; /* that are missing */
} weather_gap;

/* The gaps between rows that are in order, freed with free(): without those between the periods that an EPW
 * states, and those of a WEA that are chosen (weather_gaps.c says which). Sets w->stretches. O(n). Errors:
 * LAM_ERR_MEMORY. */
lam_status weather_find_gaps(const weather_times *t, weather_gap **gaps, size_t *n_gaps, lam_error *error);

/* Hours that the periods of an EPW have and its rows lack; 0 of a WEA. Sets w->outside. O(n). */
double weather_lacks(const weather_times *t);

/* Refuses rows that are missing, repeated or out of order: LAM_ERR_FORMAT names the first and how many hours
 * are concerned. The rows of an EPW are the periods that its header states, or else one stretch. A WEA states
 * nothing. Sets w->stretches and w->outside. O(n). */
lam_status weather_check_gaps(const weather_times *t, lam_error *error);

/* A row as it is named in messages, "line 33 (2001-06-22 00:30)", with a time so many hours before its own.
 */
enum { WEATHER_NAME = 64 };
void weather_name_row(const weather_times *t, size_t row, double earlier, char name[WEATHER_NAME]);

#endif
