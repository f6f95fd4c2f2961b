/* lambert bench cities: chapter 4 of the thesis, on cities of the same kind and size. */
#include "solver/base/clock.h"
#include "solver/bench/cities.h"
#include "solver/bench/formfactors.h"
#include "solver/bench/scenes.h"

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

lam_status bench_cities(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(cities_inverse(run, error));
    TRY(cities_density(run, error));
    TRY(cities_radiosity(run, error));
    TRY(cities_figures(run, error));
done:
    return status;
}
