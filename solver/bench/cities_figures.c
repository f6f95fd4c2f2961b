/* Figures 4.1, 4.4 and 5.1 of the thesis: the scenes that they have in common. */
#include "solver/bench/cities.h"
#include "solver/bench/formfactors.h"
#include "solver/bench/scenes.h"

#include <stdlib.h>
#include <string.h>

/* City 1, two with properties of the thesis' other two, the Cornell box; and others. */
const char *const map_scenes[MAP_SCENES] = {"city 1", "rooms", "anechoic", "cornell", "city 2",
                                            "city 3", "patio", "atrium",   "maze",    "canopy"};

/* Of figure 4.1: where they are among map_scenes. */
static const size_t fall_scenes[FALL_SCENES] = {3, 0, 4, 5};

/* Pairs would take most of the seconds that quick has. */
enum { RAYS_QUICK = 1024 };

typedef struct figure_scenes {
    lowrank_scene map[MAP_SCENES];
    lowrank_scene other[FALL_SCENES]; /* those of figure 4.1, larger or smaller */
} figure_scenes;

static void scenes_free(figure_scenes *s) {
    if (s == NULL) return;
    for (size_t k = 0; k < MAP_SCENES; k++) lowrank_scene_free(&s->map[k]);
    for (size_t k = 0; k < FALL_SCENES; k++) lowrank_scene_free(&s->other[k]);
    free(s);
}

lam_status map_scene_open(const bench_run *run, const char *name, size_t elements, lowrank_scene *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    const bool is_city = strncmp(name, "city ", 5) == 0;
    const generate_options kind = {.kind = is_city ? "city" : name,
                                   .variant = is_city ? (unsigned)(name[5] - '0') : 0,
                                   .terrain = "flat",
                                   .elements = elements,
                                   .reflectance = is_city ? .7 : -1,
                                   .seed = 1};
    TRY(bench_check(run, error));
    TRY(scene_generated(&kind, &m, error));
    const recipe how =
        run->scale == BENCH_QUICK ? formfactors_rays(RAYS_QUICK, run->seed) : lowrank_recipe(run, m.n);
    TRY(lowrank_open(run, name, &m, &how, out, error));
done:
    mesh_free(&m);
    return status;
}

lam_status cities_figures(const bench_run *run, lam_error *error) {
    /* of the map, and of figure 4.1 beside them */
    static const size_t elements[][2] = {
        [BENCH_QUICK] = {600, 0}, [BENCH_DEFAULT] = {2500, 8897}, [BENCH_FULL] = {8897, 2500}};
    lam_status status = LAM_OK;
    const size_t *const n = elements[run->scale];
    const size_t n_sizes = n[1] > 0 ? 2 : 1;
    const lowrank_scene *fall[2 * FALL_SCENES];
    figure_scenes *s = memory_allocate(1, sizeof *s, "scenes", error);
    if (s == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < MAP_SCENES; k++) TRY(map_scene_open(run, map_scenes[k], n[0], &s->map[k], error));
    for (size_t k = 0; k < FALL_SCENES; k++) {
        fall[k] = &s->map[fall_scenes[k]];
        fall[FALL_SCENES + k] = &s->other[k];
        if (n_sizes > 1) TRY(map_scene_open(run, map_scenes[fall_scenes[k]], n[1], &s->other[k], error));
    }
    TRY(cities_map(run, s->map, error));
    TRY(cities_kinds(run, s->map, error));
    TRY(cities_spectra(run, fall, n_sizes, error));
    const lowrank_scene *const *const large = n[1] > n[0] ? fall + FALL_SCENES : fall;
    const lowrank_scene *const distributed[2] = {large[1], large[3]};
    TRY(cities_distribution(run, distributed, error));
done:
    scenes_free(s);
    return status;
}
