/* Tables 4.1 to 4.4 and 4.7 of the thesis: time and error of the sparse inverse beside Jacobi sweeps, and the
 * light of few emitters (section 4.4.3). */
#include "solver/base/clock.h"
#include "solver/formfactor/source.h"
#include "solver/method/many_lights.h"
#include "tests/bench/suites/cities.h"
#include "tests/bench/suites/formfactors.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* [variant][size][threshold]: density of M~ in percent, seconds of M~, of M~ E and of Jacobi for 3,650 skies;
 * mean relative error times 1000, without and with what was discarded. */
static const double density[CITY_VARIANTS][CITY_SIZES][CITY_THRESHOLDS] = {
    {{.22, .61, 1.48}, {.10, .31, .83}, {.04, .15, .45}},
    {{.30, 1.01, 2.58}, {.15, .51, 1.41}, {.05, .24, .75}},
    {{.55, 2.07, 6.24}, {.20, .88, 2.98}, {.06, .36, 1.40}}};
static const double build_time[CITY_VARIANTS][CITY_SIZES][CITY_THRESHOLDS] = {
    {{.17, .68, 2.51}, {1.10, 7.08, 32.8}, {7.33, 60.9, 440}},
    {{.26, 1.49, 5.80}, {2.06, 15.2, 79.6}, {11.8, 136, 1180}},
    {{.52, 4.10, 18.4}, {3.35, 38, 264}, {15.8, 306, 4070}}};
static const double product_time[CITY_VARIANTS][CITY_SIZES][CITY_THRESHOLDS] = {
    {{.52, 1.22, 2.88}, {3.72, 10.2, 26.7}, {26.4, 89.8, 264}},
    {{.71, 1.99, 4.99}, {5.17, 16.2, 45.7}, {34.2, 140, 442}},
    {{1.09, 4.04, 11.9}, {6.91, 29.1, 100}, {37.7, 223, 837}}};
static const double jacobi_time[CITY_VARIANTS][CITY_SIZES][CITY_THRESHOLDS] = {
    {{32.78, 51.68, 79.77}, {334.51, 594.43, 993.65}, {3710.3, 6615.73, 14150.4}},
    {{43.84, 76.56, 117.61}, {530.68, 963.98, 1691.55}, {5704, 11509.2, 27411.8}},
    {{72.93, 129.43, 203.01}, {826.96, 1758.02, 3385.2}, {10058, 22323.8, 72132.9}}};
static const double error_without[CITY_VARIANTS][CITY_SIZES][CITY_THRESHOLDS] = {
    {{27.8, 7.83, 1.88}, {53, 16.9, 4.53}, {48.6, 15.3, 4.15}},
    {{87.7, 31.7, 9.5}, {86.5, 35, 11}, {134, 61.8, 23}},
    {{92.6, 33.3, 9.86}, {141, 59.3, 19.7}, {189.67, 99.2, 42.14}}};
static const double error_with[CITY_VARIANTS][CITY_SIZES][CITY_THRESHOLDS] = {
    {{11.3, 2.73, .58}, {23, 6.31, 1.51}, {22.4, 6.26, 1.57}},
    {{43, 13.7, 3.8}, {48.3, 17.2, 4.98}, {79.3, 32.3, 11.1}},
    {{42.9, 13.3, 3.42}, {74.1, 27.3, 8.15}, {117.16, 55.12, 20.92}}};

enum { RAYS = 4096, RESOLUTION = 512, SWEEPS = 40, JACOBI_VECTORS = 320, AT_ONCE = 64 };

typedef struct spread {
    double mean, std, max, indirect; /* relative errors; indirect: mean */
} spread;

static lam_status judge(const city *c, const city_light *d, const lam_operator *op, spread *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    double sum = 0, squares = 0, bounced = 0;
    double *relative = memory_allocate(d->m, sizeof *relative, "errors", error);
    double *indirect = memory_allocate(d->m, sizeof *indirect, "errors", error);
    if (relative == NULL || indirect == NULL) TRY(LAM_ERR_MEMORY);
    TRY(city_light_errors(c, d, op, relative, indirect, error));
    *out = (spread){.max = 0};
    for (size_t t = 0; t < d->m; t++) {
        sum += relative[t];
        squares += relative[t] * relative[t];
        bounced += indirect[t];
        out->max = fmax(out->max, relative[t]);
    }
    out->mean = sum / (double)d->m;
    out->std = sqrt(fmax(0, squares / (double)d->m - out->mean * out->mean));
    out->indirect = bounced / (double)d->m;
done:
    free(relative);
    free(indirect);
    return status;
}

/* Seconds of CITY_SKIES answers; the tiles are used in turns. */
static lam_status time_product(const bench_run *run, const city *c, const city_light *d,
                               const lam_operator *op, double *seconds, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n, bytes = lam_operator_work_bytes(op, AT_ONCE);
    float *B = memory_allocate(AT_ONCE, n * sizeof *B, "answers", error);
    void *work = memory_allocate(bytes, 1, "work area", error);
    if (B == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    const double started = clock_seconds();
    for (size_t done_so_far = 0; done_so_far < CITY_SKIES; done_so_far += AT_ONCE) {
        const size_t left = CITY_SKIES - done_so_far, count = left < AT_ONCE ? left : AT_ONCE;
        TRY(bench_check(run, error));
        TRY(lam_operator_apply(op, count, LAM_RADIOSITY, d->E + (done_so_far / AT_ONCE % 2) * AT_ONCE * n, B,
                               work, bytes, error));
    }
    *seconds = clock_seconds() - started;
done:
    free(B);
    free(work);
    return status;
}

/* Seconds of Jacobi sweeps for CITY_SKIES skies, extrapolated from JACOBI_VECTORS of them. */
static lam_status time_jacobi(const bench_run *run, const city *c, const city_light *d, size_t sweeps,
                              double *seconds, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n;
    float *E = memory_allocate(JACOBI_VECTORS, n * sizeof *E, "skies", error);
    float *T = memory_allocate(JACOBI_VECTORS, n * sizeof *T, "answers", error);
    if (E == NULL || T == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < JACOBI_VECTORS; v++) memcpy(E + v * n, d->E + v % d->m * n, n * sizeof *E);
    const many_lights_input all = {.n = n,
                                   .F = &c->f.F,
                                   .area = c->m.area,
                                   .rho = c->m.reflectance,
                                   .m = JACOBI_VECTORS,
                                   .E = E,
                                   .progress = run->progress,
                                   .stage = "jacobi"};
    const double started = clock_seconds();
    TRY(many_lights_jacobi(&all, sweeps, T, error));
    *seconds = (clock_seconds() - started) * CITY_SKIES / JACOBI_VECTORS;
done:
    free(E);
    free(T);
    return status;
}

/* The least number of sweeps whose error for the first tiles is at most that of M~. */
static lam_status sweeps_for(const bench_run *run, const city *c, const city_light *d, double wanted,
                             size_t *sweeps, lam_error *error) {
    enum { TILES = 32 };
    lam_status status = LAM_OK;
    const size_t n = c->m.n, m = d->m < TILES ? d->m : TILES;
    float *T = memory_allocate(m, n * sizeof *T, "answers", error);
    if (T == NULL) TRY(LAM_ERR_MEMORY);
    const many_lights_input some = {.n = n,
                                    .F = &c->f.F,
                                    .area = c->m.area,
                                    .rho = c->m.reflectance,
                                    .m = m,
                                    .E = d->E,
                                    .progress = run->progress,
                                    .stage = "jacobi"};
    for (*sweeps = 1; *sweeps < SWEEPS; ++*sweeps) {
        double sum = 0;
        TRY(many_lights_jacobi(&some, *sweeps, T, error));
        for (size_t t = 0; t < m; t++) {
            double off = 0, all = 0;
            for (size_t i = 0; i < n; i++) {
                const double b = d->B[t * n + i];
                const double e = (double)d->E[t * n + i] + (double)T[t * n + i] - b;
                off += c->m.area[i] * e * e;
                all += c->m.area[i] * b * b;
            }
            sum += sqrt(off / all);
        }
        if (sum / (double)m <= wanted) break;
    }
done:
    free(T);
    return status;
}

typedef struct threshold_row {
    double density, build_seconds, product_seconds;
    spread of[3]; /* without, with what was discarded, delta */
} threshold_row;

static lam_status measure(const bench_run *run, const city *c, const city_light *d, double threshold,
                          threshold_row *row, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *op = NULL;
    static const char *const corrections[] = {"none", "discarded", "delta"};
    for (size_t place = 0; place < 3; place++) {
        build_report report;
        operator_description about;
        TRY(city_sparse(run, c, threshold, corrections[place], &op, &report, error));
        lam_operator_set_threads(op, (size_t)omp_get_max_threads());
        operator_describe(op, &about);
        TRY(judge(c, d, op, &row->of[place], error));
        if (place == 1) {
            row->density = about.density;
            row->build_seconds = report_seconds(&report);
            TRY(time_product(run, c, d, op, &row->product_seconds, error));
        }
        lam_operator_close(op);
        op = NULL;
    }
done:
    lam_operator_close(op);
    return status;
}

static double their(const bench_run *run, const double figures[CITY_VARIANTS][CITY_SIZES][CITY_THRESHOLDS],
                    const city *c, size_t k) {
    return run->scale == BENCH_QUICK ? NAN : figures[c->variant - 1][c->size][k];
}

static lam_status add_city(const bench_run *run, const city *c, const char *found_by, table *times,
                           table *errors, lam_error *error) {
    lam_status status = LAM_OK;
    city_light d = {.m = 0};
    double jacobi, same;
    TRY(city_light_make(run, c, &d, error));
    TRY(time_jacobi(run, c, &d, SWEEPS, &jacobi, error));
    for (size_t k = 0; k < CITY_THRESHOLDS; k++) {
        threshold_row row = {0};
        size_t sweeps;
        TRY(measure(run, c, &d, city_thresholds[k], &row, error));
        TRY(sweeps_for(run, c, &d, row.of[1].mean, &sweeps, error));
        same = jacobi * (double)sweeps / SWEEPS;
        const double ours = row.build_seconds + row.product_seconds;
        const double theirs = their(run, build_time, c, k) + their(run, product_time, c, k);
        table_number(times, c->variant);
        table_number(times, (double)c->m.n);
        table_text(times, found_by);
        table_number(times, city_thresholds[k]);
        table_number(times, 100 * row.density);
        table_number(times, their(run, density, c, k));
        table_number(times, row.build_seconds);
        table_number(times, their(run, build_time, c, k));
        table_number(times, row.product_seconds);
        table_number(times, their(run, product_time, c, k));
        table_number(times, jacobi);
        table_number(times, their(run, jacobi_time, c, k));
        table_number(times, jacobi / ours);
        table_number(times, their(run, jacobi_time, c, k) / theirs);
        table_number(times, (double)sweeps);
        table_number(times, same / ours);
        table_number(errors, c->variant);
        table_number(errors, (double)c->m.n);
        table_text(errors, found_by);
        table_number(errors, city_thresholds[k]);
        for (int way = 0; way < 3; way++) {
            table_number(errors, 1e3 * row.of[way].mean);
            table_number(errors, 1e3 * row.of[way].std);
            table_number(errors, 1e3 * row.of[way].max);
            table_number(errors, 1e3 * row.of[way].indirect);
            if (way < 2) table_number(errors, their(run, way == 0 ? error_without : error_with, c, k));
        }
        bench_say(run, "threshold %g: M~ in %.2f s, %d skies in %.2f s, relative error %.3g",
                  city_thresholds[k], row.build_seconds, CITY_SKIES, row.product_seconds, row.of[1].mean);
    }
done:
    city_light_free(&d);
    return status;
}

/* The radiosity under each tile alone, converged and after the 5 sweeps of the thesis. */
static lam_status add_emitters(const bench_run *run, const city *c, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n, m = c->f.sky.tiling.n_tiles;
    many_lights_report report;
    float *T = memory_allocate(m, n * sizeof *T, "light of emitters", error), *five = NULL;
    double started, converged, swept, off = 0, all = 0;
    five = memory_allocate(m, n * sizeof *five, "light of emitters", error);
    if (T == NULL || five == NULL) TRY(LAM_ERR_MEMORY);
    const many_lights_input columns = {.n = n,
                                       .F = &c->f.F,
                                       .area = c->m.area,
                                       .rho = c->m.reflectance,
                                       .m = m,
                                       .H0 = c->f.sky.first_bounce,
                                       .progress = run->progress,
                                       .stage = "emitters"};
    started = clock_seconds();
    TRY(many_lights_solve(&columns, 1e-6, T, &report, error));
    converged = clock_seconds() - started;
    started = clock_seconds();
    TRY(many_lights_jacobi(&columns, 5, five, error));
    swept = clock_seconds() - started;
    for (size_t k = 0; k < m * n; k++) {
        const double e = (double)five[k] - (double)T[k];
        off += c->m.area[k % n] * e * e;
        all += c->m.area[k % n] * (double)T[k] * (double)T[k];
    }
    table_number(out, c->variant);
    table_number(out, (double)n);
    table_number(out, (double)m);
    table_number(out, converged);
    table_number(out, (double)report.sweeps);
    table_number(out, report.residual);
    table_number(out, swept);
    table_number(out, sqrt(off / all));
done:
    free(T);
    free(five);
    return status;
}

/* The recipe of the form factors at a size. */
enum { WAYS = 3 };

typedef struct way_of_F {
    const char *name;
    recipe recipe;
} way_of_F;

/* Hemicubes take six minutes for a city of 8,897 elements, half an hour for one of 35,588. */
static size_t ways_of_F(const bench_run *run, size_t size, way_of_F ways[WAYS]) {
    const recipe near = {.source = &source_near_pairs, .rays = 16384, .accuracy = 7e-5, .seed = run->seed};
    size_t n = 0;
    ways[n++] = (way_of_F){"rays 4096", formfactors_rays(RAYS, run->seed)};
    if (size == 0 && run->scale != BENCH_QUICK)
        ways[n++] = (way_of_F){"pairs (defaults)", formfactors_pairs(7e-5, run->seed)};
    if (size == 1 && run->scale == BENCH_FULL) ways[n++] = (way_of_F){"near pairs (defaults)", near};
    if (size < 2 && run->scale == BENCH_FULL)
        ways[n++] = (way_of_F){"hemicube 512", formfactors_hemicube(RESOLUTION)};
    return n;
}

lam_status cities_inverse(const bench_run *run, lam_error *error) {
    static const table_column time_columns[] = {
        {"city", "", "1: flat houses, 2: up to middle-high, 3: with skyscrapers"},
        {"elements", "", "n"},
        {"form_factors", NULL, "how they were found; the thesis: by hemicubes of 512 pixels"},
        {"threshold", "", "entries below it are left out"},
        {"density", "%", "density of M~"},
        {"density_theirs", "%", "table 4.1"},
        {"inverse_s", "s", "time of M~ with the discarded part (algorithm 6)"},
        {"inverse_theirs", "s", "table 4.2"},
        {"product_s", "s", "time of M~ E for 3,650 skies"},
        {"product_theirs", "s", "table 4.2"},
        {"jacobi_s", "s", "time of 40 Jacobi sweeps for 3,650 skies, extrapolated from 320"},
        {"jacobi_theirs", "s", "table 4.2"},
        {"speedup", "", "jacobi_s / (inverse_s + product_s)"},
        {"speedup_theirs", "", "table 4.3"},
        {"sweeps", "", "Jacobi sweeps to the mean error of M~ with the discarded part"},
        {"speedup_at_error", "", "the speed-up over as many sweeps"}};
    static const table_column error_columns[] = {
        {"city", "", "as in the table times"},
        {"elements", "", "n"},
        {"form_factors", NULL, "as in the table times"},
        {"threshold", "", "entries below it are left out"},
        {"none_mean", "1e-3", "|B~ - B|/|B| over 132 tiles alone, nothing made up for"},
        {"none_std", "1e-3", "standard deviation of the same"},
        {"none_max", "1e-3", "maximum of the same"},
        {"none_indirect", "1e-3", "|B~ - B|/|B - E|, mean"},
        {"none_theirs", "1e-3", "table 4.4, mean"},
        {"discarded_mean", "1e-3", "likewise with the discarded part (eq. 4.7)"},
        {"discarded_std", "1e-3", "standard deviation of the same"},
        {"discarded_max", "1e-3", "maximum of the same"},
        {"discarded_indirect", "1e-3", "|B~ - B|/|B - E|, mean"},
        {"discarded_theirs", "1e-3", "table 4.7, mean"},
        {"delta_mean", "1e-3", "with what one converged solution says is missing"},
        {"delta_std", "1e-3", "standard deviation of the same"},
        {"delta_max", "1e-3", "maximum of the same"},
        {"delta_indirect", "1e-3", "|B~ - B|/|B - E|, mean"}};
    static const table_column emitter_columns[] = {
        {"city", "", "as in the table times"},
        {"elements", "", "n"},
        {"emitters", "", "tiles of the sky, each alone"},
        {"converged_s", "s", "by conjugate gradients (thesis, 145 tiles, city 3, 142,352 elements: 1000 s)"},
        {"sweeps", "", "products with F"},
        {"residual", "", "reached"},
        {"five_sweeps_s", "s", "time of 5 Jacobi sweeps (thesis: 140 s)"},
        {"five_sweeps_error", "", "relative, of what is reflected"}};
    lam_status status = LAM_OK;
    city c = {0};
    table times = {.name = "times",
                   .title = "Sparse inverse beside Jacobi (tables 4.1 to 4.3)",
                   .columns = time_columns,
                   .n_columns = sizeof time_columns / sizeof *time_columns,
                   .printed = true};
    table errors = {.name = "errors",
                    .title = "Error of the sparse inverse (tables 4.4 and 4.7)",
                    .columns = error_columns,
                    .n_columns = sizeof error_columns / sizeof *error_columns,
                    .printed = true};
    table emitters = {.name = "emitters",
                      .title = "The light of few emitters (section 4.4.3)",
                      .columns = emitter_columns,
                      .n_columns = sizeof emitter_columns / sizeof *emitter_columns,
                      .printed = true};
    const size_t sizes = run->scale == BENCH_FULL ? CITY_SIZES : run->scale == BENCH_DEFAULT ? 2 : 1;
    for (size_t size = 0; size < sizes; size++)
        for (unsigned variant = 1; variant <= CITY_VARIANTS; variant++) {
            way_of_F ways[WAYS];
            const size_t n_ways = ways_of_F(run, size, ways);
            for (size_t w = 0; w < n_ways; w++) {
                TRY(city_open(run, variant, size, "flat", &ways[w].recipe, &c, error));
                TRY(add_city(run, &c, ways[w].name, &times, &errors, error));
                if (w == 0) TRY(add_emitters(run, &c, &emitters, error));
                city_free(&c);
            }
        }
    TRY(bench_table(run, &times, error));
    TRY(bench_table(run, &errors, error));
    TRY(bench_table(run, &emitters, error));
done:
    city_free(&c);
    table_free(&times);
    table_free(&errors);
    table_free(&emitters);
    return status;
}
