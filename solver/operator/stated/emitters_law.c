#include "solver/operator/stated/emitters_law.h"

#include "solver/operator/emitters.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>

void emitters_error_free(emitters_error *e) {
    emitter_figures_free(&e->figures);
    free(e->area);
    free(e->reflectance);
    free(e->direct);
    free(e->exitance);
    free(e->black);
    free(e->group);
    *e = (emitters_error){.area = NULL};
}

/* NULL: it has none outside the mesh. */
static const emitter_arrays *outside_of(const lam_operator *op) {
    const emitters *few = operator_emitters_of(op);
    return few != NULL && few->a.direct != NULL ? &few->a : NULL;
}

size_t emitters_error_count(const lam_operator *op) {
    const emitter_arrays *a = outside_of(op);
    return a != NULL ? a->s : 0;
}

/* The areas, reflectances and direct light of groups. */
static lam_status sum_groups(const error_scene *scene, const emitter_arrays *light, emitters_error *e,
                             lam_error *error) {
    const size_t G = scene->n_groups, C = scene->n_channels, s = light->s, n = scene->n;
    e->area = memory_allocate(G, sizeof *e->area, "errors of emitters", error);
    e->reflectance = memory_allocate(G, C * sizeof *e->reflectance, "errors of emitters", error);
    e->direct = memory_allocate(G, s * sizeof *e->direct, "errors of emitters", error);
    e->exitance = memory_allocate(C, sizeof *e->exitance, "errors of emitters", error);
    e->group = memory_allocate(n, sizeof *e->group, "errors of emitters", error);
    if (e->area == NULL || e->reflectance == NULL || e->direct == NULL || e->exitance == NULL ||
        e->group == NULL)
        return LAM_ERR_MEMORY;
    for (size_t c = 0; c < C; c++) e->exitance[c] = (double)light->exitance[c];
    for (size_t g = 0; g < G; g++) {
        for (uint32_t at = scene->start[g]; at < scene->start[g + 1]; at++) {
            const size_t i = scene->members[at];
            e->group[i] = (uint32_t)g;
            e->area[g] += scene->area[i];
            for (size_t c = 0; c < C; c++)
                e->reflectance[c * G + g] += scene->area[i] * (double)scene->reflectance[c * n + i];
            for (size_t k = 0; k < s; k++)
                e->direct[g * s + k] += scene->area[i] * (double)light->direct[k * n + i];
        }
        for (size_t c = 0; e->area[g] > 0 && c < C; c++) e->reflectance[c * G + g] /= e->area[g];
        for (size_t k = 0; e->area[g] > 0 && k < s; k++) e->direct[g * s + k] /= e->area[g];
    }
    return LAM_OK;
}

static lam_status find_whole(const error_scene *scene, reflecting *out, lam_error *error) {
    reflecting *one = NULL;
    uint32_t *group = memory_allocate(scene->n, sizeof *group, "errors of emitters", error);
    if (group == NULL) return LAM_ERR_MEMORY;
    const lam_status status =
        reflecting_make(scene->n, scene->n_channels, scene->area, scene->reflectance, 1, group, &one, error);
    if (status == LAM_OK) *out = *one;
    free(one);
    free(group);
    return status;
}

lam_status emitters_error_make(const error_scene *scene, const lam_operator *op, stated_figures *from,
                               emitters_error *out, lam_error *error) {
    lam_status status = LAM_OK;
    emitters_error e = {.figures = from->emitters};
    *out = (emitters_error){.area = NULL};
    if (e.figures.s == 0) return LAM_OK;
    from->emitters = (emitter_figures){.s = 0};
    TRY(find_whole(scene, &e.whole, error));
    if (e.figures.of_groups != NULL) {
        TRY(sum_groups(scene, outside_of(op), &e, error));
        TRY(reflecting_make(scene->n, scene->n_channels, scene->area, scene->reflectance, scene->n_groups,
                            e.group, &e.black, error));
    }
    *out = e;
    e = (emitters_error){.area = NULL};
done:
    emitters_error_free(&e);
    return status;
}

bool emitters_error_knows_groups(const emitters_error *e) {
    return e->figures.of_groups != NULL;
}

/* Finds the largest weight of each emitter over channels, [s]. */
static void largest_weights(const emitters_error *e, size_t n_channels, const float *W, double *w) {
    for (size_t k = 0; k < e->figures.s; k++) {
        w[k] = 0;
        for (size_t c = 0; c < n_channels; c++) w[k] = fmax(w[k], (double)W[c * e->figures.s + k]);
    }
}

/* w' K w */
static double square(const emitters_error *e, const double *K, const double *w) {
    const size_t s = e->figures.s;
    double sum = 0;
    for (size_t j = 0; j < s; j++) {
        double row = 0;
        for (size_t l = 0; w[j] > 0 && l < s; l++) row += K[j * s + l] * w[l];
        sum += w[j] * row;
    }
    return fmax(sum, 0);
}

bool emitters_mix_create(const emitters_error *e, size_t n_channels, const float *W, emitters_mix *out) {
    const size_t s = e->figures.s, G = e->figures.n_groups;
    emitters_mix m = {.W = W, .weight = memory_allocate(s + 2 * G, sizeof *m.weight, "errors", NULL)};
    double power = 0, squares = 0;
    if (m.weight == NULL) return false;
    m.of_group = m.weight + s;
    m.of_mean = m.of_group + G;
    largest_weights(e, n_channels, W, m.weight);
    for (size_t k = 0; k < s; k++) {
        power += m.weight[k];
        squares += m.weight[k] * m.weight[k];
    }
    m.emitters = squares > 0 ? power * power / squares : 0;
    for (size_t g = 0; g < G; g++) m.of_group[g] = m.of_mean[g] = -1;
    *out = m;
    return true;
}

void emitters_mix_find(const emitters_error *e, size_t g, emitters_mix *m) {
    const size_t s = e->figures.s;
    if (m->of_group[g] >= 0) return;
    m->of_group[g] = square(e, e->figures.of_groups + g * s * s, m->weight);
    m->of_mean[g] = square(e, e->figures.of_means + g * s * s, m->weight);
}

void emitters_mix_free(emitters_mix *m) {
    free(m->weight);
    *m = (emitters_mix){.W = NULL};
}

double emitters_mix_all2(const emitters_error *e, lam_quantity quantity, emitters_mix *mix) {
    double off = 0;
    if (quantity != LAM_IRRADIANCE || e->figures.of_groups == NULL)
        return reflecting_of_elements(&e->whole, quantity, square(e, e->figures.covariance, mix->weight));
    for (size_t g = 0; g < e->figures.n_groups; g++) {
        emitters_mix_find(e, g, mix);
        off += reflecting_of_elements(&e->black[g], quantity, mix->of_group[g]);
    }
    return off;
}
