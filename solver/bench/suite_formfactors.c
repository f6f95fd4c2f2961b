/* lambert bench formfactors: how exact form factors are, what that costs, and how fast rays are. */
#include "solver/bench/formfactors.h"

#include "solver/base/clock.h"
#include "solver/bench/scenes.h"

#include <stdlib.h>
#include <string.h>

/* Rays that only tell pairs whether a scene is closed; as precompute takes them. */
enum { FEW_RAYS = 256 };

recipe formfactors_rays(size_t rays, uint64_t seed) {
    return (recipe){.method = RECIPE_RAYS, .rays = rays, .seed = seed};
}

recipe formfactors_hemicube(size_t resolution) {
    return (recipe){.method = RECIPE_HEMICUBE, .resolution = resolution};
}

recipe formfactors_pairs(double accuracy, uint64_t seed) {
    return (recipe){.method = RECIPE_PAIRS, .rays = FEW_RAYS, .accuracy = accuracy, .seed = seed};
}

lam_status formfactors_make_timed(const bench_run *run, const mesh *m, const uint32_t *order,
                                  const recipe *how, const char *stage, form_factors *out, double *seconds,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options options = {.recipe = *how, .progress = run->progress, .stage = stage};
    TRY(bench_check(run, error));
    const double started = clock_seconds();
    TRY(form_factors_make(m, order, &options, out, error));
    *seconds = clock_seconds() - started;
done:
    return status;
}

static int compare_indices(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

double formfactors_entry(const csr *F, size_t i, size_t j) {
    const uint32_t wanted = (uint32_t)j;
    const uint32_t *row = F->indices + F->indptr[i];
    const uint32_t *found =
        bsearch(&wanted, row, F->indptr[i + 1] - F->indptr[i], sizeof *row, compare_indices);
    return found != NULL ? (double)F->data[found - F->indices] : 0;
}

lam_status formfactors_order(const mesh *m, uint32_t **order, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *out = memory_allocate(m->n, sizeof *out, "Z-order", error);
    if (out == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(m, out, error));
    *order = out;
    out = NULL;
done:
    free(out);
    return status;
}

lam_status formfactors_open_scene(const bench_run *run, size_t lots, mesh *out, char name[64],
                                  lam_error *error) {
    if (run->scene == NULL) {
        snprintf(name, 64, "houses %zux%zu", lots, lots);
        return scene_houses(lots, 1, out, error);
    }
    const char *slash = strrchr(run->scene, '/');
    snprintf(name, 64, "%s", slash != NULL ? slash + 1 : run->scene);
    return scene_file(run->scene, out, error);
}

lam_status bench_formfactors(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    mesh given = {0};
    /* A scene that cannot be read is told before the measuring begins. */
    if (run->scene != NULL) TRY(scene_file(run->scene, &given, error));
    mesh_free(&given);
    TRY(formfactors_closed_forms(run, error));
    TRY(formfactors_of_enclosures(run, error));
    TRY(formfactors_throughput(run, error));
    TRY(formfactors_resolution(run, error));
    TRY(formfactors_error(run, error));
done:
    return status;
}
