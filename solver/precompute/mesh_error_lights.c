#include "solver/precompute/mesh_error_lights.h"

#include "solver/adapt/mesh_single.h"
#include "solver/base/random.h"
#include "solver/operator/stated/error_law.h"
#include "solver/precompute/precompute.h"
#include "solver/scene/lit_groups.h"

#include <math.h>
#include <stdlib.h>

static emission_size size_of(const mesh *m, const float *E) {
    emission_size size = {.power2 = 0};
    for (size_t c = 0; c < m->n_channels; c++) emission_size_add(&size, m->n, m->area, E + c * m->n);
    return size;
}

double mesh_error_emitters(const mesh *m, const float *E) {
    const emission_size size = size_of(m, E);
    return emission_size_number(&size);
}

double mesh_error_light(const mesh *m, const float *E, const float *B, bool first_bounce) {
    const double power2 = size_of(m, E).power2;
    double sum = 0;
    for (size_t k = 0; k < m->n_channels * m->n; k++) {
        const double x = (double)B[k] - (first_bounce ? 0 : (double)E[k]);
        sum += m->area[k % m->n] * x * x;
    }
    return power2 > 0 ? sum / power2 : 0;
}

lam_status mesh_error_answers(const precompute_scene *scene, const made_operator *made, size_t n_lights,
                              const float *W, const float *E, float *B, void *work, size_t bytes,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = scene->m.n * scene->m.n_channels;
    const lam_quantity quantity = scene->lightened ? LAM_IRRADIANCE : LAM_RADIOSITY;
    if (W != NULL)
        TRY(lam_operator_apply_emitters(made->op, n_lights, quantity, W, 0, NULL, B, work, bytes, error));
    else
        TRY(lam_operator_apply(made->op, n_lights, quantity, E, B, work, bytes, error));
    for (size_t k = 0; scene->lightened && k < n_lights * vector; k++)
        B[k] = (E != NULL ? E[k] : 0) + scene->m.reflectance[k % vector] * B[k];
done:
    return status;
}

lam_status mesh_error_groups_begin(const mesh *m, size_t n_lights, mesh_error_groups *out, lam_error *error) {
    double **const arrays[] = {&out->variance, &out->noise, &out->light2};
    for (int k = 0; k < 3; k++) {
        *arrays[k] =
            memory_allocate(n_lights, m->n_groups * sizeof **arrays[k], "the error of the mesh", error);
        if (*arrays[k] == NULL) return LAM_ERR_MEMORY;
    }
    return LAM_OK;
}

void mesh_error_groups_free(mesh_error_groups *g) {
    free(g->variance);
    free(g->noise);
    free(g->light2);
}

lam_status mesh_error_take(const mesh_error_groups *from, size_t light, int which, size_t n_groups,
                           mesh_figures *to, lam_error *error) {
    double *variation = memory_allocate(n_groups, sizeof *variation, "the error of the mesh", error);
    double *reflected = memory_allocate(n_groups, sizeof *reflected, "the error of the mesh", error);
    to->n_groups = n_groups;
    to->variation[which] = variation;
    to->reflected[which] = reflected;
    if (variation == NULL || reflected == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < n_groups; g++) {
        const size_t k = light * n_groups + g;
        variation[g] = sqrt(fmax(from->variance[k], from->noise[k]));
        reflected[g] = sqrt(from->light2[k]);
    }
    return LAM_OK;
}

/* Groups that are lit alone, and the share of the looks that each of them is worth. */
enum { FEWER = 2, LARGEST_GROUPS = 4, OTHER_GROUPS = 4, GROUPS = LARGEST_GROUPS + OTHER_GROUPS };

void mesh_light_sums_free(mesh_light_sums *s) {
    free(s->area);
    free(s->variance);
}

lam_status mesh_light_sums_begin(const mesh *m, mesh_light_sums *s, lam_error *error) {
    s->area = memory_allocate(m->n_groups, sizeof *s->area, "the error of the mesh", error);
    s->variance = memory_allocate(3, m->n_groups * sizeof *s->variance, "the error of the mesh", error);
    if (s->area == NULL || s->variance == NULL) return LAM_ERR_MEMORY;
    s->noise2 = s->variance + m->n_groups;
    s->light2 = s->noise2 + m->n_groups;
    for (size_t i = 0; i < m->n; i++) s->area[m->group[i]] += m->area[i];
    return LAM_OK;
}

void mesh_light_sums_add(const mesh_error_groups *of, size_t k, const mesh *m, double light,
                         mesh_light_sums *to) {
    const size_t first = k * m->n_groups;
    double all = 0;
    for (size_t g = 0; g < m->n_groups; g++) all += to->area[g] * of->light2[first + g];
    if (!(all > 0)) return;
    for (size_t g = 0; g < m->n_groups; g++) {
        to->variance[g] += of->variance[first + g] / all;
        to->noise2[g] += of->noise[first + g] * of->noise[first + g] / (all * all);
        to->light2[g] += of->light2[first + g] / all;
    }
    to->light += light;
    to->n++;
}

lam_status mesh_light_sums_state(const mesh_light_sums *s, const mesh *m, int which, double *whole, bool *has,
                                 mesh_figures *to, lam_error *error) {
    double off = 0, all = 0;
    for (size_t g = 0; g < m->n_groups; g++) {
        off += s->area[g] * s->variance[g];
        all += s->area[g] * s->light2[g];
        s->noise2[g] = sqrt(s->noise2[g]);
    }
    if (!(all > 0)) return LAM_OK;
    *whole = sqrt(fmax(off, 0) / all);
    *has = true;
    to->light_of[which] = s->light / (double)s->n;
    const mesh_error_groups groups = {s->variance, s->noise2, s->light2, 0};
    return mesh_error_take(&groups, 0, which, m->n_groups, to, error);
}

/* Windows come before other groups, and the larger before the smaller. */
static bool is_lit_more(const mesh *m, const double *area, size_t g, size_t than) {
    const bool window = group_name_is_window(m->group_names[g]);
    return window != group_name_is_window(m->group_names[than]) ? window : area[g] > area[than];
}

/* Groups to be lit: windows and the largest that are no lamps, and some at equal steps of the others in that
 * order. Returns how many. */
static size_t choose_groups(const mesh *m, const double *area, const double *lamps, size_t chosen[GROUPS],
                            size_t *order) {
    size_t n = 0, count = 0;
    for (size_t g = 0; g < m->n_groups; g++)
        if (area[g] > 0 && (lamps == NULL || !(lamps[g] > 0))) order[n++] = g;
    for (size_t k = 0; k < n && count < LARGEST_GROUPS; k++) {
        size_t largest = k;
        for (size_t j = k + 1; j < n; j++)
            if (is_lit_more(m, area, order[j], order[largest])) largest = j;
        const size_t g = order[largest];
        order[largest] = order[k];
        order[k] = g;
        chosen[count++] = g;
    }
    const size_t left = n - count, first = count, others = left < OTHER_GROUPS ? left : OTHER_GROUPS;
    for (size_t k = 0; k < others; k++) chosen[count++] = order[first + k * left / others];
    return count;
}

/* Puts 1 where a group is into all channels of E [C][n]. */
static void light_up(const mesh *m, size_t group, float *E) {
    for (size_t k = 0; k < m->n_channels * m->n; k++) E[k] = m->group[k % m->n] == group ? 1 : 0;
}

/* The lights of all single elements j, of 1 W in each channel, weighted by A_j. mesh_single finds their first
 * bounce. Light that bounces again spreads as that of all elements together: the light of 1 W from everywhere
 * is added to the square, sum_j A_j (l / sum A)^2 = l^2 / sum A with l^2 the mean square of the even light,
 * and nothing to the variance. */
static lam_status add_single(const precompute_job *job, const precompute_scene *scene, mesh_figures *figures,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    const double *even = figures->reflected[MESH_OF_EVEN];
    const uint64_t seed = random_mix(precompute_seed(job->options->seed, SEED_MESH_ERROR));
    mesh_error_groups groups = {.fewer = 0};
    mesh_light_sums sums = {.noise2 = NULL};
    double all = 0, light = 0;
    TRY(mesh_light_sums_begin(m, &sums, error));
    TRY(mesh_error_groups_begin(m, 1, &groups, error));
    TRY(mesh_single(m, seed, &job->progress, &groups, error));
    for (size_t g = 0; g < m->n_groups; g++) all += sums.area[g];
    for (size_t g = 0; g < m->n_groups; g++) {
        if (even != NULL && all > 0) groups.light2[g] += even[g] * even[g] / all;
        light += sums.area[g] * groups.light2[g];
    }
    if (all > 0) mesh_light_sums_add(&groups, 0, m, light / all / (double)m->n_channels, &sums);
    TRY(mesh_light_sums_state(&sums, m, MESH_OF_SINGLE, &figures->single, &figures->has_single, figures,
                              error));
done:
    mesh_error_groups_free(&groups);
    mesh_light_sums_free(&sums);
    return status;
}

/* One group alone: its E and B [C][n] are left, and `groups` filled. Its light is sampled as that of lamps
 * is, as rays alone find a small group by luck. */
static lam_status light_group(const precompute_job *job, const precompute_scene *scene, made_operator *made,
                              size_t group, uint64_t seed, float *E, float *B, mesh_error_groups *groups,
                              lam_error *error) {
    lam_status status = LAM_OK;
    double found;
    const size_t bytes = lam_operator_work_bytes(made->op, 1);
    void *work = memory_allocate(bytes, 1, "the error of the mesh", error);
    if (work == NULL) TRY(LAM_ERR_MEMORY);
    light_up(&scene->m, group, E);
    TRY(mesh_error_answers(scene, made, 1, NULL, E, B, work, bytes, error));
    TRY(mesh_error(&scene->m, 1, E, B, true, NULL, NULL, seed, &job->progress, &found, groups, error));
done:
    free(work);
    return status;
}

/* The share that a light leaves, no less than its noise, and both squares for all lights together. */
static void take_group(const mesh_error_groups *of, const mesh *m, const double *area, double together[2],
                       double *share) {
    double off = 0, noise2 = 0, all = 0;
    for (size_t g = 0; g < m->n_groups; g++) {
        off += area[g] * of->variance[g];
        noise2 += pow(area[g] * of->noise[g], 2);
        all += area[g] * of->light2[g];
    }
    together[0] += off;
    together[1] += all;
    *share = all > 0 ? sqrt(fmax(off, sqrt(noise2)) / all) : 0;
}

/* Single groups, one after the other. */
static lam_status add_groups(const precompute_job *job, const precompute_scene *scene, made_operator *made,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    const size_t vector = m->n * m->n_channels;
    mesh_figures *figures = &made->errors_of_mesh;
    uint64_t seed = precompute_seed(job->options->seed, SEED_MESH_ERROR);
    mesh_error_groups groups = {.fewer = FEWER};
    mesh_light_sums sums = {.noise2 = NULL};
    double logs = 0, together[2] = {0};
    size_t chosen[GROUPS];
    float *E = memory_allocate(vector, sizeof *E, "the error of the mesh", error);
    float *B = memory_allocate(vector, sizeof *B, "the error of the mesh", error);
    size_t *order = memory_allocate(m->n_groups, sizeof *order, "the error of the mesh", error);
    double *share = memory_allocate(m->n_groups, sizeof *share, "the error of the mesh", error);
    double *light = memory_allocate(m->n_groups, sizeof *light, "the error of the mesh", error);
    figures->group_share = share;
    figures->group_light = light;
    if (E == NULL || B == NULL || order == NULL || share == NULL || light == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_light_sums_begin(m, &sums, error));
    TRY(mesh_error_groups_begin(m, 1, &groups, error));
    const size_t n_chosen = choose_groups(m, sums.area, figures->lights_power, chosen, order);
    for (size_t k = 0; k < n_chosen; k++) {
        const size_t g = chosen[k];
        TRY(light_group(job, scene, made, g, random_next(&seed), E, B, &groups, error));
        logs += log(mesh_error_emitters(m, E));
        light[g] = mesh_error_light(m, E, B, false);
        mesh_light_sums_add(&groups, 0, m, light[g], &sums);
        take_group(&groups, m, sums.area, together, &share[g]);
    }
    if (n_chosen == 0) goto done;
    figures->groups_together = together[1] > 0 ? sqrt(fmax(together[0], 0) / together[1]) : 0;
    TRY(mesh_light_sums_state(&sums, m, MESH_OF_GROUPS, &figures->groups, &figures->has_groups, figures,
                              error));
    figures->groups_emitters = exp(logs / (double)n_chosen);
done:
    mesh_error_groups_free(&groups);
    mesh_light_sums_free(&sums);
    free(order);
    free(E);
    free(B);
    return status;
}

lam_status mesh_error_add_others(const precompute_job *job, const precompute_scene *scene,
                                 made_operator *made, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_figures *figures = &made->errors_of_mesh;
    if (emitter_list_count(&scene->emitters) > 0 || scene->importance.emits != NULL) return LAM_OK;
    TRY(add_single(job, scene, figures, error));
    TRY(add_groups(job, scene, made, error));
    terminal_log(job->t, "mesh     single elements %.3g, groups %.3g", figures->single, figures->groups);
done:
    return status;
}
