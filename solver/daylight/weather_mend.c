#include "solver/daylight/weather_mend.h"

#include "solver/base/array_grow.h"
#include "solver/daylight/sun.h"
#include "solver/daylight/weather_mend_steps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The sun is looked at every twelfth of an hour: between two looks it rises by a degree at most, and where it
 * culminates by .003 degrees. */
#define LOOKS_AN_HOUR 12

enum { DAYS = 366, LEAP_DAY = 59 };

bool weather_is_dark(const weather *w, const weather_hour *h) {
    const int looks = (int)fmax(1, ceil(w->step * LOOKS_AN_HOUR));
    for (int k = 0; k <= looks; k++) {
        const double hour = h->hour + w->step * ((double)k / looks - .5);
        const sun_position sun =
            sun_at(w->latitude, w->longitude, w->time_zone, h->year, h->month, h->day, hour);
        if (sun.direction[2] > 0) return false;
    }
    return true;
}

static bool is_missing(const weather_hour *h) {
    return isnan(h->direct) || isnan(h->diffuse);
}

/* Values that are missing by night count as 0. */
static void settle_nights(weather *w) {
    for (size_t i = 0; i < w->n; i++) {
        weather_hour *h = &w->hours[i];
        if (!is_missing(h) || !weather_is_dark(w, h)) continue;
        w->mended.night += (size_t)isnan(h->direct) + (size_t)isnan(h->diffuse);
        if (isnan(h->direct)) h->direct = 0;
        if (isnan(h->diffuse)) h->diffuse = 0;
    }
}

/* Refuses a value by day that is missing. */
static lam_status check_values(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    const weather *w = t->w;
    size_t first = w->n, n = 0;
    char name[WEATHER_NAME], more[80] = "";
    for (size_t i = 0; i < w->n; i++)
        if (is_missing(&w->hours[i]) && n++ == 0) first = i;
    if (n == 0) goto done;
    const bool direct = isnan(w->hours[first].direct), epw = t->stated != NULL;
    weather_name_row(t, first, weather_named_earlier(t), name);
    if (n > 1) snprintf(more, sizeof more, ", the first of %zu rows", n);
    FAIL(error, LAM_ERR_FORMAT, "%s: %s: %s is missing by day%s; " WEATHER_ADVICE, t->path, name,
         direct ? (epw ? WEATHER_EPW_DIRECT : WEATHER_WEA_DIRECT)
                : (epw ? WEATHER_EPW_DIFFUSE : WEATHER_WEA_DIFFUSE),
         more);
done:
    return status;
}

/* The times of the day that any row of a WEA has: others are chosen to be absent. It is NULL
 * of an EPW, whose times all count. Freed with free(). */
static lam_status find_times(const weather_times *t, bool **times, lam_error *error) {
    const double step = t->w->step;
    *times = NULL;
    if (t->stated != NULL) return LAM_OK;
    *times = memory_allocate((size_t)ceil(24 / step) + 1, sizeof **times, "the times of weather", error);
    if (*times == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < t->w->n; i++) (*times)[(size_t)(t->w->hours[i].hour / step)] = true;
    return LAM_OK;
}

/* The time a step after another. A 29 February that the rows beside the gap do not have is passed over. */
static weather_hour after(const weather_hour *h, double step, bool leap) {
    static const int days[12] = {31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    weather_hour next = *h;
    next.hour += step;
    if (next.hour < 24) return next;
    next.hour -= 24;
    next.day++;
    if (next.day > days[next.month - 1] - (next.month == 2 && !leap)) {
        next.day = 1;
        next.month = next.month % 12 + 1;
        next.year += next.month == 1;
    }
    return next;
}

/* Leaves rows without their values out, and counts them and the gaps. */
static lam_status skip(weather_times *t, weather_row *rows, lam_error *error) {
    lam_status status = LAM_OK;
    weather *w = t->w;
    weather_gap *gaps = NULL;
    bool *times = NULL;
    size_t n = 0, n_gaps = 0;
    double between = 0;
    /* Gaps of a WEA are chosen by the rows that are there, whatever they lack. */
    TRY(find_times(t, &times, error));
    TRY(weather_find_gaps(t, &gaps, &n_gaps, error));
    for (size_t k = 0; k < n_gaps; k++) {
        weather_hour h = w->hours[gaps[k].row - 1];
        for (long left = lround(gaps[k].hours / w->step); left > 0; left--) {
            h = after(&h, w->step, false);
            if (times == NULL || times[(size_t)(h.hour / w->step)]) between += w->step;
        }
    }
    w->mended.skipped = fmax(between, weather_lacks(t));
    for (size_t i = 0; i < w->n; i++) {
        if (is_missing(&w->hours[i])) continue;
        w->hours[n] = w->hours[i];
        rows[n++] = rows[i];
    }
    if (n == 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: all of %zu rows lack their radiation by day; take another file",
             t->path, w->n);
    w->mended.skipped += (double)(w->n - n) * w->step;
    w->n = n;
    free(gaps);
    gaps = NULL;
    TRY(weather_find_gaps(t, &gaps, &n_gaps, error));
done:
    free(times);
    free(gaps);
    return status;
}

/* Rows that are being added to. */
typedef struct growing {
    size_t n, hour_capacity, row_capacity;
    weather_hour *hours;
    weather_row *rows;
} growing;

static lam_status append(growing *g, const weather_hour *h, const weather_row *row, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(array_grow(&g->hours, &g->hour_capacity, g->n + 1, sizeof *g->hours, "rows of weather", error));
    TRY(array_grow(&g->rows, &g->row_capacity, g->n + 1, sizeof *g->rows, "rows of weather", error));
    g->hours[g->n] = *h;
    g->rows[g->n++] = *row;
done:
    return status;
}

/* Appends rows without values that follow a time, at `times` of the day where that is not NULL, named by the
 * line of a row beside the gap. */
static lam_status append_gap(growing *g, const weather_hour *from, double hours, double step, bool leap,
                             const bool *times, const weather_row *beside, lam_error *error) {
    lam_status status = LAM_OK;
    weather_hour h = *from;
    h.direct = h.diffuse = h.dew_point = NAN;
    for (long k = lround(hours / step); k > 0; k--) {
        h = after(&h, step, leap);
        if (times == NULL || times[(size_t)(h.hour / step)]) TRY(append(g, &h, beside, error));
    }
done:
    return status;
}

/* Hours that the one period of an EPW has before the first row, or after the last one. */
static void find_ends(const weather_times *t, double *before, double *behind) {
    const weather *w = t->w;
    const double step = w->step;
    const weather_hour *first = &w->hours[0], *last = &w->hours[w->n - 1];
    *before = *behind = 0;
    if (t->stated == NULL || t->stated->n != 1 || weather_lacks(t) == 0) return;
    const weather_date *from = &t->stated->from[0], *to = &t->stated->to[0];
    const weather_hour begin = {.month = from->month, .day = from->day, .hour = -step / 2};
    const weather_hour end = {.month = to->month, .day = to->day, .hour = 24 + step / 2};
    bool back = false;
    const double ahead = weather_ahead(&begin, first, &back) - step;
    *before = back ? 0 : ahead;
    const double rest = weather_ahead(last, &end, &back) - step;
    *behind = back ? 0 : rest;
    /* A whole year may begin at any row. */
    const int one = weather_day(from->month, from->day), next = (weather_day(to->month, to->day) + 1) % DAYS;
    if (next == one || (next == LEAP_DAY && one == LEAP_DAY + 1)) {
        *before = 0;
        *behind = weather_ahead(last, first, &back) - step;
    }
}

static lam_status refuse_long(const weather_times *t, size_t row, double hours, lam_error *error) {
    char name[WEATHER_NAME];
    weather_name_row(t, row, weather_named_earlier(t), name);
    return status_fail(error, LAM_ERR_FORMAT,
                       "%s: %s: beside it %.6g hours are missing, and at most %d are filled; --gaps skip "
                       "leaves them out",
                       t->path, name, hours, WEATHER_GAP_MOST);
}

/* Adds rows without values in gaps. */
static lam_status add_rows(weather_times *t, weather_row **rows, lam_error *error) {
    lam_status status = LAM_OK;
    weather *w = t->w;
    growing g = {.n = 0};
    weather_gap *gaps = NULL;
    bool *times = NULL;
    size_t n_gaps = 0, k = 0;
    double before = 0, behind = 0;
    TRY(find_times(t, &times, error));
    TRY(weather_find_gaps(t, &gaps, &n_gaps, error));
    find_ends(t, &before, &behind);
    for (size_t i = 0; i < n_gaps; i++)
        if (gaps[i].hours > WEATHER_GAP_MOST) TRY(refuse_long(t, gaps[i].row, gaps[i].hours, error));
    if (before > WEATHER_GAP_MOST) TRY(refuse_long(t, 0, before, error));
    if (behind > WEATHER_GAP_MOST) TRY(refuse_long(t, w->n - 1, behind, error));
    double missing = before + behind;
    for (size_t i = 0; i < n_gaps; i++) missing += gaps[i].hours;
    if (missing > WEATHER_FILL_MOST * (double)w->n * w->step)
        FAIL(
            error, LAM_ERR_FORMAT,
            "%s: %.6g hours are missing beside %.6g that are there, and at most %d times as many are filled; "
            "--gaps skip leaves them out",
            t->path, missing, (double)w->n * w->step, WEATHER_FILL_MOST);
    bool leap = false;
    for (size_t i = 0; i < w->n; i++)
        leap = leap || weather_day(w->hours[i].month, w->hours[i].day) == LEAP_DAY;
    if (before > weather_tolerance(w->step)) {
        weather_hour h = w->hours[0];
        h.month = t->stated->from[0].month;
        h.day = t->stated->from[0].day;
        h.hour = -w->step / 2;
        TRY(append_gap(&g, &h, before, w->step, leap, times, &(*rows)[0], error));
    }
    for (size_t i = 0; i < w->n; i++) {
        if (k < n_gaps && gaps[k].row == i)
            TRY(append_gap(&g, &w->hours[i - 1], gaps[k++].hours, w->step, leap, times, &(*rows)[i], error));
        TRY(append(&g, &w->hours[i], &(*rows)[i], error));
    }
    TRY(append_gap(&g, &w->hours[w->n - 1], behind, w->step, leap, times, &(*rows)[w->n - 1], error));
    free(w->hours);
    free(*rows);
    w->n = g.n;
    w->hours = g.hours;
    t->rows = *rows = g.rows;
    g = (growing){.n = 0};
done:
    free(g.hours);
    free(g.rows);
    free(times);
    free(gaps);
    return status;
}

static lam_status fill(weather_times *t, weather_row **rows, lam_error *error) {
    lam_status status = LAM_OK;
    weather *w = t->w;
    const size_t night = w->mended.night;
    TRY(add_rows(t, rows, error));
    settle_nights(w);
    w->mended.dark = (double)((w->mended.night - night) / 2) * w->step;
    w->mended.night = night;
    TRY(weather_fill_values(t, error));
done:
    return status;
}

lam_status weather_mend(weather_times *t, weather_gaps gaps, weather_row **rows, lam_error *error) {
    lam_status status = LAM_OK;
    settle_nights(t->w);
    if (gaps == WEATHER_REFUSE) {
        TRY(check_values(t, error));
        TRY(weather_check_gaps(t, error));
        goto done;
    }
    t->all_days = true;
    TRY(weather_put_in_order(t, rows, error));
    if (gaps == WEATHER_SKIP) {
        TRY(skip(t, *rows, error));
        goto done;
    }
    TRY(fill(t, rows, error));
    TRY(weather_check_gaps(t, error));
done:
    return status;
}
