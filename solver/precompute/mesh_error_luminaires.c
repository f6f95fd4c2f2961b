#include "solver/precompute/mesh_error_luminaires.h"

#include "solver/base/random.h"
#include "solver/direct/direct_points.h"
#include "solver/precompute/mesh_error_lights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Luminaires that are looked at, and lights made of them: weights [n_lights][n_chosen] of their columns. */
typedef struct luminaire_lights {
    const precompute_job *job;
    const precompute_scene *scene;
    size_t n_chosen, n_lights;
    size_t chosen[LUMINAIRES_LOOKED_AT];
    double *weights;
} luminaire_lights;

/* Their factors in channel c: dimmers stand in the weights. */
static double colour_of(const luminaire_lights *l, size_t k, size_t c) {
    const placed_luminaire *of = &l->scene->luminaires.placed.luminaires[l->chosen[k]];
    return l->scene->m.n_channels == 1 ? 1 : of->colour[c];
}

/* Direct light at points: H [n][n_lights C]. */
static lam_status light_points(void *context, size_t n, const double (*points)[3], const uint32_t *elements,
                               double *H, lam_error *error) {
    lam_status status = LAM_OK;
    const luminaire_lights *l = context;
    const mesh *m = &l->scene->m;
    const size_t C = m->n_channels, values = l->n_lights * C;
    const direct_options how = {.progress = &l->job->progress,
                                .stage = "light of luminaires",
                                .n_wanted = l->n_chosen,
                                .wanted = l->chosen};
    direct_point *at = memory_allocate(n, sizeof *at, "light of luminaires", error);
    double(*normals)[3] = memory_allocate(n, sizeof *normals, "light of luminaires", error);
    float *E = memory_allocate(l->n_chosen, n * sizeof *E, "light of luminaires", error);
    if (at == NULL || normals == NULL || E == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++) {
        memcpy(at[p].at, points[p], sizeof at[p].at);
        at[p].element = elements[p];
        for (int d = 0; d < 3; d++) normals[p][d] = (double)m->normal[elements[p]][d];
    }
    TRY(direct_points_irradiance(m, &l->scene->luminaires.placed, &how, n, at, (const double(*)[3])normals, E,
                                 error));
    memset(H, 0, n * values * sizeof *H);
    for (size_t k = 0; k < l->n_chosen; k++)
        for (size_t p = 0; p < n; p++)
            for (size_t v = 0; v < values; v++)
                H[p * values + v] +=
                    l->weights[v / C * l->n_chosen + k] * colour_of(l, k, v % C) * (double)E[k * n + p];
done:
    free(at);
    free(normals);
    free(E);
    return status;
}

/* Arrays of n_lights lights at most. */
typedef struct luminaire_answers {
    float *E, *H0, *rho_H0, *B; /* [n_lights][C][n]; E is 0 */
    float *W;                   /* [n_lights][C][s], of few emitters; NULL: any light is answered */
    void *work;
    size_t bytes;
} luminaire_answers;

static void answers_free(luminaire_answers *a) {
    free(a->E);
    free(a->H0);
    free(a->rho_H0);
    free(a->B);
    free(a->W);
    free(a->work);
}

static lam_status answers_begin(const mesh *m, const lam_operator *op, size_t n_lights, luminaire_answers *a,
                                lam_error *error) {
    const size_t vector = m->n * m->n_channels, s = lam_operator_emitters(op);
    float **const arrays[] = {&a->E, &a->H0, &a->rho_H0, &a->B};
    for (int k = 0; k < 4; k++) {
        *arrays[k] = memory_allocate(n_lights, vector * sizeof **arrays[k], "the error of the mesh", error);
        if (*arrays[k] == NULL) return LAM_ERR_MEMORY;
    }
    if (s > 0) {
        a->W = memory_allocate(n_lights, m->n_channels * s * sizeof *a->W, "the error of the mesh", error);
        if (a->W == NULL) return LAM_ERR_MEMORY;
    }
    a->bytes = lam_operator_work_bytes(op, n_lights);
    a->work = memory_allocate(a->bytes, 1, "the error of the mesh", error);
    return a->work == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

/* The weights of lights, of emitters of which the luminaires are the last. */
static void weigh_emitters(const luminaire_lights *l, size_t s, float *W) {
    const size_t C = l->scene->m.n_channels, first = s - l->scene->luminaires.placed.n;
    memset(W, 0, l->n_lights * C * s * sizeof *W);
    for (size_t row = 0; row < l->n_lights * C; row++)
        for (size_t j = 0; j < l->n_chosen; j++)
            W[row * s + first + l->chosen[j]] = (float)l->weights[row / C * l->n_chosen + j];
}

/* B of the lights, of a lightened scene (black_scene.h) rho H0, as its operator reflects nothing. */
static lam_status answer(const luminaire_lights *l, const made_operator *made, luminaire_answers *a,
                         lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &l->scene->m;
    const luminaire_columns *columns = &l->scene->luminaires;
    const size_t n = m->n, C = m->n_channels, vector = n * C;
    for (size_t light = 0; light < l->n_lights; light++)
        for (size_t k = 0; k < vector; k++) {
            double H = 0;
            for (size_t j = 0; j < l->n_chosen; j++)
                H += l->weights[light * l->n_chosen + j] * colour_of(l, j, k / n) *
                     (double)columns->H[l->chosen[j] * n + k % n];
            a->H0[light * vector + k] = (float)H;
            a->rho_H0[light * vector + k] = (float)(H * (double)m->reflectance[k]);
        }
    if (l->scene->lightened) {
        memcpy(a->B, a->rho_H0, l->n_lights * vector * sizeof *a->B);
        goto done;
    }
    if (a->W != NULL) {
        weigh_emitters(l, lam_operator_emitters(made->op), a->W);
        TRY(lam_operator_apply_emitters(made->op, l->n_lights, LAM_RADIOSITY, a->W, 0, NULL, a->B, a->work,
                                        a->bytes, error));
    } else {
        TRY(lam_operator_apply_lit(made->op, l->n_lights, LAM_RADIOSITY, a->E, a->H0, a->B, a->work, a->bytes,
                                   error));
    }
done:
    return status;
}

/* The errors and mesh_error_light [n_lights] of lights. */
static lam_status judge(const luminaire_lights *l, const made_operator *made, uint64_t seed,
                        luminaire_answers *a, double *found, double *light, mesh_error_groups *groups,
                        lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &l->scene->m;
    const size_t vector = m->n * m->n_channels;
    const mesh_direct direct = {.at = light_points, .context = (void *)(uintptr_t)l};
    TRY(answer(l, made, a, error));
    for (size_t s = 0; s < l->n_lights; s++)
        light[s] = mesh_error_light(m, a->rho_H0 + s * vector, a->B + s * vector, true);
    TRY(mesh_error(m, l->n_lights, a->E, a->B, false, NULL, &direct, seed, &l->job->progress, found, groups,
                   error));
done:
    return status;
}

/* The flux of a luminaire at a dimmer: as listed, or in full where all are dark. */
static double weight_of(const placed_luminaires *p, size_t k, bool dark) {
    return dark ? 1 : p->luminaires[k].dim;
}

/* All of them together. */
static lam_status add_all(luminaire_lights *l, const made_operator *made, uint64_t seed, luminaire_answers *a,
                          mesh_figures *figures, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &l->scene->m;
    const placed_luminaires *p = &l->scene->luminaires.placed;
    double found, light, flux = 0, squares = 0;
    bool dark = true;
    mesh_error_groups groups = {.fewer = 0};
    TRY(mesh_error_groups_begin(m, 1, &groups, error));
    for (size_t k = 0; k < p->n; k++) dark = dark && !(p->luminaires[k].dim > 0);
    l->n_lights = 1;
    l->n_chosen = p->n < LUMINAIRES_LOOKED_AT ? p->n : LUMINAIRES_LOOKED_AT;
    for (size_t k = 0; k < l->n_chosen; k++) {
        l->chosen[k] = k * p->n / l->n_chosen;
        l->weights[k] = weight_of(p, l->chosen[k], dark);
    }
    for (size_t k = 0; k < p->n; k++) {
        const double lumens =
            weight_of(p, k, dark) * l->scene->luminaires.scale[k] * p->files[p->luminaires[k].file].lumens;
        flux += lumens;
        squares += lumens * lumens;
    }
    TRY(judge(l, made, seed, a, &found, &light, &groups, error));
    if (!(light > 0)) goto done;
    TRY(mesh_error_take(&groups, 0, MESH_OF_LUMINAIRES, m->n_groups, figures, error));
    figures->has_luminaires = true;
    figures->luminaires = found;
    figures->luminaires_number = squares > 0 ? flux * flux / squares : 1;
    figures->light_of[MESH_OF_LUMINAIRES] = light;
done:
    mesh_error_groups_free(&groups);
    return status;
}

/* Some alone, at equal steps of the list, as many at once as are gathered together. */
static lam_status add_alone(luminaire_lights *l, const made_operator *made, uint64_t seed,
                            luminaire_answers *a, size_t at_once, mesh_figures *figures, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &l->scene->m;
    const size_t all = l->scene->luminaires.placed.n, n = all < LUMINAIRES_ALONE ? all : LUMINAIRES_ALONE;
    double found[GATHER_VALUES_MOST], light[GATHER_VALUES_MOST];
    mesh_error_groups groups = {.fewer = n > at_once ? (n + at_once - 1) / at_once : 0};
    mesh_light_sums sums = {.noise2 = NULL};
    TRY(mesh_error_groups_begin(m, at_once, &groups, error));
    TRY(mesh_light_sums_begin(m, &sums, error));
    for (size_t first = 0; first < n; first += at_once) {
        l->n_lights = l->n_chosen = n - first < at_once ? n - first : at_once;
        memset(l->weights, 0, l->n_lights * l->n_chosen * sizeof *l->weights);
        for (size_t k = 0; k < l->n_chosen; k++) {
            l->chosen[k] = (first + k) * all / n;
            l->weights[k * l->n_chosen + k] = 1;
        }
        TRY(judge(l, made, random_next(&seed), a, found, light, &groups, error));
        for (size_t s = 0; s < l->n_lights; s++) mesh_light_sums_add(&groups, s, m, light[s], &sums);
    }
    TRY(mesh_light_sums_state(&sums, m, MESH_OF_LUMINAIRE, &figures->luminaire, &figures->has_luminaire,
                              figures, error));
done:
    mesh_error_groups_free(&groups);
    mesh_light_sums_free(&sums);
    return status;
}

lam_status mesh_error_add_luminaires(const precompute_job *job, const precompute_scene *scene,
                                     made_operator *made, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_figures *figures = &made->errors_of_mesh;
    uint64_t seed = random_mix(precompute_seed(job->options->seed, SEED_MESH_ERROR) + 2);
    const size_t most = GATHER_VALUES_MOST / scene->m.n_channels;
    const size_t at_once = most < LUMINAIRES_ALONE ? most : LUMINAIRES_ALONE;
    luminaire_lights l = {.job = job, .scene = scene};
    luminaire_answers a = {.E = NULL};
    if (scene->luminaires.placed.n == 0) return LAM_OK;
    l.weights =
        memory_allocate(LUMINAIRES_LOOKED_AT, at_once * sizeof *l.weights, "the error of the mesh", error);
    if (l.weights == NULL) TRY(LAM_ERR_MEMORY);
    TRY(answers_begin(&scene->m, made->op, at_once, &a, error));
    TRY(add_all(&l, made, random_next(&seed), &a, figures, error));
    TRY(add_alone(&l, made, random_next(&seed), &a, at_once, figures, error));
    terminal_log(job->t, "mesh     luminaires %.3g, each alone %.3g", figures->luminaires,
                 figures->luminaire);
done:
    free(l.weights);
    answers_free(&a);
    return status;
}
