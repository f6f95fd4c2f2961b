/* Values of weather that are missing by day, from the rows beside them or from the same time of other days.
 */
#include "solver/daylight/weather_mend_steps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* One of the values of a row. */
static double *value_of(weather_hour *h, bool diffuse) {
    return diffuse ? &h->diffuse : &h->direct;
}

/* Hours between row i and the k-th row after it, or before it. */
static double hours_apart(const weather_hour *read, size_t i, size_t k, bool later) {
    bool back = false;
    return later ? weather_ahead(&read[i], &read[i + k], &back)
                 : weather_ahead(&read[i - k], &read[i], &back);
}

/* The value of the same time of the nearest day before or after row i that has it; NAN: none has it. Found by
 * bisection among the rows that the days can hold. */
static double same_time(const weather *w, weather_hour *read, size_t i, bool diffuse, bool later) {
    const double tolerance = weather_tolerance(w->step);
    const size_t there = later ? w->n - 1 - i : i, held = (size_t)(24 * WEATHER_DAYS / w->step + 1);
    for (int day = 1; day <= WEATHER_DAYS; day++) {
        size_t low = 1, high = (there < held ? there : held) + 1;
        while (low < high) {
            const size_t middle = low + (high - low) / 2;
            if (hours_apart(read, i, middle, later) < 24 * day - tolerance)
                low = middle + 1;
            else
                high = middle;
        }
        if (low > there || fabs(hours_apart(read, i, low, later) - 24 * day) > tolerance) continue;
        const double value = *value_of(&read[later ? i + low : i - low], diffuse);
        if (!isnan(value)) return value;
    }
    return NAN;
}

/* Fills the rows from first up to end, which lack a value; the values of read are those of the file. */
static lam_status fill_run(const weather_times *t, weather_hour *read, bool diffuse, size_t first, size_t end,
                           lam_error *error) {
    weather *w = t->w;
    const double most = WEATHER_BETWEEN + w->step + weather_tolerance(w->step);
    bool back = false;
    double apart = INFINITY;
    if (first > 0 && end < w->n) apart = weather_ahead(&read[first - 1], &read[end], &back);
    const bool is_short = !back && apart <= most;
    for (size_t i = first; i < end; i++) {
        double value = NAN;
        if (is_short) {
            const double share = weather_ahead(&read[first - 1], &read[i], &back) / apart;
            value =
                *value_of(&read[first - 1], diffuse) * (1 - share) + *value_of(&read[end], diffuse) * share;
        } else {
            const double before = same_time(w, read, i, diffuse, false);
            const double behind = same_time(w, read, i, diffuse, true);
            value = isnan(before) ? behind : isnan(behind) ? before : (before + behind) / 2;
        }
        if (isnan(value)) {
            char name[WEATHER_NAME];
            weather_name_row(t, i, weather_named_earlier(t), name);
            return status_fail(
                error, LAM_ERR_FORMAT,
                "%s: %s: %s radiation cannot be filled: the gap is longer than %d h, and no day "
                "within %d days has the value at this time; --gaps skip leaves it out",
                t->path, name, diffuse ? "diffuse" : "direct", WEATHER_BETWEEN, WEATHER_DAYS);
        }
        *value_of(&w->hours[i], diffuse) = value;
        *(is_short ? &w->mended.between : &w->mended.by_days) += w->step / 2; /* of two values */
    }
    return LAM_OK;
}

lam_status weather_fill_values(const weather_times *t, lam_error *error) {
    lam_status status = LAM_OK;
    weather *w = t->w;
    weather_hour *read = memory_allocate(w->n, sizeof *read, "the rows of weather", error);
    if (read == NULL) return LAM_ERR_MEMORY;
    memcpy(read, w->hours, w->n * sizeof *read);
    for (int diffuse = 0; diffuse < 2; diffuse++)
        for (size_t i = 0; i < w->n; i++) {
            size_t end = i;
            while (end < w->n && isnan(*value_of(&read[end], diffuse))) end++;
            if (end > i) TRY(fill_run(t, read, diffuse, i, end, error));
            i = end;
        }
done:
    free(read);
    return status;
}
