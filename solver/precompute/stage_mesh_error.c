/* The error that constants on elements leave, as the store states it. */
#include "solver/adapt/mesh_error.h"
#include "solver/precompute/black_scene.h"
#include "solver/precompute/mesh_error_lights.h"
#include "solver/precompute/mesh_error_luminaires.h"
#include "solver/precompute/mesh_error_skies.h"
#include "solver/precompute/stages.h"

#include <stdlib.h>
#include <string.h>

/* The lights that errors are stated for: E [n_lights][C][n], and of an operator of few emitters, which knows
 * no other light than theirs, the weights W [C][s] of all together. Nothing is stated of emitters that have a
 * sky in them, unless they are its tiles (mesh_error_add_skies). */
typedef struct chosen_lights {
    float *E, *W; /* freed with free(); W NULL: any emission is answered */
} chosen_lights;

static void add_emitters(const precompute_scene *scene, chosen_lights *to) {
    const emission *light = &scene->emitters.light;
    const size_t s = scene->emitters.s, C = scene->m.n_channels, vector = scene->m.n * C;
    const size_t all = emitter_list_count(&scene->emitters);
    for (size_t t = 0; light->L != NULL && t < s * C * scene->sky_tiles; t++)
        if (light->L[t] != 0) return;
    for (size_t k = 0; light->E != NULL && k < s * vector; k++) to->E[k % vector] += light->E[k];
    for (size_t k = 0; k < s * C; k++) to->W[k / s * all + k % s] = 1;
}

static lam_status choose_lights(const precompute_scene *scene, made_operator *made, chosen_lights *out,
                                lam_error *error) {
    const mesh *m = &scene->m;
    const size_t vector = m->n * m->n_channels, s = emitter_list_count(&scene->emitters);
    mesh_figures *figures = &made->errors_of_mesh;
    out->E = memory_allocate(2 * vector, sizeof *out->E, "the error of the mesh", error);
    if (out->E == NULL) return LAM_ERR_MEMORY;
    if (s > 0) {
        out->W = memory_allocate(s, m->n_channels * sizeof *out->W, "the error of the mesh", error);
        if (out->W == NULL) return LAM_ERR_MEMORY;
        add_emitters(scene, out);
    } else {
        memcpy(out->E, m->emission, vector * sizeof *out->E);
    }
    for (size_t i = 0; i < vector; i++) figures->has_lights = figures->has_lights || out->E[i] > 0;
    figures->has_even = s == 0;
    float *even = figures->has_lights ? out->E + vector : out->E;
    for (size_t i = 0; figures->has_even && i < vector; i++) even[i] = 1;
    return LAM_OK;
}

static lam_status answer(const precompute_scene *scene, const made_operator *made, size_t n_lights,
                         const chosen_lights *lights, float *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(made->op, n_lights);
    void *work = memory_allocate(bytes, 1, "the error of the mesh", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(mesh_error_answers(scene, made, n_lights, lights->W, lights->E, B, work, bytes, error));
done:
    free(work);
    return status;
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
    float *B = NULL;
    chosen_lights lights = {.E = NULL};
    mesh_error_groups groups = {.fewer = 0};
    *figures = (mesh_figures){.has_lights = false};
    TRY(choose_lights(scene, made, &lights, error));
    const float *const E = lights.E;
    const size_t n_lights = (size_t)figures->has_lights + figures->has_even;
    if (n_lights == 0) { /* of few emitters, tiles of a sky or luminaires */
        TRY(mesh_error_add_luminaires(job, scene, made, error));
        TRY(mesh_error_add_skies(job, scene, factors, made, error));
        goto done;
    }
    B = memory_allocate(n_lights * vector, sizeof *B, "the error of the mesh", error);
    if (B == NULL) TRY(LAM_ERR_MEMORY);
    TRY(answer(scene, made, n_lights, &lights, B, error));
    TRY(mesh_error_groups_begin(&scene->m, n_lights, &groups, error));
    TRY(mesh_error(&scene->m, n_lights, E, B, figures->has_lights, NULL, NULL,
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
    TRY(mesh_error_add_luminaires(job, scene, made, error));
    TRY(mesh_error_add_skies(job, scene, factors, made, error));
done:
    mesh_error_groups_free(&groups);
    free(lights.E);
    free(lights.W);
    free(B);
    return status;
}

/* A view of a scene, whose reflectances are a copy: lightened where it reflects nothing. */
static lam_status lighten(const precompute_scene *scene, precompute_scene *out, lam_error *error) {
    const mesh *m = &scene->m;
    float *reflectance =
        memory_allocate(m->n, m->n_channels * sizeof *reflectance, "the error of the mesh", error);
    if (reflectance == NULL) return LAM_ERR_MEMORY;
    memcpy(reflectance, m->reflectance, m->n * m->n_channels * sizeof *reflectance);
    *out = *scene;
    out->m.reflectance = reflectance;
    out->lightened = black_scene_lighten(&out->m);
    return LAM_OK;
}

lam_status stage_mesh_error(const precompute_job *job, const precompute_scene *scene,
                            const precompute_factors *factors, made_operator *made, lam_error *error) {
    precompute_scene lighter;
    lam_status status = lighten(scene, &lighter, error);
    if (status != LAM_OK) return status;
    status = find_errors(job, &lighter, factors, made, error);
    free(lighter.m.reflectance);
    return status;
}

lam_status stage_mesh_error_of_luminaires(const precompute_job *job, const precompute_scene *scene,
                                          made_operator *made, lam_error *error) {
    precompute_scene lighter;
    lam_status status = lighten(scene, &lighter, error);
    if (status != LAM_OK) return status;
    status = mesh_error_add_luminaires(job, &lighter, made, error);
    free(lighter.m.reflectance);
    return status;
}
