/* Tables 4.1 and 4.5 of the thesis: how few elements each sees. */
#include "solver/bench/cities.h"
#include "solver/bench/formfactors.h"

#include <math.h>

/* Table 4.5, in percent: [variant][size][terrain]. */
static const double theirs[CITY_VARIANTS][CITY_SIZES][CITY_TERRAINS] = {
    {{.68, 14.3, .87}, {.48, 9.10, .60}, {.35, 4.87, .42}},
    {{.84, 6.48, .96}, {.60, 4.19, .66}, {.44, 2.48, .47}},
    {{1.23, 2.99, 1.14}, {.87, 1.97, .79}, {.64, 1.31, .58}}};

enum { RAYS = 4096, RESOLUTION = 512, RESOLUTION_QUICK = 32 };

static lam_status add_city(const bench_run *run, unsigned variant, size_t size, size_t terrain,
                           const recipe *how, const char *method, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    city c = {0};
    TRY(city_open(run, variant, size, city_terrains[terrain], how, &c, error));
    table_number(out, variant);
    table_text(out, city_terrains[terrain]);
    table_number(out, (double)c.m.n);
    table_text(out, method);
    table_number(out, c.seconds);
    table_number(out, 100 * city_density(&c));
    table_number(out, run->scale == BENCH_QUICK ? NAN : theirs[variant - 1][size][terrain]);
done:
    city_free(&c);
    return status;
}

lam_status cities_density(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"city", "", "1: flat houses, 2: up to middle-high, 3: with skyscrapers"},
        {"terrain", NULL, "what it stands on"},
        {"elements", "", "n"},
        {"method", NULL, "how form factors were found"},
        {"seconds", "s", "of the form factors"},
        {"density", "%", "of F, both estimates of a pair merged"},
        {"theirs", "%", "table 4.5 of the thesis, hemicubes of 512 pixels, not merged"}};
    lam_status status = LAM_OK;
    table out = {.name = "density",
                 .title = "Density of form factors (tables 4.1 and 4.5)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    const recipe rays = formfactors_rays(RAYS, run->seed),
                 cubes = formfactors_hemicube(run->scale == BENCH_QUICK ? RESOLUTION_QUICK : RESOLUTION);
    const size_t sizes = run->scale == BENCH_FULL ? CITY_SIZES : run->scale == BENCH_DEFAULT ? 2 : 1;
    for (unsigned variant = 1; variant <= CITY_VARIANTS; variant++)
        for (size_t size = 0; size < sizes; size++)
            for (size_t terrain = 0; terrain < CITY_TERRAINS; terrain++) {
                if (run->scale == BENCH_DEFAULT && size > 0 && terrain > 0) continue;
                TRY(add_city(run, variant, size, terrain, &rays, "rays 4096", &out, error));
                /* 28 thousand million rays at 35,588 elements: an hour for three cities. */
                if ((run->scale == BENCH_FULL && size < 2) || (run->scale == BENCH_QUICK && terrain == 0))
                    TRY(add_city(run, variant, size, terrain, &cubes, "hemicube", &out, error));
            }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
