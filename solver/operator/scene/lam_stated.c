/* The stated error of an answer, by the laws of its own light where the store has these. */
#include "solver/operator/scene/lam_scene.h"

#include "solver/operator/emitters.h"
#include "solver/operator/stated/answer_error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void take_parts(const stated_parts *parts, int own, lam_stated *out) {
    *out = (lam_stated){stated_of_parts(parts), parts->rest, parts->mesh, own};
}

/* True where all that is asked for are receivers, of a store that was built for these. */
static bool asks_receivers(const lam_scene *s, size_t n_groups, const uint32_t *groups) {
    const stated_errors *e = &s->errors;
    if (e->read == NULL) return false;
    if (n_groups == 0) return stated_errors_others(e, s->n, NULL) == 0;
    for (size_t k = 0; k < n_groups; k++)
        if (stated_errors_others(e, s->groups.start[groups[k] + 1] - s->groups.start[groups[k]],
                                 s->groups.elements + s->groups.start[groups[k]]) > 0)
            return false;
    return true;
}

/* True where something shines that is no source, of a store that was built for these. */
static bool is_strange(const lam_scene *s, const full_light *light) {
    const stated_errors *e = &s->errors;
    const size_t C = s->n_channels, m = linear_scene_tiles(&s->linear),
                 k = linear_scene_luminaires(&s->linear);
    if (e->emits == NULL) return false;
    bool strange = stated_errors_is_strange(e, C, light->E);
    for (size_t t = 0; light->L != NULL && t < C * m; t++) strange |= light->L[t] > 0;
    for (size_t t = 0; light->D != NULL && !e->luminaires && t < C * k; t++) strange |= light->D[t] > 0;
    return strange;
}

/* The answer as the laws of errors take it. lamps [C][n] and work [2][n] are room. */
static error_answer answer_of(const lam_scene *s, lam_quantity quantity, const full_light *light,
                              const float *values, float *lamps, float *work) {
    const size_t C = s->n_channels, n = s->n;
    error_answer of = {.quantity = quantity,
                       .E = light->E,
                       .H0 = light->H0,
                       .count = n,
                       .values = values,
                       .L = light->L,
                       .luminaires = lit_luminaires_of(s->luminaires, light->D)};
    if (light->D != NULL) lam_luminaires_irradiance(s->luminaires, 1, light->D, lamps);
    for (size_t c = 0; c < C; c++) {
        const float *H = light->D != NULL ? lamps + c * n : NULL;
        error_answer_add_channel(&of, &s->about, c, light->E + c * n, H, H, work);
    }
    of.sky = stated_sky_size(&s->errors, C, light->L);
    return of;
}

static lam_status own_error(const lam_scene *s, lam_quantity quantity, const full_light *light,
                            const float *values, size_t n_groups, const uint32_t *groups, lam_stated *out,
                            lam_error *error) {
    const reduce_name name = {.groups = groups, .n_groups = n_groups};
    const size_t C = s->n_channels;
    float *room = memory_allocate(C + 2, s->n * sizeof *room, "a stated error", error);
    if (room == NULL) return LAM_ERR_MEMORY;
    const error_answer of = answer_of(s, quantity, light, values, room, room + C * s->n);
    answer_error all;
    name_error one;
    const bool good = n_groups > 0 ? name_errors_of(&s->errors.by_group, &s->about, &of, 1, &name, &one)
                                   : answer_error_of(&s->errors.by_group, &s->about, &of, &all);
    free(room);
    if (!good) return status_fail(error, LAM_ERR_MEMORY, "not enough memory for a stated error");
    take_parts(n_groups > 0 ? &one.parts : &all.parts, 1, out);
    return LAM_OK;
}

/* Means [C] of values [C][n] over groups, buried elements included, which a mixture's law takes in. */
static void find_means(const lam_scene *s, size_t n_groups, const uint32_t *groups, const float *values,
                       double *means) {
    double area = 0;
    for (size_t c = 0; c < s->n_channels; c++) means[c] = 0;
    for (size_t g = 0; g < n_groups; g++)
        for (uint32_t e = s->groups.start[groups[g]]; e < s->groups.start[groups[g] + 1]; e++) {
            const uint32_t i = s->groups.elements[e];
            area += s->area[i];
            for (size_t c = 0; c < s->n_channels; c++) means[c] += s->area[i] * (double)values[c * s->n + i];
        }
    for (size_t c = 0; area > 0 && c < s->n_channels; c++) means[c] /= area;
}

/* Of a store that states the covariance of its emitters. */
static lam_status mixture_error(const lam_scene *s, lam_quantity quantity, const full_light *light,
                                const float *values, size_t n_groups, const uint32_t *groups, lam_stated *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const emitters_error *e = &s->errors.emitters;
    const reduce_name name = {.groups = groups, .n_groups = n_groups};
    emitters_mix mix = {.W = NULL};
    double *means = memory_allocate(s->n_channels, sizeof *means, "a stated error", error);
    if (means == NULL) TRY(LAM_ERR_MEMORY);
    if (!emitters_mix_create(e, s->n_channels, light->W, &mix))
        FAIL(error, LAM_ERR_MEMORY, "not enough memory for a stated error");
    if (n_groups > 0) {
        find_means(s, n_groups, groups, values, means);
        const name_error one = emitters_error_of_name(e, s->n_channels, quantity, &name, &mix, means);
        take_parts(&one.parts, 1, out);
    } else {
        const error_answer of = {
            .quantity = quantity, .E = light->E, .H0 = light->H0, .count = s->n, .values = values};
        const answer_error all = emitters_error_of(e, &s->about, &of, &mix);
        take_parts(&all.parts, 1, out);
    }
done:
    emitters_mix_free(&mix);
    free(means);
    return status;
}

lam_status lam_scene_stated(const lam_scene *scene, lam_quantity quantity, const lam_light *light,
                            const float *values, size_t n_groups, const uint32_t *groups, lam_stated *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const stated_errors *e = &scene->errors;
    full_light full;
    float *room = memory_allocate(full_light_room(scene), sizeof *room, "light", error);
    if (room == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lam_groups_check(scene, n_groups, groups, error));
    TRY(full_light_make(scene, light, true, room, &full, error));
    const stated_error *all = asks_receivers(scene, n_groups, groups) ? &e->receivers : &e->all;
    if (is_strange(scene, &full))
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "something shines that is none of the store's sources, for which no error is stated");
    if (!all->known)
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "the store states no error; precompute without --probes 0 measures it");
    if (e->emitters.figures.s > 0 && full.W != NULL &&
        (n_groups == 0 || emitters_error_knows_groups(&e->emitters)))
        TRY(mixture_error(scene, quantity, &full, values, n_groups, groups, out, error));
    else if (stated_errors_know(e, scene->luminaires, linear_scene_tiles(&scene->linear), full.L != NULL,
                                full.D != NULL))
        TRY(own_error(scene, quantity, &full, values, n_groups, groups, out, error));
    else
        take_parts(&(stated_parts){.rest = all->indirect, .mesh = e->mesh}, 0, out);
done:
    free(room);
    return status;
}
