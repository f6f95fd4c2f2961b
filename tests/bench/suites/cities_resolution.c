/* Table 4.6 of the thesis: hemicubes of falling resolution on the three cities, by a sample of rows. */
#include "solver/base/clock.h"
#include "solver/formfactor/source.h"
#include "tests/bench/suites/cities.h"
#include "tests/bench/suites/formfactors.h"

#include <math.h>
#include <stdlib.h>

/* Rows of the sample. A row by 512 pixels takes 786 thousand rays, all 35,588 of a city an hour. */
enum { RESOLUTIONS = 5, ROWS = 256, ROWS_QUICK = 32, ROWS_FULL = 2048, RAYS = 4096 };

/* Density in percent, speed over that of 512 pixels, |F_512 - F| / |F_512|; of cities 1 to 3. */
static const struct {
    size_t resolution;
    double density[CITY_VARIANTS], speedup[CITY_VARIANTS], error[CITY_VARIANTS];
} theirs[RESOLUTIONS] = {{512, {.48, .60, .87}, {1, 1, 1}, {0, 0, 0}},
                         {256, {.34, .46, .69}, {1.8, 1.8, 1.8}, {.0072, .0072, .0076}},
                         {128, {.22, .32, .49}, {2.8, 2.8, 2.7}, {.0610, .0125, .0121}},
                         {64, {.12, .19, .30}, {3.1, 3.1, 3.1}, {.0642, .0360, .0346}},
                         {32, {.06, .09, .15}, {3.2, 3.2, 3.2}, {.1444, .1281, .1279}}};

/* A recipe on a sample of rows, beside the finest hemicube. */
typedef struct sampled {
    const mesh *m;
    const uint32_t *rows;
    size_t count;
    csr finest;
    double finest_seconds;
} sampled;

static lam_status add_recipe(const bench_run *run, unsigned variant, const recipe *how, size_t row,
                             sampled *s, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const bool first = s->finest.indptr == NULL, cubes = recipe_source(how) == &source_hemicube;
    const bool published = cubes && run->scale != BENCH_QUICK;
    csr F = {.n = 0};
    TRY(bench_check(run, error));
    const double started = clock_seconds();
    TRY(form_factors_some_rows(s->m, how, s->rows, s->count, run->progress, "resolution of hemicubes", &F,
                               error));
    const double seconds = clock_seconds() - started, n = (double)s->m->n;
    if (first) s->finest_seconds = seconds;
    table_number(out, variant);
    table_number(out, n);
    table_number(out, (double)s->count);
    table_text(out, cubes ? "hemicube" : "rays");
    table_number(out, (double)(cubes ? how->resolution : how->rays));
    table_number(out, 1e3 * seconds / (double)s->count);
    table_number(out, 100 * (double)F.indptr[s->m->n] / (n * (double)s->count));
    table_number(out, s->finest_seconds / seconds);
    table_number(out, first ? 0 : formfactors_distance(&s->finest, &F));
    table_number(out, published ? theirs[row].density[variant - 1] : NAN);
    table_number(out, published ? theirs[row].speedup[variant - 1] : NAN);
    table_number(out, published ? theirs[row].error[variant - 1] : NAN);
    if (first) {
        s->finest = F;
        F = (csr){.n = 0};
    }
done:
    csr_free(&F);
    return status;
}

static lam_status add_city(const bench_run *run, unsigned variant, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const bool quick = run->scale == BENCH_QUICK;
    const recipe rays = formfactors_rays(RAYS, run->seed);
    mesh m = {0};
    uint32_t *rows = NULL;
    sampled s = {.count = quick ? ROWS_QUICK : run->scale == BENCH_FULL ? ROWS_FULL : ROWS};
    TRY(city_mesh(run, variant, 1, "flat", &m, error));
    if (s.count > m.n) s.count = m.n;
    rows = memory_allocate(s.count, sizeof *rows, "rows of form factors", error);
    if (rows == NULL) TRY(LAM_ERR_MEMORY);
    cities_spread_rows(m.n, s.count, run->seed, rows);
    s.m = &m;
    s.rows = rows;
    for (size_t r = quick ? 3 : 0; r < RESOLUTIONS; r++) {
        const recipe how = formfactors_hemicube(theirs[r].resolution);
        TRY(add_recipe(run, variant, &how, r, &s, out, error));
    }
    TRY(add_recipe(run, variant, &rays, 0, &s, out, error));
    bench_say(run, "city %u, %zu elements: hemicubes of %d resolutions", variant, m.n, RESOLUTIONS);
done:
    csr_free(&s.finest);
    free(rows);
    mesh_free(&m);
    return status;
}

lam_status cities_resolution(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"city", "", "1 to 3, on a plain"},
        {"elements", "", "n"},
        {"rows", "", "rows of F in the sample, one-sided"},
        {"by", NULL, "hemicubes, or rays beside them"},
        {"resolution", "", "pixels along the top of a hemicube; rays of an element"},
        {"row_ms", "ms", "time of a row"},
        {"density", "%", "share of F that is not 0"},
        {"speedup", "", "speed over that of the finest hemicube"},
        {"error", "", "|F_512 - F| / |F_512| of these rows, Frobenius"},
        {"density_theirs", "%", "table 4.6 of the thesis"},
        {"speedup_theirs", "", "its speed-up, of a graphics card"},
        {"error_theirs", "", "its error"}};
    lam_status status = LAM_OK;
    table out = {.name = "resolution",
                 .title = "Resolution of hemicubes in cities (table 4.6)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (unsigned variant = 1; variant <= CITY_VARIANTS; variant++) TRY(add_city(run, variant, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
