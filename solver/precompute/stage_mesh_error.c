/* The error that constants on elements leave, as the store states it. */
#include "solver/adapt/mesh_error.h"
#include "solver/precompute/black_scene.h"
#include "solver/precompute/mesh_error_lights.h"
#include "solver/precompute/mesh_error_skies.h"
#include "solver/precompute/stages.h"

#include <stdlib.h>
#include <string.h>

/* The lights that errors are stated for: E [n_lights][C][n], freed with free(). An operator of few emitters
 * knows no other light than theirs. */
static lam_status choose_lights(const precompute_scene *scene, made_operator *made, float **out,
                                lam_error *error) {
    const mesh *m = &scene->m;
    const size_t vector = m->n * m->n_channels;
    mesh_figures *figures = &made->errors_of_mesh;
    float *E = memory_allocate(2 * vector, sizeof *E, "the error of the mesh", error);
    if (E == NULL) return LAM_ERR_MEMORY;
    if (scene->emitters.s > 0) {
        for (size_t k = 0; scene->emitters.light.E != NULL && k < scene->emitters.s * vector; k++)
            E[k % vector] += scene->emitters.light.E[k];
    } else {
        memcpy(E, m->emission, vector * sizeof *E);
    }
    for (size_t i = 0; i < vector; i++) figures->has_lights = figures->has_lights || E[i] > 0;
    figures->has_even = scene->emitters.s == 0;
    float *even = figures->has_lights ? E + vector : E;
    for (size_t i = 0; figures->has_even && i < vector; i++) even[i] = 1;
    *out = E;
    return LAM_OK;
}

/* The power that each group emits, channels summed. */
static lam_status take_power(const mesh *m, const float *E, mesh_figures *figures, lam_error *error) {
    double *power = memory_allocate(m->n_groups, sizeof *power, "the error of the mesh", error);
    figures->lights_power = power;
    if (power == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < m->n * m->n_channels; k++)
        power[m->group[k % m->n]] += m->area[k % m->n] * (double)E[k];
    return LAM_OK;
}

static lam_status find_errors(const precompute_job *job, const precompute_scene *scene,
                              const precompute_factors *factors, made_operator *made, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = scene->m.n * scene->m.n_channels;
    mesh_figures *figures = &made->errors_of_mesh;
    double found[2] = {0};
    float *E = NULL, *B = NULL;
    void *work = NULL;
    mesh_error_groups groups = {.fewer = 0};
    *figures = (mesh_figures){.has_lights = false};
    TRY(choose_lights(scene, made, &E, error));
    const size_t n_lights = (size_t)figures->has_lights + figures->has_even;
    if (n_lights == 0) goto done;
    const size_t bytes = lam_operator_work_bytes(made->op, n_lights);
    B = memory_allocate(n_lights * vector, sizeof *B, "the error of the mesh", error);
    work = memory_allocate(bytes, 1, "the error of the mesh", error);
    if (B == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    status = mesh_error_answers(scene, made, n_lights, E, B, work, bytes, error);
    if (status == LAM_ERR_ARGUMENT &&
        scene->emitters.s > 0) { /* a sum that no weights give: nothing is stated */
        *figures = (mesh_figures){.has_lights = false};
        status = LAM_OK;
        goto done;
    }
    TRY(status);
    TRY(mesh_error_groups_begin(&scene->m, n_lights, &groups, error));
    TRY(mesh_error(&scene->m, n_lights, E, B, figures->has_lights, NULL,
                   precompute_seed(job->options->seed, SEED_MESH_ERROR), &job->progress, found, &groups,
                   error));
    if (figures->has_lights)
        TRY(mesh_error_take(&groups, 0, MESH_OF_LAMPS, scene->m.n_groups, figures, error));
    if (figures->has_even)
        TRY(mesh_error_take(&groups, n_lights - 1, MESH_OF_EVEN, scene->m.n_groups, figures, error));
    if (figures->has_lights) TRY(take_power(&scene->m, E, figures, error));
    if (figures->has_even) {
        const float *even = E + (n_lights - 1) * vector, *answer = B + (n_lights - 1) * vector;
        figures->even_emitters = mesh_error_emitters(&scene->m, even);
        figures->light_of[MESH_OF_EVEN] = mesh_error_light(&scene->m, even, answer, false);
    }
    figures->lights = found[0];
    figures->even = found[n_lights - 1];
    if (figures->has_lights) terminal_log(job->t, "mesh     lights indirect %.3g", figures->lights);
    if (figures->has_even) terminal_log(job->t, "mesh     even indirect %.3g", figures->even);
    TRY(mesh_error_add_others(job, scene, made, error));
    TRY(mesh_error_add_skies(job, scene, factors, made, error));
done:
    mesh_error_groups_free(&groups);
    free(E);
    free(B);
    free(work);
    return status;
}

lam_status stage_mesh_error(const precompute_job *job, const precompute_scene *scene,
                            const precompute_factors *factors, made_operator *made, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    precompute_scene lighter = *scene;
    float *reflectance =
        memory_allocate(m->n, m->n_channels * sizeof *reflectance, "the error of the mesh", error);
    if (reflectance == NULL) return LAM_ERR_MEMORY;
    memcpy(reflectance, m->reflectance, m->n * m->n_channels * sizeof *reflectance);
    lighter.m.reflectance = reflectance;
    lighter.lightened = black_scene_lighten(&lighter.m);
    TRY(find_errors(job, &lighter, factors, made, error));
done:
    free(reflectance);
    return status;
}
