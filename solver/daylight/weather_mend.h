/* Missing values and rows of weather: those that cannot matter, and those that are filled or left out on
 * request. Knows no files. */
#ifndef LAMBERT_DAYLIGHT_WEATHER_MEND_H
#define LAMBERT_DAYLIGHT_WEATHER_MEND_H

#include "solver/daylight/weather_times.h"

/* The values of a row as messages name them. */
#define WEATHER_EPW_DIRECT "direct normal radiation (field 15)"
#define WEATHER_EPW_DIFFUSE "diffuse horizontal radiation (field 16)"
#define WEATHER_WEA_DIRECT "direct radiation"
#define WEATHER_WEA_DIFFUSE "diffuse horizontal radiation"

/* True where the sun is below the horizon during the whole step of a row. */
bool weather_is_dark(const weather *w, const weather_hour *h);

/* Rows that are added are at most so many times as many as there are: memory stays bounded by the file. */
enum { WEATHER_FILL_MOST = 8 };

/* Sets values by night that are missing (NAN) to 0. Then, of values by day, rows and order:
 *   WEATHER_REFUSE  refuses each that is missing or wrong
 *   WEATHER_FILL    drops the later one of two rows of one time, sorts rows by time, and adds rows in gaps of
 *                   at most WEATHER_GAP_MOST hours. Missing values are linear in time between the row before
 *                   and the row after, where these are at most WEATHER_BETWEEN hours and a step apart; else
 *                   the mean of the same time of the nearest day before and the nearest day after that have
 *                   the value, at most WEATHER_DAYS away, or of one of them. The rest is refused
 *   WEATHER_SKIP    drops and sorts likewise, and leaves rows without their values out
 * t->w and *rows, whose room is grown, change together, and t->rows follows; w->mended counts. O(n log n).
 * Errors: LAM_ERR_FORMAT names line, time and number of what is missing, LAM_ERR_MEMORY. */
enum { WEATHER_BETWEEN = 3, WEATHER_DAYS = 3, WEATHER_GAP_MOST = 2 * WEATHER_DAYS * 24 };
lam_status weather_mend(weather_times *t, weather_gaps gaps, weather_row **rows, lam_error *error);

#endif
