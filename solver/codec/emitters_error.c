#include "solver/codec/emitters_error.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define GROUP STORE_ERROR "/emitters"

void emitters_error_free(emitters_error *e) {
    free(e->covariance);
    free(e->of_groups);
    free(e->of_means);
    free(e->area);
    free(e->reflectance);
    free(e->direct);
    free(e->exitance);
    free(e->black);
    free(e->group);
    *e = (emitters_error){.s = 0};
}

static lam_status read_finite(store *s, const char *name, int rank, size_t *dims, double **out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    char path[64];
    void *data = NULL;
    size_t count = 1;
    snprintf(path, sizeof path, GROUP "/%s", name);
    TRY(store_read(s, path, STORE_F64, rank, dims, &data, error));
    *out = data;
    for (int d = 0; d < rank; d++) count *= dims[d];
    for (size_t k = 0; k < count; k++)
        if (!isfinite((*out)[k]))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] is not finite", store_path(s), path, k);
done:
    return status;
}

/* The areas, reflectances and direct light of groups. */
static lam_status sum_groups(const error_scene *scene, const emitters_light *light, emitters_error *e,
                             lam_error *error) {
    const group_index *groups = scene->groups;
    const size_t G = e->n_groups = groups->n_groups, C = scene->n_channels, s = e->s, n = scene->n;
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
        for (uint32_t at = groups->start[g]; at < groups->start[g + 1]; at++) {
            const size_t i = groups->elements[at];
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

lam_status emitters_error_read(store *s, const error_scene *scene, const emitters_light *light,
                               emitters_error *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t count = light->s;
    emitters_error e = {.s = count};
    *out = (emitters_error){.s = 0};
    if (light->direct == NULL || !store_has(s, GROUP "/covariance")) return LAM_OK;
    TRY(read_finite(s, "covariance", 2, (size_t[]){count, count}, &e.covariance, error));
    TRY(find_whole(scene, &e.whole, error));
    if (store_has(s, GROUP "/groups")) {
        const size_t G = scene->groups->n_groups;
        TRY(read_finite(s, "groups", 3, (size_t[]){G, count, count}, &e.of_groups, error));
        TRY(read_finite(s, "group_means", 3, (size_t[]){G, count, count}, &e.of_means, error));
        TRY(sum_groups(scene, light, &e, error));
        TRY(reflecting_make(scene->n, scene->n_channels, scene->area, scene->reflectance, G, e.group,
                            &e.black, error));
    }
    *out = e;
    e = (emitters_error){.s = 0};
done:
    emitters_error_free(&e);
    return status;
}

bool emitters_error_knows_groups(const emitters_error *e) {
    return e->of_groups != NULL;
}

/* Of each emitter the largest weight over channels, [s]. */
static void largest_weights(const emitters_error *e, size_t n_channels, const float *W, double *w) {
    for (size_t k = 0; k < e->s; k++) {
        w[k] = 0;
        for (size_t c = 0; c < n_channels; c++) w[k] = fmax(w[k], (double)W[c * e->s + k]);
    }
}

/* w' K w */
static double square(const emitters_error *e, const double *K, const double *w) {
    const size_t s = e->s;
    double sum = 0;
    for (size_t j = 0; j < s; j++) {
        double row = 0;
        for (size_t l = 0; w[j] > 0 && l < s; l++) row += K[j * s + l] * w[l];
        sum += w[j] * row;
    }
    return fmax(sum, 0);
}

bool emitters_mix_create(const emitters_error *e, size_t n_channels, const float *W, emitters_mix *out) {
    const size_t s = e->s, G = e->n_groups;
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

/* The squared errors of a group, found when they are first asked for. */
static void find_group(const emitters_error *e, size_t g, emitters_mix *m) {
    const size_t s = e->s;
    if (m->of_group[g] >= 0) return;
    m->of_group[g] = square(e, e->of_groups + g * s * s, m->weight);
    m->of_mean[g] = square(e, e->of_means + g * s * s, m->weight);
}

void emitters_mix_free(emitters_mix *m) {
    free(m->weight);
    *m = (emitters_mix){.W = NULL};
}

/* The squared error of all elements: by groups where these are kept apart. */
static double error2_of_all(const emitters_error *e, lam_quantity quantity, emitters_mix *mix) {
    double off = 0;
    if (quantity != LAM_IRRADIANCE || e->of_groups == NULL)
        return reflecting_of_elements(&e->whole, quantity, square(e, e->covariance, mix->weight));
    for (size_t g = 0; g < e->n_groups; g++) {
        find_group(e, g, mix);
        off += reflecting_of_elements(&e->black[g], quantity, mix->of_group[g]);
    }
    return off;
}

answer_error emitters_error_of(const emitters_error *e, const error_scene *scene, const error_answer *of,
                               emitters_mix *mix) {
    double off = of->selected != NULL ? 0 : error2_of_all(e, of->quantity, mix);
    for (size_t k = 0; of->selected != NULL && k < of->count; k++) {
        const uint32_t i = of->selected[k], g = e->group[i];
        find_group(e, g, mix);
        off += scene->area[i] / e->area[g] *
               reflecting_of_elements(&e->black[g], of->quantity, mix->of_group[g]);
    }
    answer_error made = answer_error_of_square(scene, of, off);
    made.emitters = mix->emitters;
    return made;
}

name_error emitters_error_of_name(const emitters_error *e, size_t n_channels, lam_quantity quantity,
                                  const reduce_name *name, emitters_mix *mix, const double *mean) {
    const size_t s = e->s, G = e->n_groups;
    double area = 0, off = 0, elements2 = 0, reflected2 = 0, radiosity2 = 0;
    for (size_t k = 0; k < name->n_groups; k++) {
        const size_t g = name->groups[k];
        area += e->area[g];
        find_group(e, g, mix);
        off += e->area[g] * sqrt(reflecting_of_mean(&e->black[g], quantity, mix->of_mean[g]));
        elements2 += reflecting_of_elements(&e->black[g], quantity, mix->of_group[g]);
    }
    if (!(area > 0)) return (name_error){.mean = 0};
    for (size_t c = 0; c < n_channels; c++) {
        double direct = 0, rho = 0;
        for (size_t k = 0; k < name->n_groups; k++) {
            const size_t g = name->groups[k];
            rho += e->area[g] / area * e->reflectance[c * G + g];
            for (size_t l = 0; l < s; l++)
                direct +=
                    e->area[g] / area * (double)mix->W[c * s + l] * e->exitance[c] * e->direct[g * s + l];
        }
        const bool irradiance = quantity == LAM_IRRADIANCE;
        const double r = mean[c] - (irradiance ? direct : quantity == LAM_RADIOSITY ? rho * direct : 0);
        reflected2 += r * r;
        radiosity2 += irradiance ? mean[c] * mean[c] : (r + rho * direct) * (r + rho * direct);
    }
    return name_error_of_squares(off * off / (area * area), elements2 / area, reflected2, radiosity2);
}
