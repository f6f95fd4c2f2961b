/* Finds the step between the rows of a weather file from their times; see weather_times.h. */
#include "solver/daylight/weather_times.h"

#include <math.h>
#include <stdio.h>

/* Records an hour: EnergyPlus asks for divisors of 60. */
static const int per_hour[] = {1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60};
enum { CHOICES = sizeof per_hour / sizeof per_hour[0] };

/* An hour of two decimals is off by at most .005, and so a distance by .01. */
#define ROUNDED .0101
/* Longer steps are no weather that one sun could stand for. */
#define LONGEST 6.

double weather_tolerance(double step) {
    return fmin(ROUNDED, step / 4);
}

int weather_day(int month, int day) {
    static const int before[12] = {0, 31, 60, 91, 121, 152, 182, 213, 244, 274, 305, 335};
    return before[month - 1] + day - 1;
}

double weather_ahead(const weather_hour *from, const weather_hour *to, bool *back) {
    enum { DAYS = 366, LEAP = 59 };
    const int first = weather_day(from->month, from->day), last = weather_day(to->month, to->day);
    double ahead = 24. * (last - first) + to->hour - from->hour;
    const bool turns = ahead < 0;
    if (turns) ahead += 24 * DAYS;
    *back = ahead > 12 * DAYS && turns;
    const bool passes_leap = turns ? first < LEAP || last > LEAP : first < LEAP && last > LEAP;
    return ahead - (passes_leap ? 24 : 0);
}

void weather_name_row(const weather_times *t, size_t row, double earlier, char name[WEATHER_NAME]) {
    const weather_hour *h = &t->w->hours[row];
    const long minutes = lround(60 * fmax(0, h->hour - earlier));
    snprintf(name, WEATHER_NAME, "line %zu (%d-%02d-%02d %02ld:%02ld)", t->rows[row].line, h->year, h->month,
             h->day, minutes / 60, minutes % 60);
}

/* True where two rows that follow each other are of one day and hour, as the rows of an EPW are that has
 * several an hour. */
static bool has_parts(const weather *w) {
    for (size_t i = 1; i < w->n; i++) {
        const weather_hour *a = &w->hours[i - 1], *b = &w->hours[i];
        if (a->month == b->month && a->day == b->day && a->hour == b->hour) return true;
    }
    return false;
}

/* Adds the minutes of an EPW to its hours. */
static lam_status add_minutes(const weather_times *t, lam_error *error) {
    for (size_t i = 0; i < t->w->n; i++)
        if (isnan(t->rows[i].minute))
            return status_fail(error, LAM_ERR_FORMAT,
                               "%s: line %zu: minute (field 5) must be a whole number from 0 to 60, as hours "
                               "have several rows",
                               t->path, t->rows[i].line);
    for (size_t i = 0; i < t->w->n; i++) t->w->hours[i].hour += t->rows[i].minute / 60;
    return LAM_OK;
}

/* The choice of steps of at most an hour that is nearest to a distance; CHOICES: none is near. */
static size_t nearest_choice(double distance) {
    size_t best = CHOICES;
    double least = ROUNDED;
    for (size_t k = 0; k < CHOICES; k++) {
        const double off = fabs(distance - 1. / per_hour[k]);
        if (off < fmin(least, .25 / per_hour[k])) {
            least = off;
            best = k;
        }
    }
    return best;
}

/* Steps longer than an hour: rows at equal distances that fill whole days. 0: they are none. */
static double long_step(const weather *w) {
    bool back = false;
    const double step = weather_ahead(&w->hours[0], &w->hours[1], &back), a_day = 24 / step;
    const double tolerance = weather_tolerance(1);
    /* Rows of one time, as far as decimals tell, have no step. */
    if (back || step <= tolerance || step > LONGEST || fabs(a_day - round(a_day)) > 1e-3 ||
        w->n % (size_t)round(a_day) != 0)
        return 0;
    for (size_t i = 1; i < w->n; i++) {
        /* A day is left only after its last row. */
        const double ahead = weather_ahead(&w->hours[i - 1], &w->hours[i], &back);
        const bool is_new = i % (size_t)round(a_day) == 0;
        if (back || (!is_new && fabs(ahead - step) > tolerance)) return 0;
        const bool same =
            w->hours[i].day == w->hours[i - 1].day && w->hours[i].month == w->hours[i - 1].month;
        if (same == is_new) return 0;
    }
    return 24 / round(a_day);
}

/* Refuses a row that is not a multiple of the step after the one before it, and one that begins a stretch of
 * a longer step of at most an hour. */
static lam_status check_steps(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    const weather *w = t->w;
    const double step = w->step, tolerance = weather_tolerance(step);
    char name[WEATHER_NAME];
    bool back = false, next_back = false;
    double next = w->n > 1 ? weather_ahead(&w->hours[0], &w->hours[1], &next_back) : 0;
    for (size_t i = 1; i < w->n; i++) {
        const double ahead = next;
        back = next_back;
        next = i + 1 < w->n ? weather_ahead(&w->hours[i], &w->hours[i + 1], &next_back) : 0;
        const bool off = fabs(ahead - step * round(ahead / step)) > tolerance;
        const bool longer =
            ahead > step + tolerance && ahead <= 1 + tolerance && fabs(next - ahead) <= tolerance;
        if (back || (!off && !longer)) continue;
        weather_name_row(t, i, 0, name);
        FAIL(error, LAM_ERR_FORMAT,
             "%s: %s is %.4g h after the row before it, but most rows are %.4g h apart; a file must keep to "
             "one step",
             t->path, name, ahead, step);
    }
done:
    return status;
}

/* The parts of hours that rows of an EPW cover. A minute is the end of a part where any row has minute 60, or
 * minutes are whole parts and none is 0; else it is in the part, or its beginning. */
static void take_parts(const weather_times *t) {
    const double step = t->w->step;
    bool whole = true, zero = false, sixty = false;
    for (size_t i = 0; i < t->w->n; i++) {
        const double parts = t->rows[i].minute / 60 / step;
        whole = whole && parts == round(parts);
        zero = zero || t->rows[i].minute == 0;
        sixty = sixty || t->rows[i].minute == 60;
    }
    const bool ends = sixty || (whole && !zero);
    for (size_t i = 0; i < t->w->n; i++) {
        const double hour = t->w->hours[i].hour - t->rows[i].minute / 60,
                     parts = t->rows[i].minute / 60 / step;
        /* 1/60 and its multiples are not exact. */
        const double part = ends ? fmax(ceil(parts - 1e-6) - 1, 0) : floor(parts + 1e-6);
        t->w->hours[i].hour = round(hour) + (part + .5) * step;
    }
}

lam_status weather_find_step(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    weather *w = t->w;
    const bool parts = t->stated != NULL && has_parts(w);
    size_t count[CHOICES + 1] = {0}, best = 0, odd = 0;
    if (parts) TRY(add_minutes(t, error));
    for (size_t i = 1; i < w->n; i++) {
        bool back = false;
        const double ahead = weather_ahead(&w->hours[i - 1], &w->hours[i], &back);
        if (back || ahead <= 0 || ahead > 1 + ROUNDED) continue;
        const size_t choice = nearest_choice(ahead);
        if (count[choice]++ == 0 && choice == CHOICES) odd = i;
    }
    for (size_t k = 0; k < CHOICES; k++)
        if (count[k] > count[best]) best = k;
    w->step = 1. / per_hour[best];
    w->apart = t->stated == NULL && count[best] == 0;
    if (count[CHOICES] > count[best]) {
        char name[WEATHER_NAME];
        bool back = false;
        weather_name_row(t, odd, 0, name);
        FAIL(error, LAM_ERR_FORMAT,
             "%s: %s is %.4g h after the row before it; a step must be an hour over a divisor of 60", t->path,
             name, weather_ahead(&w->hours[odd - 1], &w->hours[odd], &back));
    }
    if (w->apart && w->n > 1) {
        const double step = long_step(w);
        w->apart = step == 0;
        if (step > 0) w->step = step;
    }
    if (!w->apart && (parts || t->stated == NULL)) TRY(check_steps(t, error));
    if (parts)
        take_parts(t);
    else if (t->stated != NULL)
        for (size_t i = 0; i < w->n; i++) w->hours[i].hour += .5;
done:
    return status;
}
