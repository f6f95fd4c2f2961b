/* Suite cities: chapter 4 of the thesis, on cities of the same kind and size. */
#include "tests/bench/suites/cities.h"
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/formfactor/formfactor.h"
#include "solver/method/reference.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <stdlib.h>

const size_t city_sizes[CITY_SIZES] = {8897, 35588, 142352};
const char *const city_terrains[CITY_TERRAINS] = {"flat", "valley", "hill"};
const double city_thresholds[CITY_THRESHOLDS] = {1e-3, 1e-4, 1e-5};

void city_free(city *c) {
    form_factors_free(&c->f);
    free(c->order);
    mesh_free(&c->m);
    *c = (city){0};
}

lam_status city_mesh(const bench_run *run, unsigned variant, size_t size, const char *terrain, mesh *out,
                     lam_error *error) {
    const generate_options options = {.kind = "city",
                                      .variant = variant,
                                      .terrain = terrain,
                                      .elements = run->scale == BENCH_QUICK ? 600 : city_sizes[size],
                                      .reflectance = .7,
                                      .seed = 1};
    return scene_generated(&options, out, error);
}

lam_status city_open(const bench_run *run, unsigned variant, size_t size, const char *terrain,
                     const recipe *how, city *out, lam_error *error) {
    lam_status status = LAM_OK;
    city c = {.variant = variant, .size = size, .terrain = terrain};
    const form_factor_options ways = {
        .recipe = *how, .progress = run->progress, .stage = "form factors", .sky = "grid:12x11"};
    TRY(bench_check(run, error));
    TRY(city_mesh(run, variant, size, terrain, &c.m, error));
    TRY(formfactors_order(&c.m, &c.order, error));
    const double started = clock_seconds();
    TRY(form_factors_make(&c.m, c.order, &ways, &c.f, error));
    c.seconds = clock_seconds() - started;
    if (c.f.F.indptr == NULL) TRY(form_factors_expand(&c.f, c.m.area, error));
    *out = c;
    out->problem = (build_problem){.n = c.m.n,
                                   .n_channels = c.m.n_channels,
                                   .area = c.m.area,
                                   .reflectance = c.m.reflectance,
                                   .F = &out->f.F,
                                   .order = c.order};
    c = (city){0};
    bench_say(run, "city %u, %s, %zu elements: form factors in %.1f s, %.3g %% dense", variant, terrain,
              out->m.n, out->seconds, 100 * city_density(out));
done:
    city_free(&c);
    return status;
}

double city_density(const city *c) {
    const double n = (double)c->m.n;
    return (double)c->f.F.indptr[c->m.n] / (n * n);
}

void city_light_free(city_light *d) {
    free(d->E);
    free(d->B);
    *d = (city_light){0};
}

lam_status city_light_make(const bench_run *run, const city *c, city_light *d, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n, m = c->f.sky.tiling.n_tiles;
    reference *r = NULL;
    double *E = memory_allocate(m, n * sizeof *E, "skies", error);
    *d = (city_light){.m = m,
                      .E = memory_allocate(m, n * sizeof *d->E, "skies", error),
                      .B = memory_allocate(m, n * sizeof *d->B, "skies", error)};
    if (E == NULL || d->E == NULL || d->B == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < m * n; k++) {
        d->E[k] = c->m.reflectance[k % n] * c->f.sky.first_bounce[k];
        E[k] = d->B[k] = (double)d->E[k];
    }
    TRY(reference_create(&c->f.F, c->m.area, c->m.reflectance, REFERENCE_ITERATED, &r, error));
    TRY(reference_solve(r, m, E, d->B, 1e-10, run->progress, error));
done:
    reference_destroy(r);
    free(E);
    return status;
}

lam_status city_sparse(const bench_run *run, const city *c, double threshold, const char *correction,
                       lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    build_options options = build_presets("sparse");
    options.seed = run->seed;
    options.progress = run->progress;
    TRY(build_set_number(&options, "threshold", threshold, error));
    TRY(build_set(&options, "correction", correction, error));
    TRY(build_operator(&c->problem, &options, op, report, error));
done:
    return status;
}

lam_status city_light_answer(const city_light *d, const lam_operator *op, float *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(op, d->m);
    void *work = memory_allocate(bytes, 1, "work area", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(lam_operator_apply(op, d->m, LAM_RADIOSITY, d->E, B, work, bytes, error));
done:
    free(work);
    return status;
}

lam_status city_light_errors(const city *c, const city_light *d, const lam_operator *op, double *relative,
                             double *indirect, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n;
    float *B = memory_allocate(d->m, n * sizeof *B, "answers", error);
    if (B == NULL) return LAM_ERR_MEMORY;
    TRY(city_light_answer(d, op, B, error));
    for (size_t t = 0; t < d->m; t++) {
        double off = 0, all = 0, bounced = 0;
        for (size_t i = 0; i < n; i++) {
            const double b = d->B[t * n + i], e = (double)B[t * n + i] - b, a = c->m.area[i];
            const double more = b - (double)d->E[t * n + i];
            off += a * e * e;
            all += a * b * b;
            bounced += a * more * more;
        }
        relative[t] = sqrt(off / all);
        indirect[t] = sqrt(off / bounced);
    }
done:
    free(B);
    return status;
}

/* Table 4.5, in percent: [variant][size][terrain]. */
static const double theirs[CITY_VARIANTS][CITY_SIZES][CITY_TERRAINS] = {
    {{.68, 14.3, .87}, {.48, 9.10, .60}, {.35, 4.87, .42}},
    {{.84, 6.48, .96}, {.60, 4.19, .66}, {.44, 2.48, .47}},
    {{1.23, 2.99, 1.14}, {.87, 1.97, .79}, {.64, 1.31, .58}}};

/* A row by 512 pixels takes 786 thousand rays, and all 35,588 rows would take an hour: a sample of the rows
 * is measured. */
enum {
    DENSITY_RAYS = 4096,
    RESOLUTION = 512,
    RESOLUTION_QUICK = 32,
    ROWS = 512,
    ROWS_QUICK = 32,
    ROWS_FULL = 1024
};

void cities_spread_rows(size_t n, size_t count, uint64_t seed, uint32_t *rows) {
    for (size_t k = 0; k < count; k++) {
        const double place = (double)k + random_lcg_unit(&seed);
        rows[k] = (uint32_t)(place * (double)n / (double)count);
    }
}

/* The mean share of all elements that these rows see, in percent, and its standard error. */
static lam_status density_of(const bench_run *run, const mesh *m, const recipe *how, const uint32_t *rows,
                             size_t count, size_t *seen, double *density, double *deviation,
                             lam_error *error) {
    double sum = 0, squares = 0;
    const lam_status status =
        form_factors_count_seen(m, how, rows, count, run->progress, "elements seen", seen, error);
    if (status != LAM_OK) return status;
    for (size_t k = 0; k < count; k++) {
        const double x = 100 * (double)seen[k] / (double)m->n;
        sum += x;
        squares += x * x;
    }
    *density = sum / (double)count;
    *deviation = sqrt(fmax(0, squares / (double)count - *density * *density) / (double)count);
    return LAM_OK;
}

static lam_status add_city(const bench_run *run, unsigned variant, size_t size, size_t terrain, table *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    uint32_t *rows = NULL;
    size_t *seen = NULL;
    double cubes, rays, deviation, unread;
    const bool quick = run->scale == BENCH_QUICK;
    const recipe by_cubes = formfactors_hemicube(quick ? RESOLUTION_QUICK : RESOLUTION),
                 by_rays = formfactors_rays(DENSITY_RAYS, run->seed);
    size_t count = quick ? ROWS_QUICK : run->scale == BENCH_FULL ? ROWS_FULL : ROWS;
    TRY(bench_check(run, error));
    TRY(city_mesh(run, variant, size, city_terrains[terrain], &m, error));
    if (count > m.n) count = m.n;
    rows = memory_allocate(count, sizeof *rows, "rows of form factors", error);
    seen = memory_allocate(count, sizeof *seen, "rows of form factors", error);
    if (rows == NULL || seen == NULL) TRY(LAM_ERR_MEMORY);
    cities_spread_rows(m.n, count, run->seed, rows);
    TRY(density_of(run, &m, &by_cubes, rows, count, seen, &cubes, &deviation, error));
    TRY(density_of(run, &m, &by_rays, rows, count, seen, &rays, &unread, error));
    const double wanted = quick ? NAN : theirs[variant - 1][size][terrain];
    table_number(out, variant);
    table_text(out, city_terrains[terrain]);
    table_number(out, (double)m.n);
    table_number(out, (double)count);
    table_number(out, cubes);
    table_number(out, deviation);
    table_number(out, wanted);
    table_number(out, cubes / wanted);
    table_number(out, rays);
    bench_say(run, "city %u, %s, %zu elements: %.3g %% dense", variant, city_terrains[terrain], m.n, cubes);
done:
    free(rows);
    free(seen);
    mesh_free(&m);
    return status;
}

lam_status cities_density(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"city", "", "1: flat houses, 2: up to middle-high, 3: with skyscrapers"},
        {"terrain", NULL, "ground under the city"},
        {"elements", "", "n"},
        {"rows", "", "rows of F in the sample"},
        {"density", "%", "density of F by hemicubes of 512 pixels, one way, as in the thesis"},
        {"deviation", "%", "standard error of the density, as only a sample of the rows was measured"},
        {"theirs", "%", "table 4.5 of the thesis"},
        {"ratio", "", "density over that of the thesis"},
        {"rays", "%", "density of the same rows by 4,096 rays per element, one way"}};
    lam_status status = LAM_OK;
    table out = {.name = "density",
                 .title = "Density of form factors (tables 4.1 and 4.5)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    const size_t sizes = run->scale == BENCH_QUICK ? 1 : CITY_SIZES;
    for (unsigned variant = 1; variant <= CITY_VARIANTS; variant++)
        for (size_t terrain = 0; terrain < CITY_TERRAINS; terrain++)
            for (size_t size = 0; size < sizes; size++)
                TRY(add_city(run, variant, size, terrain, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

lam_status bench_cities(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(cities_inverse(run, error));
    TRY(cities_density(run, error));
    TRY(cities_resolution(run, error));
    TRY(cities_radiosity(run, error));
    TRY(cities_figures(run, error));
done:
    return status;
}
