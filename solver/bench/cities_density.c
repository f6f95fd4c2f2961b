/* Tables 4.1 and 4.5 of the thesis: how few elements each sees. */
#include "solver/bench/cities.h"
#include "solver/bench/formfactors.h"
#include "solver/bench/scenes.h"
#include "solver/formfactor/formfactor.h"

#include <math.h>
#include <stdlib.h>

/* Table 4.5, in percent: [variant][size][terrain]. */
static const double theirs[CITY_VARIANTS][CITY_SIZES][CITY_TERRAINS] = {
    {{.68, 14.3, .87}, {.48, 9.10, .60}, {.35, 4.87, .42}},
    {{.84, 6.48, .96}, {.60, 4.19, .66}, {.44, 2.48, .47}},
    {{1.23, 2.99, 1.14}, {.87, 1.97, .79}, {.64, 1.31, .58}}};

/* A row of 512 pixels is 786 thousand rays, an hour for all of 35,588: some rows tell of all. */
enum { RAYS = 4096, RESOLUTION = 512, RESOLUTION_QUICK = 32, ROWS = 512, ROWS_QUICK = 32, ROWS_FULL = 1024 };

/* Rows spread over the mesh, whose elements lie group by group and building by building: one at random out of
 * each of count parts. */
static void spread_rows(size_t n, size_t count, uint64_t seed, uint32_t *rows) {
    for (size_t k = 0; k < count; k++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        const double place = (double)k + (double)(seed >> 11) * 0x1p-53;
        rows[k] = (uint32_t)(place * (double)n / (double)count);
    }
}

/* The share of all that these rows see, in percent, and its standard error. */
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
                 by_rays = formfactors_rays(RAYS, run->seed);
    size_t count = quick ? ROWS_QUICK : run->scale == BENCH_FULL ? ROWS_FULL : ROWS;
    TRY(bench_check(run, error));
    TRY(city_mesh(run, variant, size, city_terrains[terrain], &m, error));
    if (count > m.n) count = m.n;
    rows = memory_allocate(count, sizeof *rows, "rows of form factors", error);
    seen = memory_allocate(count, sizeof *seen, "rows of form factors", error);
    if (rows == NULL || seen == NULL) TRY(LAM_ERR_MEMORY);
    spread_rows(m.n, count, run->seed, rows);
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
        {"terrain", NULL, "what it stands on"},
        {"elements", "", "n"},
        {"rows", "", "of F that were looked at"},
        {"density", "%", "of F by hemicubes of 512 pixels, one way, as in the thesis"},
        {"deviation", "%", "standard error of that, as not all rows were looked at"},
        {"theirs", "%", "table 4.5 of the thesis"},
        {"ratio", "", "ours over theirs"},
        {"rays", "%", "density of the same rows by 4,096 rays an element, one way"}};
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
