/* Refuses weather whose rows are missing, repeated or out of order; see weather_times.h.
 *
 * An EPW states its periods, and its rows must be these; but whole days of one period may be chosen as those
 * of a WEA, with a warning. A WEA states nothing, and people choose what they put into one: some days of a
 * year, hours of every day, hours with sun. Its gaps are chosen, not missing:
 * - within a day, where every day has the same times and there are several days, or where at most half of the
 *   times from the first to the last of a day are there;
 * - by night, where no night is passed through and each day begins and ends as its neighbours do, within a
 *   quarter of an hour or a step, and neither later nor earlier than both of them;
 * - of whole days, where at most half of the days from the first to the last are there;
 * - anywhere, where no two rows are neighbours. */
#include "solver/daylight/weather_times.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { DAYS = 366, LEAP_DAY = 59 };

static const char *hours_are(double hours) {
    return hours == 1 ? "hour is" : "hours are";
}

static bool same_day(const weather_hour *a, const weather_hour *b) {
    return a->month == b->month && a->day == b->day;
}

/* True where the years of rows follow the calendar: files of several real years do. */
static bool is_calendar(const weather *w) {
    for (size_t i = 1; i < w->n; i++) {
        const weather_hour *a = &w->hours[i - 1], *b = &w->hours[i];
        const bool turns = weather_day(b->month, b->day) < weather_day(a->month, a->day);
        if (b->year != a->year + turns) return false;
    }
    return true;
}

/* The first row that is there a second time has the time of an earlier one; SIZE_MAX: it has not. */
static size_t find_twin(const weather *w, size_t row) {
    for (size_t i = 0; i < row; i++)
        if (same_day(&w->hours[i], &w->hours[row]) &&
            fabs(w->hours[i].hour - w->hours[row].hour) <= weather_tolerance(w->step))
            return i;
    return SIZE_MAX;
}

size_t weather_rows_behind(const weather *w, size_t *first) {
    const bool calendar = is_calendar(w);
    const double tolerance = weather_tolerance(w->step);
    double passed = 0, year = 24 * 365;
    size_t front = 0, behind = 0;
    for (size_t i = 0; i < w->n; i++)
        if (w->hours[i].month == 2 && w->hours[i].day == 29) year = 24 * 366;
    for (size_t i = 1; i < w->n; i++) {
        bool back = false;
        const double ahead = weather_ahead(&w->hours[front], &w->hours[i], &back);
        const bool again = !calendar && passed + ahead > year - tolerance;
        if (back || ahead <= tolerance || again) {
            if (behind++ == 0) *first = i;
            continue;
        }
        passed += ahead;
        front = i;
    }
    return behind;
}

/* Refuses rows at or before the time of a row above them. */
static lam_status check_order(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    const weather *w = t->w;
    size_t first = 0;
    const size_t behind = weather_rows_behind(w, &first);
    char name[WEATHER_NAME];
    if (behind == 0) goto done;
    const size_t twin = find_twin(w, first);
    weather_name_row(t, first, t->stated != NULL ? w->step / 2 : 0, name);
    if (twin != SIZE_MAX)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: %s has the time of line %zu: %.6g %s there twice or out of order; each time must be there "
             "once",
             t->path, name, t->rows[twin].line, (double)behind * w->step,
             hours_are((double)behind * w->step));
    FAIL(error, LAM_ERR_FORMAT, "%s: %s is before the row above it: %.6g %s out of order", t->path, name,
         (double)behind * w->step, hours_are((double)behind * w->step));
done:
    return status;
}

/* The gaps of a WEA that may be chosen. */
typedef struct chosen {
    bool any, in_days, nights, whole_days;
} chosen;

/* The rows of day k are day[k] to day[k + 1] - 1. */
typedef struct days {
    size_t n, *start;
} days;

static lam_status find_days(const weather *w, days *out, lam_error *error) {
    size_t *start = memory_allocate(w->n + 1, sizeof *start, "the days of weather", error);
    if (start == NULL) return LAM_ERR_MEMORY;
    size_t n = 0;
    for (size_t i = 0; i < w->n; i++)
        if (i == 0 || !same_day(&w->hours[i - 1], &w->hours[i])) start[n++] = i;
    start[n] = w->n;
    *out = (days){.n = n, .start = start};
    return LAM_OK;
}

static bool days_have_same_times(const weather *w, const days *d) {
    const size_t rows = d->start[1];
    for (size_t i = 0; i < w->n; i++)
        if (fabs(w->hours[i].hour - w->hours[i % rows].hour) > weather_tolerance(w->step)) return false;
    for (size_t k = 0; k < d->n; k++)
        if (d->start[k] != k * rows) return false;
    return true;
}

/* True where day k + 1 is the day after day k. */
static bool follows(const weather *w, const days *d, size_t k) {
    bool back = false;
    if (k + 1 >= d->n) return false;
    weather_hour a = w->hours[d->start[k]], b = w->hours[d->start[k + 1]];
    a.hour = b.hour = 0;
    return weather_ahead(&a, &b, &back) == 24;
}

/* The first hour of day k, or the last one, negative, so that what is cut off is larger. */
static double edge(const weather *w, const days *d, size_t k, bool last) {
    return last ? -w->hours[d->start[k + 1] - 1].hour : w->hours[d->start[k]].hour;
}

/* True where days begin and end as days with sun do. */
static bool edges_are_even(const weather *w, const days *d) {
    const double tolerance = weather_tolerance(w->step), most = fmax(w->step, .25) + tolerance;
    for (size_t k = 0; k + 1 < d->n; k++)
        for (int last = 0; last < 2 && follows(w, d, k); last++) {
            const double one = edge(w, d, k, last), next = edge(w, d, k + 1, last);
            if (fabs(one - next) > most) return false;
            if (follows(w, d, k + 1) && next > fmax(one, edge(w, d, k + 2, last)) + tolerance) return false;
        }
    return true;
}

/* True where rows follow each other across a midnight. */
static bool passes_a_night(const weather *w, const days *d) {
    bool back = false;
    for (size_t k = 1; k < d->n; k++) {
        const weather_hour *b = &w->hours[d->start[k]];
        if (weather_ahead(b - 1, b, &back) <= w->step + weather_tolerance(w->step)) return true;
    }
    return false;
}

static lam_status find_chosen(const weather *w, chosen *out, lam_error *error) {
    days d = {.n = 0};
    bool back = false;
    const lam_status status = find_days(w, &d, error);
    if (status != LAM_OK) return status;
    double span = 24, rows = 0;
    for (size_t k = 0; k < d.n; k++)
        rows += 1 + round((w->hours[d.start[k + 1] - 1].hour - w->hours[d.start[k]].hour) / w->step);
    for (size_t k = 0; k + 1 < d.n; k++) {
        weather_hour a = w->hours[d.start[k]], b = w->hours[d.start[k + 1]];
        a.hour = b.hour = 0;
        span += weather_ahead(&a, &b, &back);
    }
    const bool same = days_have_same_times(w, &d);
    *out = (chosen){.any = w->apart,
                    .in_days = (same && d.n > 1) || 2 * (double)w->n <= rows,
                    .nights = !passes_a_night(w, &d) && (same || edges_are_even(w, &d)),
                    .whole_days = 2 * 24 * (double)d.n <= span};
    free(d.start);
    return LAM_OK;
}

/* True where a gap of a WEA is chosen. */
static bool is_chosen(const chosen *c, const weather_hour *a, const weather_hour *b) {
    bool back = false;
    weather_hour one = *a, next = *b;
    one.hour = next.hour = 0;
    if (c->any) return true;
    if (same_day(a, b)) return c->in_days;
    return weather_ahead(&one, &next, &back) > 24 ? c->whole_days : c->nights;
}

static bool is_date(const weather_date *d, const weather_hour *h) {
    return d->month == h->month && d->day == h->day;
}

/* True where one period of an EPW ends with a row and another begins with the next. */
static bool is_stated(const weather_stated *stated, double step, const weather_hour *a,
                      const weather_hour *b) {
    if (a->hour + step < 24 || b->hour - step > 0) return false;
    for (size_t k = 0; k + 1 < stated->n; k++)
        if (is_date(&stated->to[k], a) && is_date(&stated->from[k + 1], b)) return true;
    return false;
}

/* True where an EPW of one period holds chosen days of it: each is whole, and at most half of those from the
 * first to the last are there. */
static bool chooses_days(const weather_times *t) {
    const weather *w = t->w;
    const size_t a_day = (size_t)lround(24 / w->step), n_days = w->n / a_day;
    bool back = false;
    if (t->all_days || t->stated == NULL || t->stated->n != 1 || w->n % a_day != 0 || n_days < 2)
        return false;
    for (size_t i = 0; i < w->n; i++)
        if (!same_day(&w->hours[i], &w->hours[i / a_day * a_day])) return false;
    for (size_t i = a_day; i < w->n; i += a_day)
        if (same_day(&w->hours[i], &w->hours[i - 1])) return false;
    weather_hour first = w->hours[0], last = w->hours[w->n - 1];
    first.hour = last.hour = 0;
    return 2 * (double)n_days <= 1 + weather_ahead(&first, &last, &back) / 24;
}

lam_status weather_find_gaps(const weather_times *t, weather_gap **gaps, size_t *n_gaps, lam_error *error) {
    lam_status status = LAM_OK;
    weather *w = t->w;
    chosen may = {.any = false};
    size_t n = 0;
    weather_gap *found = memory_allocate(w->n, sizeof *found, "the gaps of weather", error);
    if (found == NULL) TRY(LAM_ERR_MEMORY);
    if (t->stated == NULL) TRY(find_chosen(w, &may, error));
    w->stretches = 1;
    w->days_chosen = chooses_days(t);
    for (size_t i = 1; i < w->n; i++) {
        bool back = false;
        const weather_hour *a = &w->hours[i - 1], *b = &w->hours[i];
        const double left_out = weather_ahead(a, b, &back) - w->step;
        if (left_out <= weather_tolerance(w->step)) continue;
        w->stretches++;
        if (t->stated != NULL ? w->days_chosen || is_stated(t->stated, w->step, a, b) : is_chosen(&may, a, b))
            continue;
        found[n++] = (weather_gap){.row = i, .hours = left_out};
    }
    *gaps = found;
    *n_gaps = n;
    found = NULL;
done:
    free(found);
    return status;
}

/* Refuses gaps between rows that are in order. */
static lam_status check_gaps(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    weather_gap *gaps = NULL;
    size_t n = 0;
    double missing = 0;
    char name[WEATHER_NAME], more[80] = "";
    TRY(weather_find_gaps(t, &gaps, &n, error));
    if (n == 0) goto done;
    for (size_t k = 0; k < n; k++) missing += gaps[k].hours;
    weather_name_row(t, gaps[0].row, t->stated != NULL ? t->w->step / 2 : 0, name);
    if (n > 1) snprintf(more, sizeof more, ", %.6g in %zu gaps of the file", missing, n);
    FAIL(error, LAM_ERR_FORMAT, "%s: %s: before it %.6g %s missing%s; " WEATHER_ADVICE, t->path, name,
         gaps[0].hours, hours_are(gaps[0].hours), more);
done:
    free(gaps);
    return status;
}

/* The hours of a stated period of more than a year, without any 29 February; 0: it is no longer than that. */
static double hours_of_years(const weather_date *from, const weather_date *to) {
    const weather_hour a = {.month = from->month, .day = from->day}, b = {.month = to->month, .day = to->day};
    bool back = false;
    if (from->year == 0 || to->year == 0) return 0;
    const int turns = weather_day(b.month, b.day) < weather_day(a.month, a.day);
    const int years = to->year - from->year - turns;
    return years > 0 ? weather_ahead(&a, &b, &back) + 24 + 24 * 365. * years : 0;
}

double weather_lacks(const weather_times *t) {
    weather *w = t->w;
    const weather_stated *stated = t->stated;
    bool is_in[DAYS] = {false};
    double there[DAYS] = {0}, missing = 0, wanted = 0;
    w->outside = 0;
    if (stated == NULL || stated->n == 0) return 0;
    for (size_t i = 0; i < w->n; i++) there[weather_day(w->hours[i].month, w->hours[i].day)] += w->step;
    for (size_t k = 0; k < stated->n; k++) {
        int day = weather_day(stated->from[k].month, stated->from[k].day);
        const int last = weather_day(stated->to[k].month, stated->to[k].day);
        wanted += hours_of_years(&stated->from[k], &stated->to[k]);
        for (is_in[day] = true; day != last; is_in[day] = true) day = (day + 1) % DAYS;
    }
    for (int day = 0; day < DAYS; day++) {
        const bool may_lack = day == LEAP_DAY && there[day] == 0;
        if (is_in[day] && !may_lack) missing += fmax(0, 24 - there[day]);
        if (!is_in[day]) w->outside += (size_t)lround(there[day] / w->step);
    }
    if (chooses_days(t)) return 0;
    /* Of several years that are stated each has its days. */
    if (is_calendar(w)) missing = fmax(missing, wanted + there[LEAP_DAY] - (double)w->n * w->step);
    return missing < .5 * w->step ? 0 : missing;
}

/* Refuses rows that are not all that an EPW states. */
static lam_status check_periods(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    const weather *w = t->w;
    const weather_stated *stated = t->stated;
    const double missing = weather_lacks(t);
    if (missing == 0) goto done;
    char name[WEATHER_NAME], end[WEATHER_NAME];
    weather_name_row(t, 0, w->step / 2, name);
    weather_name_row(t, w->n - 1, w->step / 2, end);
    FAIL(error, LAM_ERR_FORMAT,
         "%s: line %zu states %d/%d to %d/%d, but rows are from %s to %s: %.6g %s missing; fill the gap or "
         "state what the file holds, or give --gaps fill or --gaps skip",
         t->path, stated->line, stated->from[0].month, stated->from[0].day, stated->to[stated->n - 1].month,
         stated->to[stated->n - 1].day, name, end, missing, hours_are(missing));
done:
    return status;
}

lam_status weather_check_gaps(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(check_order(t, error));
    TRY(check_gaps(t, error));
    TRY(check_periods(t, error));
done:
    return status;
}
