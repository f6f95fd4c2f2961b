/* Steps of mending weather: the order of rows, and values that are filled. Private to weather_mend.c. */
#ifndef LAMBERT_DAYLIGHT_WEATHER_MEND_STEPS_H
#define LAMBERT_DAYLIGHT_WEATHER_MEND_STEPS_H

#include "solver/daylight/weather_mend.h"

/* By how many hours messages name a row earlier than its middle: an EPW states the end of its hour. */
static inline double weather_named_earlier(const weather_times *t) {
    return t->stated != NULL ? t->w->step / 2 : 0;
}

/* Sorts rows by time where they are not in order, and drops the later ones of those of one time; w->mended
 * counts them. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status weather_put_in_order(weather_times *t, weather_row **rows, lam_error *error);

/* Fills the values that rows lack, as weather_mend says of WEATHER_FILL. Cost: O(n log n). Errors:
 * LAM_ERR_FORMAT where one cannot be filled, LAM_ERR_MEMORY. */
lam_status weather_fill_values(const weather_times *t, lam_error *error);

#endif
