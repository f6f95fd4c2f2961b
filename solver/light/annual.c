/* A sum over the year is n hours / 1000 times the answer to the mean vector, as answers are linear. A share
 * is (hours with low <= x <= high) / (hours that count), the daylight autonomy or useful daylight of
 * annual.h, or / (half of all hours) where it is of daylight; with fewer tiles than hours, x_h = x_E + sum_t
 * L_ht x_t + x_h,sun from one answer x_t for each tile, and one x_h,sun for each hour with an exact sun; the
 * sum is limited, not its parts, as an answer to the hour would be. */
#include "solver/light/annual.h"

#include "solver/codec/answer.h"
#include "solver/light/annual_sun.h"
#include "solver/light/sunlight.h"
#include "solver/linalg/dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AT_ONCE = 64 }; /* vectors in one go */

/* Hours of the day are not exact: a middle that is this close below a bound is on it. */
#define EARLIER 1e-3

static bool is_share(const annual_figure *f) {
    return !f->is_sum && !f->is_sun;
}

bool annual_has_shares(const annual_options *w) {
    for (size_t k = 0; k < w->n_figures; k++)
        if (is_share(&w->figures[k])) return true;
    return false;
}

bool annual_has_sun(const annual_options *w) {
    for (size_t k = 0; k < w->n_figures; k++)
        if (w->figures[k].is_sun) return true;
    return false;
}

bool annual_has_sum(const annual_options *w) {
    for (size_t k = 0; k < w->n_figures; k++)
        if (w->figures[k].is_sum) return true;
    return false;
}

static bool all_count(const annual_options *w) {
    return w->from == 0 && w->to == 24;
}

static bool counts(const annual_options *w, size_t vector) {
    if (all_count(w)) return true;
    const double middle = w->middle != NULL ? w->middle[vector] : fmod(((double)vector + .5) * w->hours, 24);
    return middle >= w->from - EARLIER && middle < w->to - EARLIER;
}

/* Hours of the day need a batch that begins at midnight and holds whole days, unless times are known. */
static lam_status check_days(const annual_options *w, size_t n, lam_error *error) {
    lam_status status = LAM_OK;
    const double a_day = 24 / w->hours;
    if (all_count(w) || w->middle != NULL) goto done;
    if (fabs(a_day - round(a_day)) > 1e-9 * a_day)
        FAIL(error, LAM_ERR_ARGUMENT, "--occupied: vectors of %g hours do not make days of 24", w->hours);
    if (n % (size_t)round(a_day) != 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--occupied: %zu vectors of %g hours are not whole days; it takes %zu a day, from midnight on",
             n, w->hours, (size_t)round(a_day));
done:
    return status;
}

/* Daylight is half of the hours of a year, not of a part of it. */
static lam_status check_year(const annual_options *w, size_t n, lam_error *error) {
    const double hours = (double)n * w->hours;
    for (size_t k = 0; k < w->n_figures; k++) {
        if (!w->figures[k].of_daylight) continue;
        if (!all_count(w))
            return status_fail(error, LAM_ERR_ARGUMENT,
                               "--annual daylit: is of all hours of a year, without --occupied");
        if (!(hours > 364.5 * 24 && hours < 366.5 * 24))
            return status_fail(
                error, LAM_ERR_ARGUMENT,
                "--annual daylit: is of a whole year; these are %zu vectors of %g h, %.4g days", n, w->hours,
                hours / 24);
    }
    return LAM_OK;
}

static bool any(const float *x, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (x[i] != 0) return true;
    return false;
}

/* The numbers of one vector in E, L, W and D. */
typedef struct widths {
    size_t E, L, W, D;
} widths;

static widths widths_of(const emission *light, const lam_operator *op, const lam_sky *sky) {
    const size_t C = lam_operator_channels(op);
    return (widths){.E = C * lam_operator_elements(op),
                    .L = sky != NULL ? C * lam_sky_tiles(sky) : 0,
                    .W = C * lam_operator_emitters(op),
                    .D = light->D != NULL ? C * lam_luminaires_count(light->luminaires) : 0};
}

static bool is_lit(const emission *light, const widths *width, size_t v) {
    const size_t one = light->steady ? 0 : v;
    return any(light->E + one * width->E, width->E) ||
           (light->sun != NULL && sunlight_shines(light->sun, v)) ||
           (light->L != NULL && any(light->L + v * width->L, width->L)) ||
           (light->W != NULL && any(light->W + one * width->W, width->W)) ||
           (light->D != NULL && any(light->D + one * width->D, width->D));
}

/* The mean of n rows, summed in double; *out is freed with free(), NULL where there are none. */
static lam_status mean_row(size_t n, size_t width, const float *rows, float **out, lam_error *error) {
    lam_status status = LAM_OK;
    double *sum = NULL;
    *out = NULL;
    if (rows == NULL) goto done;
    sum = memory_allocate(width, sizeof *sum, "the sum of a year", error);
    *out = memory_allocate(width, sizeof **out, "the sum of a year", error);
    if (sum == NULL || *out == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < n; v++)
        for (size_t i = 0; i < width; i++) sum[i] += (double)rows[v * width + i];
    for (size_t i = 0; i < width; i++) (*out)[i] = (float)(sum[i] / (double)n);
done:
    free(sum);
    return status;
}

/* A vector that is the mean of all. */
static lam_status mean_of(const emission *light, const widths *width, emission *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = light->steady ? 1 : light->n_vectors;
    emission e = {.n_vectors = 1, .luminaires = light->luminaires, .sensors = light->sensors};
    TRY(mean_row(n, width->E, light->E, &e.E, error));
    TRY(mean_row(light->n_vectors, width->L, light->L, &e.L, error));
    TRY(mean_row(n, width->W, light->W, &e.W, error));
    TRY(mean_row(n, width->D, light->D, &e.D, error));
    *out = e;
    e = (emission){0};
done:
    emission_free(&e);
    return status;
}

void annual_mean_free(annual_mean *m) {
    emission_free(&m->light);
    sunlight_free(&m->sun);
    *m = (annual_mean){.light = {.n_vectors = 0}};
}

lam_status annual_mean_find(const emission *light, const lam_operator *op, const lam_sky *sky,
                            const progress *steps, annual_mean *out, lam_error *error) {
    lam_status status = LAM_OK;
    const widths width = widths_of(light, op, sky);
    *out = (annual_mean){.light = {.n_vectors = 0}};
    TRY(mean_of(light, &width, &out->light, error));
    out->light.limiter = light->limiter;
    if (light->sun == NULL) goto done;
    TRY(sunlight_mean(light->sun, steps, &out->sun, error));
    out->light.sun = &out->sun;
done:
    if (status != LAM_OK) annual_mean_free(out);
    return status;
}

/* An answer under way. */
typedef struct work {
    const annual_options *options;
    const lam_operator *op;
    const lam_sky *sky;
    lam_quantity quantity;
    size_t n_selected;
    const uint32_t *selected;
    const progress *steps;
    size_t row;  /* numbers of an answer: C times the elements wanted */
    size_t told; /* numbers of a figure: row, or the elements where it is of the luminance */
    float *made; /* [n_figures][told] */
} work;

static lam_status make_sums(const work *w, const emission *light, lam_error *error) {
    lam_status status = LAM_OK;
    const double scale = (double)light->n_vectors * w->options->hours / 1000;
    const emission *mean = w->options->mean;
    annual_mean found = {.light = {.n_vectors = 0}};
    emission_pass p = {0};
    float *x = memory_allocate(1, w->row * sizeof *x, "the sum of a year", error);
    if (x == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < w->options->n_figures; k++) {
        if (!w->options->figures[k].is_sum) continue;
        float *to = w->made + k * w->told;
        if (mean == NULL) {
            TRY(annual_mean_find(light, w->op, w->sky, w->steps, &found, error));
            mean = &found.light;
        }
        TRY(emission_pass_create(mean, w->op, w->sky, w->quantity, w->n_selected, w->selected, 1, &p, error));
        TRY(emission_pass_solve(&p, 1, (const size_t[]){0}, x, error));
        if (w->options->luminance) answer_luminance(1, w->told, x);
        for (size_t i = 0; i < w->told; i++) to[i] = (float)((double)x[i] * scale);
    }
done:
    free(x);
    emission_pass_free(&p);
    annual_mean_free(&found);
    return status;
}

/* The answers to all tiles of a sky and to a steady emission beside it, of which the answer to any hour is a
 * sum: x_h = x_E + sum_t L_ht x_t, and the answer to its sun. */
typedef struct tile_answers {
    size_t terms; /* tiles + 1; 0: hours are answered one by one */
    float *x;     /* [C][terms][width], the emission last */
    float *share; /* [AT_ONCE][terms], of one channel */
    float *mixed; /* [AT_ONCE][width], of one channel */
    float *whole; /* [AT_ONCE][row], of all channels */
    float *dark;  /* [C][n], the emission of suns */
    emission suns;
    emission_pass by_suns; /* of suns alone */
    float *sunny;          /* [AT_ONCE][row], answers to suns; NULL: there are none */
    bool below_zero;       /* some answers are, and sums of them are limited by the next */
    emission_pass limits;
} tile_answers;

static void tile_answers_free(tile_answers *a) {
    free(a->x);
    free(a->share);
    free(a->mixed);
    free(a->whole);
    emission_pass_free(&a->by_suns);
    emission_pass_free(&a->limits);
    free(a->dark);
    free(a->sunny);
    *a = (tile_answers){.terms = 0};
}

/* Tiles are answered first where there are fewer of them than hours, and their answers take no more than
 * this.
 */
static const double mixed_bytes = 0x1p30;

static bool worth_mixing(const work *w, const emission *light, size_t n_vectors) {
    if (light->L == NULL || !light->steady || lam_operator_emitters(w->op) > 0) return false;
    const double terms = (double)lam_sky_tiles(w->sky) + 1;
    return terms < (double)n_vectors && terms * (double)w->row * sizeof(float) <= mixed_bytes;
}

/* Answers n vectors of light and puts them behind the terms that are there, not limited. Sums of them are to
 * be limited where they would be. */
static lam_status add_answers(const work *w, const emission *light, size_t n, const lam_limiter *limiter,
                              tile_answers *a, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = lam_operator_channels(w->op), width = w->row / C, terms = lam_sky_tiles(w->sky) + 1;
    const size_t most = n < AT_ONCE ? n : AT_ONCE;
    emission limited = *light;
    emission_pass p = {0}, q = {0};
    size_t vectors[AT_ONCE];
    float *x = memory_allocate(most, w->row * sizeof *x, "answers to tiles", error);
    float *y = memory_allocate(most, w->row * sizeof *y, "answers to tiles", error);
    if (x == NULL || y == NULL) TRY(LAM_ERR_MEMORY);
    limited.limiter = limiter;
    TRY(emission_pass_create(light, w->op, w->sky, w->quantity, w->n_selected, w->selected, most, &p, error));
    TRY(emission_pass_create(&limited, w->op, w->sky, w->quantity, w->n_selected, w->selected, most, &q,
                             error));
    for (size_t first = 0; first < n; first += most) {
        const size_t now = n - first < most ? n - first : most;
        if (progress_cancelled(w->steps)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(w->steps, "tiles", (double)first / (double)n);
        for (size_t k = 0; k < now; k++) vectors[k] = first + k;
        TRY(emission_pass_solve(&p, now, vectors, x, error));
        if (limiter != NULL) {
            memcpy(y, x, now * w->row * sizeof *y);
            emission_pass_limit(&q, now, vectors, y);
            for (size_t k = 0; k < now; k++) a->below_zero = a->below_zero || q.limited[k] > 0;
        }
        for (size_t k = 0; k < now; k++)
            for (size_t c = 0; c < C; c++)
                memcpy(a->x + (c * terms + a->terms + k) * width, x + (k * C + c) * width, width * sizeof *x);
        a->terms += now;
    }
done:
    emission_pass_free(&p);
    emission_pass_free(&q);
    free(x);
    free(y);
    return status;
}

/* Readies *a, which stays where it is, for the suns of light. */
static lam_status add_suns(const work *w, const emission *light, tile_answers *a, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = lam_operator_channels(w->op), n = lam_operator_elements(w->op);
    if (light->sun == NULL) return LAM_OK;
    a->dark = memory_allocate(C * n, sizeof *a->dark, "answers to suns", error);
    a->sunny = memory_allocate(AT_ONCE, w->row * sizeof *a->sunny, "answers to suns", error);
    if (a->dark == NULL || a->sunny == NULL) TRY(LAM_ERR_MEMORY);
    a->suns = (emission){.n_vectors = light->n_vectors,
                         .steady = true,
                         .E = a->dark,
                         .sun = light->sun,
                         .sensors = light->sensors};
    TRY(emission_pass_create(&a->suns, w->op, w->sky, w->quantity, w->n_selected, w->selected, AT_ONCE,
                             &a->by_suns, error));
    a->below_zero = light->limiter != NULL;
done:
    return status;
}

static lam_status tile_answers_make(const work *w, const emission *light, tile_answers *out,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = lam_operator_channels(w->op), n = lam_operator_elements(w->op);
    const size_t m = lam_sky_tiles(w->sky), terms = m + 1, width = w->row / C;
    tile_answers a = {.terms = 0};
    float *dark = memory_allocate(C * n, sizeof *dark, "answers to tiles", error);
    float *units = memory_allocate(m + 1, C * m * sizeof *units, "answers to tiles", error);
    a.x = memory_allocate(terms, w->row * sizeof *a.x, "answers to tiles", error);
    a.share = memory_allocate(AT_ONCE, terms * sizeof *a.share, "answers to tiles", error);
    a.mixed = memory_allocate(AT_ONCE, width * sizeof *a.mixed, "answers to tiles", error);
    a.whole = memory_allocate(AT_ONCE, w->row * sizeof *a.whole, "answers to tiles", error);
    if (dark == NULL || units == NULL || a.x == NULL || a.share == NULL || a.mixed == NULL || a.whole == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < m; t++)
        for (size_t c = 0; c < C; c++) units[(t * C + c) * m + t] = 1;
    const emission tiles = {.n_vectors = m, .steady = true, .E = dark, .L = units, .sensors = light->sensors},
                   lamps = {.n_vectors = 1,
                            .steady = true,
                            .E = light->E,
                            .L = units + m * C * m,
                            .D = light->D,
                            .luminaires = light->luminaires,
                            .sensors = light->sensors};
    TRY(add_answers(w, &tiles, m, light->limiter, &a, error));
    TRY(add_answers(w, &lamps, 1, light->limiter, &a, error));
    *out = a;
    a = (tile_answers){.terms = 0};
done:
    tile_answers_free(&a);
    free(dark);
    free(units);
    return status;
}

/* The least float from a number on, and the greatest up to it: floats compare with these as with it. */
static float float_from(double x) {
    const float nearest = (float)x;
    return (double)nearest < x ? nextafterf(nearest, INFINITY) : nearest;
}

static float float_up_to(double x) {
    const float nearest = (float)x;
    return (double)nearest > x ? nextafterf(nearest, -INFINITY) : nearest;
}

/* Counts the hours of n answers x [n][width] that a figure takes. */
static void count_hours(const annual_figure *f, size_t n, size_t width, const float *restrict x,
                        uint32_t *restrict count) {
    const float low = float_from(f->low), high = float_up_to(f->high);
    for (size_t k = 0; k < n; k++)
#pragma omp simd
        for (size_t i = 0; i < width; i++) count[i] += (x[k * width + i] >= low) & (x[k * width + i] <= high);
}

static void count_all(const work *w, size_t n, size_t width, const float *x, uint32_t *count) {
    for (size_t k = 0; k < w->options->n_figures; k++)
        if (is_share(&w->options->figures[k]))
            count_hours(&w->options->figures[k], n, width, x, count + k * w->told);
}

/* Answers the suns of those of n hours in which one shines. sunny [n]: its place among these answers, or n.
 */
static lam_status answer_suns(tile_answers *a, size_t n, const size_t *vectors, size_t *sunny,
                              lam_error *error) {
    size_t shining[AT_ONCE], n_shining = 0;
    for (size_t k = 0; k < n; k++) {
        const bool shines = a->sunny != NULL && sunlight_shines(a->suns.sun, vectors[k]);
        sunny[k] = shines ? n_shining : n;
        if (shines) shining[n_shining++] = vectors[k];
    }
    return n_shining > 0 ? emission_pass_solve(&a->by_suns, n_shining, shining, a->sunny, error) : LAM_OK;
}

/* Counts n hours that are sums of the answers to tiles and to their suns. */
static lam_status count_mixed(const work *w, const emission *light, tile_answers *a, size_t n,
                              const size_t *vectors, uint32_t *count, lam_error *error) {
    lam_status status = LAM_OK;
    size_t sunny[AT_ONCE];
    const size_t C = lam_operator_channels(w->op), m = a->terms - 1, width = w->row / C;
    TRY(answer_suns(a, n, vectors, sunny, error));
    for (size_t c = 0; c < C; c++) {
        for (size_t k = 0; k < n; k++) {
            memcpy(a->share + k * a->terms, light->L + (vectors[k] * C + c) * m, m * sizeof *a->share);
            a->share[k * a->terms + m] = 1;
        }
        dense_multiply(n, a->terms, width, a->share, a->x + c * a->terms * width, false,
                       C == 1 ? a->whole : a->mixed);
        for (size_t k = 0; k < n; k++) {
            float *const x = a->whole + (k * C + c) * width;
            if (C > 1) memcpy(x, a->mixed + k * width, width * sizeof *x);
            if (sunny[k] == n) continue;
            const float *by_sun = a->sunny + (sunny[k] * C + c) * width;
            for (size_t i = 0; i < width; i++) x[i] += by_sun[i];
        }
    }
    if (a->below_zero) emission_pass_limit(&a->limits, n, vectors, a->whole);
    if (w->options->luminance) answer_luminance(n, w->told, a->whole);
    count_all(w, n, w->told, a->whole, count);
done:
    return status;
}

static lam_status make_shares(const work *w, const emission *light, const size_t *vectors, size_t n_vectors,
                              annual_summary *sum, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_figures = w->options->n_figures, most = n_vectors < AT_ONCE ? n_vectors : AT_ONCE;
    const size_t dark = sum->counted - n_vectors;
    const bool mixed = worth_mixing(w, light, n_vectors);
    emission_pass p = {0};
    tile_answers tiles = {.terms = 0};
    uint32_t *count = memory_allocate(n_figures, w->told * sizeof *count, "hours", error);
    float *x = memory_allocate(most + 1, w->row * sizeof *x, "hours", error);
    if (count == NULL || x == NULL) TRY(LAM_ERR_MEMORY);
    if (mixed) {
        TRY(tile_answers_make(w, light, &tiles, error));
        TRY(add_suns(w, light, &tiles, error));
        if (tiles.below_zero)
            TRY(emission_pass_create(light, w->op, w->sky, w->quantity, w->n_selected, w->selected, AT_ONCE,
                                     &tiles.limits, error));
    } else if (n_vectors > 0)
        TRY(emission_pass_create(light, w->op, w->sky, w->quantity, w->n_selected, w->selected, most, &p,
                                 error));
    for (size_t first = 0; first < n_vectors; first += most) {
        const size_t left = n_vectors - first, now = left < most ? left : most;
        if (progress_cancelled(w->steps)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(w->steps, "hours", (double)first / (double)n_vectors);
        if (mixed) {
            TRY(count_mixed(w, light, &tiles, now, vectors + first, count, error));
            continue;
        }
        TRY(emission_pass_solve(&p, now, vectors + first, x, error));
        if (w->options->luminance) answer_luminance(now, w->told, x);
        count_all(w, now, w->told, x, count);
    }
    for (size_t k = 0; k < n_figures; k++) {
        const annual_figure *f = &w->options->figures[k];
        const size_t always = f->low <= 0 ? dark : 0; /* hours of exactly 0 */
        const double of = f->of_daylight ? .5 * (double)sum->n : (double)sum->counted;
        for (size_t i = 0; i < w->told && is_share(f); i++)
            w->made[k * w->told + i] = (float)fmin((double)(count[k * w->told + i] + always) / of, 1);
    }
done:
    emission_pass_free(&p);
    tile_answers_free(&tiles);
    free(count);
    free(x);
    return status;
}

lam_status annual_apply(const annual_options *options, const emission *light, const lam_operator *op,
                        const lam_sky *sky, lam_quantity quantity, size_t n_selected,
                        const uint32_t *selected, const progress *steps, float **values,
                        annual_summary *summary, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t C = options->luminance ? 1 : lam_operator_channels(op), n = emission_width(light, op);
    const size_t wanted = selected != NULL ? n_selected : n;
    const widths width = widths_of(light, op, sky);
    annual_summary sum = {.n = light->n_vectors};
    work w = {.options = options,
              .op = op,
              .sky = sky,
              .quantity = quantity,
              .n_selected = n_selected,
              .selected = selected,
              .steps = steps,
              .row = lam_operator_channels(op) * wanted,
              .told = C * wanted};
    size_t *lit = NULL, n_lit = 0; /* vectors that are lit and count */
    float *whole = NULL;
    TRY(check_days(options, light->n_vectors, error));
    TRY(check_year(options, light->n_vectors, error));
    lit = memory_allocate(light->n_vectors, sizeof *lit, "hours", error);
    w.made = memory_allocate(options->n_figures, w.told * sizeof *w.made, "figures of the year", error);
    if (lit == NULL || w.made == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < light->n_vectors; v++) {
        const bool shines = is_lit(light, &width, v), counted = counts(options, v);
        sum.counted += counted;
        sum.lit += shines;
        if (shines && counted) lit[n_lit++] = v;
    }
    if (sum.counted == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--occupied %g-%g: no vector of %g hours has its middle in these hours",
             options->from, options->to, options->hours);
    TRY(make_sums(&w, light, error));
    if (annual_has_shares(options)) TRY(make_shares(&w, light, lit, n_lit, &sum, error));
    if (annual_has_sun(options))
        TRY(annual_sun_find(options, light->sun, n_lit, lit, wanted, selected, C, steps, w.made, error));
    if (selected != NULL) {
        whole = memory_allocate(options->n_figures * C, n * sizeof *whole, "figures of the year", error);
        if (whole == NULL) TRY(LAM_ERR_MEMORY);
        emission_scatter(options->n_figures * C, n, n_selected, selected, w.made, whole);
    }
    *values = selected != NULL ? whole : w.made;
    *summary = sum;
done:
    if (status != LAM_OK || selected != NULL) free(w.made);
    if (status != LAM_OK) free(whole);
    free(lit);
    return status;
}
