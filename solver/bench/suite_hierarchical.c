/* lambert bench hierarchical: that kind beside all others on every scene, and how it grows. */
#include "solver/bench/bench_hierarchical.h"
#include "solver/bench/cities.h"
#include "solver/bench/formfactors.h"
#include "solver/bench/scenes.h"

#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Rays of all a file's elements together where there are too many for pairs, about, and of one at least. */
enum { RAYS_OF_FILE = 1 << 27, RAYS_LEAST = 1024 };

/* Quick takes every third of the first: a city and a Cornell box. */
enum { QUICK_STEP = 3 };

/* Elements of each scene; a file is refined to as many. */
static const size_t elements_of[3] = {600, 2500, 8897};

/* The file that was named, its name without what is around it. */
static lam_status open_file(const bench_run *run, char name[64], lowrank_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    char path[4096];
    const mesh_refinement finer = {.elements = elements_of[run->scale]};
    TRY(scene_file(run->scene, &m, error));
    if (m.n < finer.elements) TRY(mesh_refine(&m, &finer, error));
    snprintf(path, sizeof path, "%s", run->scene);
    snprintf(name, 64, "%s", basename(path));
    char *const dot = strrchr(name, '.');
    if (dot != NULL && dot != name) *dot = '\0';
    recipe how = lowrank_recipe(run, m.n);
    if (how.method != RECIPE_PAIRS)
        how.rays = m.n < RAYS_OF_FILE / RAYS_LEAST ? RAYS_OF_FILE / m.n : RAYS_LEAST;
    TRY(lowrank_open(run, name, &m, &how, out, error));
done:
    mesh_free(&m);
    return status;
}

lam_status bench_hierarchical(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = NULL};
    kind_curve *curves = memory_allocate(KINDS, sizeof *curves, "bench", error);
    char name[64];
    table points = {.name = "hierarchical",
                    .title = "Every kind of operator: cost against total indirect error",
                    .columns = hierarchical_points_columns,
                    .n_columns = hierarchical_points_width,
                    .printed = true};
    table equal = {.name = "equal-error",
                   .title = "At equal total indirect error: hierarchical over the best other kind",
                   .columns = hierarchical_equal_columns,
                   .n_columns = hierarchical_equal_width,
                   .printed = true};
    if (curves == NULL) TRY(LAM_ERR_MEMORY);
    const bool quick = run->scale == BENCH_QUICK;
    const size_t n_scenes = run->scene != NULL ? 1 : quick ? MAP_MAIN : MAP_SCENES;
    for (size_t k = 0; k < n_scenes; k += quick ? QUICK_STEP : 1) {
        if (run->scene != NULL)
            TRY(open_file(run, name, &s, error));
        else
            TRY(map_scene_open(run, map_scenes[k], elements_of[run->scale], &s, error));
        TRY(hierarchical_of_scene(run, &s, curves, &points, error));
        hierarchical_at_equal_error(&s, curves, &equal);
        lowrank_scene_free(&s);
    }
    TRY(bench_table(run, &points, error));
    TRY(bench_table(run, &equal, error));
    if (run->scene == NULL) TRY(hierarchical_growth(run, error));
done:
    lowrank_scene_free(&s);
    free(curves);
    table_free(&points);
    table_free(&equal);
    return status;
}
