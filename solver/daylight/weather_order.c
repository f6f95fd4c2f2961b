/* Rows of weather in the order of their times. A file is of one year, whose rows may state any number for it,
 * or of several. */
#include "solver/daylight/weather_mend_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DAYS = 366 };

/* A row with its place in time and in the file. */
typedef struct place {
    double key; /* h */
    size_t row;
} place;

static int compare_places(const void *a, const void *b) {
    const place *one = a, *other = b;
    if (one->key != other->key) return one->key < other->key ? -1 : 1;
    return (one->row > other->row) - (one->row < other->row);
}

/* Hours from the beginning of a year that has a 29 February. */
static double time_of_year(const weather_hour *h) {
    return 24. * weather_day(h->month, h->day) + h->hour;
}

/* Fills places [n] in the order of the year. */
static void sort_by_year(const weather *w, place *places) {
    for (size_t i = 0; i < w->n; i++) places[i] = (place){.key = time_of_year(&w->hours[i]), .row = i};
    qsort(places, w->n, sizeof *places, compare_places);
}

/* True where rows of several years have one time: the file is of several years. */
static bool has_years(const weather *w, const place *sorted) {
    for (size_t i = 1; i < w->n; i++)
        if (sorted[i].key - sorted[i - 1].key <= weather_tolerance(w->step) &&
            w->hours[sorted[i].row].year != w->hours[sorted[i - 1].row].year)
            return true;
    return false;
}

/* The time of the year at which rows of one year begin: after the longest gap, so that a winter is whole. */
static double beginning(const weather *w, const place *sorted) {
    double longest = sorted[0].key + 24. * DAYS - sorted[w->n - 1].key, from = sorted[0].key;
    for (size_t i = 1; i < w->n; i++) {
        const double gap = sorted[i].key - sorted[i - 1].key;
        /* A year without its 29 February has a gap there that is none. */
        if (gap <= longest + 24) continue;
        longest = gap;
        from = sorted[i].key;
    }
    return from - weather_tolerance(w->step);
}

lam_status weather_put_in_order(weather_times *t, weather_row **rows, lam_error *error) {
    lam_status status = LAM_OK;
    weather *w = t->w;
    size_t n = 0, kept = 0, furthest = 0;
    double last = -INFINITY;
    if (weather_rows_behind(w, &kept) == 0) return LAM_OK;
    place *places = memory_allocate(w->n, sizeof *places, "the order of weather", error);
    weather_hour *hours = memory_allocate(w->n, sizeof *hours, "the order of weather", error);
    weather_row *ordered = memory_allocate(w->n, sizeof *ordered, "the order of weather", error);
    if (places == NULL || hours == NULL || ordered == NULL) TRY(LAM_ERR_MEMORY);
    sort_by_year(w, places);
    const bool years = has_years(w, places);
    const double from = beginning(w, places), year = 24. * DAYS;
    for (size_t i = 0; i < w->n; i++) {
        const double time = time_of_year(&w->hours[i]);
        places[i] = (place){
            .key = years ? w->hours[i].year * year + time : time - from + (time < from ? year : 0), .row = i};
    }
    qsort(places, w->n, sizeof *places, compare_places);
    for (size_t i = 0; i < w->n; i++) {
        /* Decimals of hours differ between repetitions, too: the first of the file is kept. */
        const bool again = places[i].key - last <= weather_tolerance(w->step);
        if (again) w->mended.repeated++;
        if (again && places[i].row > kept) continue;
        kept = places[i].row;
        if (!again) last = places[i].key;
        hours[again ? n - 1 : n] = w->hours[kept];
        ordered[again ? n - 1 : n] = (*rows)[kept];
        n += !again;
    }
    for (size_t i = 0; i < n; i++) {
        w->mended.unordered += ordered[i].line < furthest;
        if (ordered[i].line > furthest) furthest = ordered[i].line;
    }
    memcpy(w->hours, hours, n * sizeof *hours);
    memcpy(*rows, ordered, n * sizeof *ordered);
    w->n = n;
done:
    free(places);
    free(hours);
    free(ordered);
    return status;
}
