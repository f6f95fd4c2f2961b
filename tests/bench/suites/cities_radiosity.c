/* Figures 4.5 and 4.10 of the thesis: the light of the sky by a sparse inverse, element by element and tile
 * by tile. */
#include "tests/bench/suites/cities.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/relaxation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { RAYS = 4096, POINTS = 120, WAYS = 3 };

/* Corrections of a sparse inverse. */
static const char *const ways[WAYS] = {"none", "delta", "discarded"};

/* Means over the tiles for every element: the converged radiosity, and E + R F E of the first two bounces. */
typedef struct mean_light {
    double *B, *first; /* [n] */
} mean_light;

static void mean_light_free(mean_light *l) {
    free(l->B);
    free(l->first);
}

static lam_status mean_light_make(const city *c, const city_light *d, mean_light *out, lam_error *error) {
    const size_t n = c->m.n;
    double *E = memory_allocate(n, sizeof *E, "light", error);
    out->B = memory_allocate(n, sizeof *out->B, "light", error);
    out->first = memory_allocate(n, sizeof *out->first, "light", error);
    const bool ready = E != NULL && out->B != NULL && out->first != NULL;
    for (size_t k = 0; ready && k < d->m * n; k++) {
        E[k % n] += (double)d->E[k] / (double)d->m;
        out->B[k % n] += d->B[k] / (double)d->m;
    }
    if (ready) csr_multiply_rows(&c->f.F, 0, n, 1, E, out->first);
    for (size_t i = 0; ready && i < n; i++)
        out->first[i] = E[i] + (double)c->m.reflectance[i] * out->first[i];
    free(E);
    return ready ? LAM_OK : LAM_ERR_MEMORY;
}

/* The mean over the tiles of the radiosity by M~ without a correction. */
static lam_status mean_answer(const bench_run *run, const city *c, const city_light *d, double threshold,
                              double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n;
    build_report report;
    lam_operator *op = NULL;
    float *answers = memory_allocate(d->m, n * sizeof *answers, "answers", error);
    if (answers == NULL) return LAM_ERR_MEMORY;
    TRY(city_sparse(run, c, threshold, ways[0], &op, &report, error));
    TRY(city_light_answer(d, op, answers, error));
    for (size_t i = 0; i < n; i++) B[i] = 0;
    for (size_t k = 0; k < d->m * n; k++) B[k % n] += (double)answers[k] / (double)d->m;
done:
    lam_operator_close(op);
    free(answers);
    return status;
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Figure 4.5: B and S = B - E - R F E, each sorted by value, at POINTS places from the least to the greatest.
 */
static lam_status add_curves(const city *c, double threshold, const double *B, const double *first,
                             table *out, lam_error *error) {
    const size_t n = c->m.n;
    double *sorted = memory_allocate(2 * n, sizeof *sorted, "light", error);
    if (sorted == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) {
        sorted[i] = B[i];
        sorted[n + i] = B[i] - first[i];
    }
    for (int s = 0; s < 2; s++) qsort(sorted + (s > 0 ? n : 0), n, sizeof *sorted, by_value);
    for (size_t p = 0; p < POINTS; p++) {
        const size_t at = p * (n - 1) / (POINTS - 1);
        table_number(out, c->variant);
        table_number(out, (double)n);
        table_number(out, threshold);
        table_number(out, 100 * (double)p / (POINTS - 1));
        table_number(out, sorted[at]);
        table_number(out, sorted[n + at]);
    }
    free(sorted);
    return LAM_OK;
}

/* The area-weighted mean. */
static double mean_of(const city *c, const double *x) {
    double sum = 0, all = 0;
    for (size_t i = 0; i < c->m.n; i++) {
        sum += c->m.area[i] * x[i];
        all += c->m.area[i];
    }
    return sum / all;
}

static double root_square(const city *c, const double *x, const double *less) {
    double sum = 0, all = 0;
    for (size_t i = 0; i < c->m.n; i++) {
        const double e = x[i] - (less != NULL ? less[i] : 0);
        sum += c->m.area[i] * e * e;
        all += c->m.area[i];
    }
    return sqrt(sum / all);
}

/* S is a work area. */
static void add_light_row(const city *c, double threshold, const mean_light *l, const double *B, double *S,
                          table *out) {
    for (size_t i = 0; i < c->m.n; i++) S[i] = B[i] - l->first[i];
    table_number(out, c->variant);
    table_number(out, (double)c->m.n);
    table_number(out, threshold);
    table_number(out, mean_of(c, B));
    table_number(out, mean_of(c, S));
    const double missing = root_square(c, l->B, B);
    for (size_t i = 0; i < c->m.n; i++) S[i] = l->B[i] - l->first[i];
    table_number(out, missing / root_square(c, l->B, NULL));
    table_number(out, missing / root_square(c, S, NULL));
}

static lam_status light_of_city(const bench_run *run, const city *c, const city_light *d, table *out,
                                table *curves, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n;
    mean_light l = {.B = NULL};
    double *B = memory_allocate(n, sizeof *B, "light", error);
    double *room = memory_allocate(n, sizeof *room, "light", error);
    if (B == NULL || room == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mean_light_make(c, d, &l, error));
    add_light_row(c, NAN, &l, l.B, room, out);
    TRY(add_curves(c, NAN, l.B, l.first, curves, error));
    for (size_t k = 0; k < CITY_THRESHOLDS; k++) {
        TRY(mean_answer(run, c, d, city_thresholds[k], B, error));
        add_light_row(c, city_thresholds[k], &l, B, room, out);
        TRY(add_curves(c, city_thresholds[k], B, l.first, curves, error));
    }
done:
    mean_light_free(&l);
    free(B);
    free(room);
    return status;
}

static lam_status tiles_of_city(const bench_run *run, const city *c, const city_light *d, table *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const size_t m = d->m;
    lam_operator *op = NULL;
    double *room = memory_allocate(WAYS + 1, m * sizeof *room, "errors", error);
    if (room == NULL) return LAM_ERR_MEMORY;
    double *const errors[WAYS] = {room, room + m, room + 2 * m};
    for (size_t k = 0; k < CITY_THRESHOLDS; k++) {
        for (size_t way = 0; way < WAYS; way++) {
            build_report report;
            TRY(city_sparse(run, c, city_thresholds[k], ways[way], &op, &report, error));
            TRY(city_light_errors(c, d, op, errors[way], room + 3 * m, error));
            lam_operator_close(op);
            op = NULL;
        }
        for (size_t t = 0; t < m; t++) {
            table_number(out, c->variant);
            table_number(out, (double)c->m.n);
            table_number(out, city_thresholds[k]);
            table_number(out, (double)(t + 1));
            for (size_t way = 0; way < WAYS; way++) table_number(out, errors[way][t]);
        }
    }
done:
    lam_operator_close(op);
    free(room);
    return status;
}

/* Iterations beside the sparse inverse, under a sky whose tiles are all alike. */
static lam_status relax_city(const bench_run *run, const city *c, const city_light *d, table *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n;
    char name[16];
    float *E = memory_allocate(n, sizeof *E, "light", error);
    if (E == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < d->m * n; k++) E[k % n] += d->E[k];
    snprintf(name, sizeof name, "city %u", c->variant);
    const relaxation_case of = {.scene = name, .problem = &c->problem, .E = E};
    TRY(relaxation_add(run, &of, out, error));
    for (size_t k = 0; k < CITY_THRESHOLDS; k++)
        TRY(relaxation_add_operator(run, &of, "sparse", "threshold", city_thresholds[k], out, error));
done:
    free(E);
    return status;
}

static lam_status look_at(const bench_run *run, unsigned variant, size_t size, table *light, table *curves,
                          table *relaxed, table *tiles, lam_error *error) {
    lam_status status = LAM_OK;
    const recipe rays = formfactors_rays(RAYS, run->seed);
    city c = {0};
    city_light d = {.m = 0};
    TRY(city_open(run, variant, size, "flat", &rays, &c, error));
    TRY(city_light_make(run, &c, &d, error));
    if (light != NULL) TRY(light_of_city(run, &c, &d, light, curves, error));
    if (relaxed != NULL) TRY(relax_city(run, &c, &d, relaxed, error));
    if (tiles != NULL) TRY(tiles_of_city(run, &c, &d, tiles, error));
done:
    city_light_free(&d);
    city_free(&c);
    return status;
}

lam_status cities_radiosity(const bench_run *run, lam_error *error) {
    static const table_column many_lights_input[] = {
        {"city", "", "1: flat houses, 3: with skyscrapers"},
        {"elements", "", "n"},
        {"threshold", "", "threshold of M~ without a correction; empty: converged"},
        {"B", "W/m^2", "radiosity, mean over elements and over tiles of 1 W/(m^2 sr), each alone"},
        {"S", "W/m^2", "likewise of the third and later bounces, B - E - R F E"},
        {"error_B", "", "|B~ - B|/|B| of the mean over the tiles"},
        {"error_S", "", "|S~ - S|/|S| likewise"}};
    static const table_column curve_columns[] = {
        {"city", "", "1: flat houses, 3: with skyscrapers"},
        {"elements", "", "n"},
        {"threshold", "", "threshold of M~; empty: converged"},
        {"place", "%", "share of the elements with a value of at most B, and with one of at most S"},
        {"B", "W/m^2", "mean over the tiles, as in the table bounces"},
        {"S", "W/m^2", "likewise"}};
    static const table_column tile_columns[] = {
        {"city", "", "3: with skyscrapers"},
        {"elements", "", "n"},
        {"threshold", "", "threshold of M~"},
        {"tile", "", "the only bright tile of the sky"},
        {"none", "", "|B~ - B|/|B| without a correction"},
        {"delta", "", "likewise with the correction by one converged solution"},
        {"discarded", "", "likewise with the discarded part (eq. 4.7)"}};
    lam_status status = LAM_OK;
    table light = {.name = "bounces",
                   .title = "Third and later bounces (figure 4.5)",
                   .columns = many_lights_input,
                   .n_columns = sizeof many_lights_input / sizeof *many_lights_input,
                   .printed = true};
    table curves = {.name = "bounces-curves",
                    .title = "Radiosity and its third and later bounces, sorted by value (figure 4.5)",
                    .columns = curve_columns,
                    .n_columns = sizeof curve_columns / sizeof *curve_columns};
    table tiles = {.name = "tiles",
                   .title = "Error of every sky (figure 4.10)",
                   .columns = tile_columns,
                   .n_columns = sizeof tile_columns / sizeof *tile_columns};
    table relaxed = relaxation_table();
    /* Figure 4.10 is of 35,588 elements, which take minutes. */
    const bool full = run->scale == BENCH_FULL;
    TRY(look_at(run, 1, 0, &light, &curves, &relaxed, NULL, error));
    TRY(look_at(run, 3, 0, &light, &curves, &relaxed, full ? NULL : &tiles, error));
    if (full) TRY(look_at(run, 3, 1, NULL, NULL, NULL, &tiles, error));
    TRY(bench_table(run, &light, error));
    TRY(bench_table(run, &curves, error));
    TRY(bench_table(run, &relaxed, error));
    TRY(bench_table(run, &tiles, error));
done:
    table_free(&light);
    table_free(&curves);
    table_free(&relaxed);
    table_free(&tiles);
    return status;
}
