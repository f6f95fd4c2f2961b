#include "solver/light/weather_light.h"

#include "solver/daylight/weather.h"
#include "solver/daylight/weather_times.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

void weather_span_free(weather_span *s) {
    free(s->middle);
    free(s->begins);
    free(s->suns);
    *s = (weather_span){0};
}

void weather_skies_free(weather_skies *w) {
    weather_span_free(&w->span);
    free(w->L);
    free(w->suns);
    *w = (weather_skies){0};
}

static void log_weather(terminal *t, const weather *w) {
    const weather_hour *first = &w->hours[0], *last = &w->hours[w->n - 1];
    terminal_log(t, "%s: %.2f degrees %s, %.2f %s, UTC%+g", w->place[0] != '\0' ? w->place : "a place",
                 fabs(w->latitude), w->latitude < 0 ? "south" : "north", fabs(w->longitude),
                 w->longitude < 0 ? "west" : "east", w->time_zone);
    char rows[64] = "", stretches[48] = "";
    if (w->step != 1) snprintf(rows, sizeof rows, " in %zu rows of %.4g h", w->n, w->step);
    if (w->stretches > 1) snprintf(stretches, sizeof stretches, " in %zu stretches", w->stretches);
    terminal_log(t, "%.6g hours%s%s, %d-%02d-%02d to %d-%02d-%02d", (double)w->n * w->step, rows, stretches,
                 first->year, first->month, first->day, last->year, last->month, last->day);
    if (w->stated_steps > 0 && fabs((double)w->stated_steps * w->step - 1) > 1e-9)
        terminal_warn(t, "DATA PERIODS states %zu record%s an hour, but rows are %.4g h apart, which counts",
                      w->stated_steps, w->stated_steps == 1 ? "" : "s", w->step);
    if (w->outside > 0)
        terminal_warn(t, "%.6g hours are outside of the DATA PERIODS that the file states; they count too",
                      (double)w->outside * w->step);
    if (w->days_chosen)
        terminal_warn(t, "the file holds %.6g days of the DATA PERIODS that it states: these count alone",
                      (double)w->n * w->step / 24);
    if (w->apart && w->n > 1)
        terminal_warn(t, "no two rows are an hour apart or less: each stands for one hour");
    /* Clocks are set for political reasons, but not by more than this. */
    const double apart = remainder(w->time_zone * 15 - w->longitude, 360);
    if (fabs(apart) > 60)
        terminal_warn(t,
                      "the time zone UTC%+g is %.0f degrees from the longitude %g (east is positive here); "
                      "is a sign wrong in the file?",
                      w->time_zone, fabs(apart), w->longitude);
}

/* Says what was missing, and what became of it: a line each. */
static void log_mended(terminal *t, const weather *w, bool photometric) {
    const weather_mended *m = &w->mended;
    if (m->night + m->below > 0)
        terminal_log(t,
                     "values that count as 0: %zu, of which %zu are missing by night, %zu from -10 to 0 W/m2",
                     m->night + m->below, m->night, m->below);
    if (photometric && m->no_dew > 0)
        terminal_log(t, "rows without a dew point: %zu; the air holds 2 cm of water there", m->no_dew);
    if (m->repeated > 0)
        terminal_warn(t, "%zu repeated row%s dropped, of each time the later ones of the file", m->repeated,
                      m->repeated == 1 ? " is" : "s are");
    if (m->unordered > 0)
        terminal_warn(t, "%zu row%s put in the order of time", m->unordered,
                      m->unordered == 1 ? " is" : "s are");
    if (m->skipped > 0)
        terminal_warn(t, "%.6g hours are left out: sums lack them, and shares are of the other hours",
                      m->skipped);
    if (m->between + m->by_days + m->dark > 0)
        terminal_warn(t,
                      "%.6g hours are filled: %.6g from the rows beside the gap, %.6g from the same time of "
                      "other days, %.6g by night",
                      m->between + m->by_days + m->dark, m->between, m->by_days, m->dark);
}

/* Rows count by their duration, step hours each. */
static void log_year(terminal *t, const year_summary *sum, double step, bool photometric) {
    terminal_log(t, "%.6g hours with light, %.6g with sun", (double)sum->lit * step,
                 (double)sum->sunny * step);
    terminal_log(t, "on a horizontal plane: diffuse %.1f + direct %.1f = %.1f kWh/m2",
                 sum->diffuse * step * 1e-3, sum->direct * step * 1e-3,
                 (sum->diffuse + sum->direct) * step * 1e-3);
    if (photometric)
        terminal_log(t, "in light: %.0f klx h, %.1f lm/W", sum->light * step * 1e-3,
                     sum->light / (sum->diffuse + sum->direct));
    if (sum->sunless > 0)
        terminal_warn(t,
                      "%.6g hours have direct light (at most %g W/m2) though the sun is below the horizon in "
                      "their middle; it is left out",
                      (double)sum->sunless * step, sum->left_out);
}

/* The days of a year that has no 29 February are one fewer from March on. */
static void take_times(const weather *w, weather_span *span) {
    const int march = weather_day(3, 1);
    bool leap = false;
    for (size_t i = 0; i < w->n; i++) leap = leap || (w->hours[i].month == 2 && w->hours[i].day == 29);
    for (size_t i = 0; i < w->n; i++) {
        const int day = weather_day(w->hours[i].month, w->hours[i].day);
        span->middle[i] = w->hours[i].hour;
        span->begins[i] = 24. * (day - (!leap && day >= march)) + w->hours[i].hour - w->step / 2;
    }
}

lam_status weather_skies_read(const char *path, weather_gaps gaps, const moment *at, const sky_tiling *tiling,
                              const year_options *options, terminal *t, weather_skies *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    weather w = {0};
    weather_skies made = {0};
    year_summary sum = {0};
    size_t count = 0;
    const progress steps = terminal_progress(t);
    TRY(weather_read(path, gaps, &w, error));
    if (at != NULL) TRY(moment_pick(at, path, &w, error));
    if (!size_multiply(w.n, tiling->n_tiles, &count))
        FAIL(error, LAM_ERR_MEMORY, "%s: too many hours of tiles for memory", path);
    made.n = w.n;
    made.L = memory_allocate(count, sizeof *made.L, "the skies", error);
    made.suns = memory_allocate(w.n, sizeof *made.suns, "the suns", error);
    made.span = (weather_span){.n = w.n, .step = w.step, .apart = w.apart, .mended = w.mended};
    made.span.middle = memory_allocate(w.n, sizeof *made.span.middle, "the times of weather", error);
    made.span.begins = memory_allocate(w.n, sizeof *made.span.begins, "the times of weather", error);
    if (made.L == NULL || made.suns == NULL || made.span.middle == NULL || made.span.begins == NULL)
        TRY(LAM_ERR_MEMORY);
    take_times(&w, &made.span);
    TRY(year_skies(&w, tiling, options, &steps, made.L, made.suns, &sum, error));
    if (sum.lit == 0 && at != NULL) {
        char name[MOMENT_BYTES];
        moment_name(at, name);
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the sky is dark at %s", path, name);
    }
    if (sum.lit == 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: the sky is dark all year: of %.6g hours none has diffuse light, nor direct light of a sun "
             "above the horizon; see its latitude, longitude and time zone, and whether it holds radiation",
             path, (double)w.n * w.step);
    terminal_clear(t);
    log_weather(t, &w);
    if (at != NULL) {
        const long from = lround(60 * (w.hours[0].hour - w.step / 2)),
                   to = lround(60 * (w.hours[0].hour + w.step / 2));
        terminal_log(t, "the row from %02ld:%02ld to %02ld:%02ld", from / 60, from % 60, to / 60, to % 60);
    }
    log_mended(t, &w, options->photometric);
    log_year(t, &sum, w.step, options->photometric);
    *out = made;
    made = (weather_skies){0};
done:
    weather_skies_free(&made);
    weather_free(&w);
    return status;
}

lam_status weather_tiling_load(store *s, const lam_sky *sky, sky_tiling *out, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling made = {0};
    TRY(sky_tiling_of_store(s, &made, error));
    if (made.n_tiles != lam_sky_tiles(sky))
        FAIL(error, LAM_ERR_FORMAT, "%s: /sky has %zu tiles, %s has %zu", store_path(s), lam_sky_tiles(sky),
             made.name, made.n_tiles);
    *out = made;
    made = (sky_tiling){0};
done:
    sky_tiling_free(&made);
    return status;
}

/* The ways to the suns of weather, in the axes of a tiling; the caller frees. */
static lam_status take_suns(const weather_skies *w, const sky_tiling *tiling, double (**out)[3],
                            lam_error *error) {
    double(*suns)[3] = memory_allocate(w->n, sizeof *suns, "the suns", error);
    if (suns == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < w->n; v++)
        for (int d = 0; d < 3 && w->suns[v].horizontal > 0; d++)
            suns[v][tiling->axis[d]] = (double)tiling->sign[d] * w->suns[v].direction[d];
    *out = suns;
    return LAM_OK;
}

lam_status weather_light_add(const weather_options *options, store *s, const mesh *m, const lam_operator *op,
                             const lam_sky *sky, size_t n_selected, const uint32_t *selected, terminal *t,
                             emission *e, sunlight *sun, weather_span *span, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling = {0};
    weather_skies made = {0};
    /* Few emitters answer nothing but their tiles: the sun bounces from those. */
    const bool few = lam_operator_emitters(op) > 0, batch = e->batch;
    const bool alone = options->at_sensors, by_tile = few || alone;
    if (sky == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--weather %s: the store has no sky; precompute it with --sky",
             options->path);
    TRY(weather_tiling_load(s, sky, &tiling, error));
    const year_options year = {.photometric = options->photometric,
                               .sun_in_tiles = by_tile || !options->exact,
                               .north = options->north};
    TRY(weather_skies_read(options->path, options->gaps, options->at, &tiling, &year, t, &made, error));
    TRY(emission_add_skies(e, options->path, m, tiling.n_tiles, made.n, made.L, error));
    e->efficacies = options->photometric;
    if (options->at != NULL) e->batch = batch;
    if (e->n_vectors != made.n)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: 1 hour beside %zu emissions", options->path, e->n_vectors);
    *span = made.span;
    made.span = (weather_span){0};
    TRY(take_suns(&made, &tiling, &span->suns, error));
    if (options->way != NULL) {
        const progress steps = terminal_progress(t);
        TRY(sun_way_measure(s, m, sky, made.suns, made.n, options->exact && !alone ? options->sun_points : 0,
                            n_selected, selected, &steps, options->way, error));
        terminal_clear(t);
    }
    if (!options->exact) goto done;
    year_sun *suns = made.suns;
    made.suns = NULL;
    TRY(sunlight_create(s, m, suns, made.n, alone ? 0 : options->sun_points, few ? n_selected : 0,
                        few ? selected : NULL, by_tile ? sky : NULL, sun, error));
    e->sun = sun;
    if (alone)
        terminal_log(t, "the sun: a ray per sensor and hour; its reflected light is that of its tile, unless "
                        "--sun exact is given");
    if (alone) goto done;
    terminal_log(t,
                 few ? "the sun: %zu rays per element and hour; its reflected light is that of its tile, "
                       "because the store has few emitters"
                     : "the sun: %zu rays per element and hour, through all bounces",
                 options->sun_points);
done:
    weather_skies_free(&made);
    sky_tiling_free(&tiling);
    return status;
}
