/* The light of a vector of lam_light, its answer, and the figures of answers. */
#include "solver/operator/emitters.h"
#include "solver/operator/groups/group_statistics.h"
#include "solver/operator/scene/lam_scene.h"

#include <stdlib.h>
#include <string.h>

lam_status lam_groups_check(const lam_scene *s, size_t n_groups, const uint32_t *groups, lam_error *error) {
    if (n_groups > 0 && groups == NULL)
        return status_fail(error, LAM_ERR_ARGUMENT, "%zu groups are at no place", n_groups);
    for (size_t k = 0; k < n_groups; k++)
        if (groups[k] >= s->groups.n_groups)
            return status_fail(error, LAM_ERR_ARGUMENT, "groups[%zu] = %u, must be below %zu", k, groups[k],
                               s->groups.n_groups);
    return LAM_OK;
}

lam_status lam_light_check(const lam_scene *s, const lam_light *light, lam_error *error) {
    if (light->n_groups > 0 && light->exitances == NULL)
        return status_fail(error, LAM_ERR_ARGUMENT, "the light has %zu groups without exitances",
                           light->n_groups);
    if (light->L != NULL && s->sky == NULL)
        return status_fail(error, LAM_ERR_ARGUMENT, "the light has a sky, the store has none");
    if (light->D != NULL && s->luminaires == NULL)
        return status_fail(error, LAM_ERR_ARGUMENT, "the light has dimmers, the store has no luminaires");
    if (light->W != NULL && s->linear.n_emitters == 0)
        return status_fail(error, LAM_ERR_ARGUMENT, "the light has weights, the store answers any emission");
    return lam_groups_check(s, light->n_groups, light->groups, error);
}

/* E is zeroed. */
static void add_emission(const lam_scene *s, const lam_light *light, float *E) {
    const size_t n = s->n, C = s->n_channels;
    if (light->E != NULL) memcpy(E, light->E, C * n * sizeof *E);
    for (size_t k = 0; k < light->n_groups; k++)
        for (size_t c = 0; c < C; c++)
            for (uint32_t e = s->groups.start[light->groups[k]]; e < s->groups.start[light->groups[k] + 1];
                 e++)
                E[c * n + s->groups.elements[e]] += light->exitances[k * C + c];
}

/* Of a store of few emitters: the weights of all its light, and what elements and the sky give by these. */
static lam_status take_weights(const lam_scene *s, const lam_light *light, bool with_emission,
                               full_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t row = s->n_channels * s->linear.n_emitters, k = linear_scene_luminaires(&s->linear);
    if (light->E != NULL || light->n_groups > 0 || light->L != NULL)
        TRY(lam_operator_weights(s->op, 1, out->E, linear_scene_tiles(&s->linear), light->L, out->W, error));
    for (size_t w = 0; light->W != NULL && w < row; w++) out->W[w] += light->W[w];
    if (light->D != NULL) operator_emitters_dim(s->op, 1, light->D, out->W);
    out->L = out->D = NULL;
    if (!with_emission) goto done;
    TRY(operator_emitters_light(s->op, 1, out->W, out->E, out->H0, error));
    if (operator_emitters_of(s->op)->a.L != NULL) {
        float *radiances = out->W + row + s->n_channels * k;
        operator_emitters_radiances(s->op, 1, out->W, radiances);
        out->L = radiances;
    }
    /* Luminaires are the last emitters, and their weights dimmers. */
    bool lit = false;
    float *const dimmers = out->W + row;
    for (size_t c = 0; c < s->n_channels; c++)
        for (size_t l = 0; l < k; l++) {
            dimmers[c * k + l] = out->W[(c + 1) * s->linear.n_emitters - k + l];
            lit |= dimmers[c * k + l] != 0;
        }
    if (lit) out->D = dimmers;
done:
    return status;
}

static size_t emitter_tiles(const lam_scene *s) {
    if (s->linear.n_emitters == 0) return 0;
    const emitter_arrays *a = &operator_emitters_of(s->op)->a;
    return a->L != NULL ? a->n_tiles : 0;
}

size_t full_light_room(const lam_scene *s) {
    return s->n_channels *
           (2 * s->n + s->linear.n_emitters + linear_scene_luminaires(&s->linear) + emitter_tiles(s));
}

lam_status full_light_make(const lam_scene *s, const lam_light *light, bool with_emission, float *room,
                           full_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = s->n_channels * s->n;
    const bool few = s->linear.n_emitters > 0, lit = light->L != NULL || light->D != NULL;
    *out = (full_light){.E = room, .L = light->L, .D = light->D};
    TRY(lam_light_check(s, light, error));
    memset(room, 0, (few ? full_light_room(s) : lit ? 2 * vector : vector) * sizeof *room);
    add_emission(s, light, out->E);
    if (few || lit) out->H0 = room + vector;
    if (few) {
        out->W = room + 2 * vector;
        TRY(take_weights(s, light, with_emission, out, error));
    } else {
        if (light->L != NULL) lam_sky_irradiance(s->sky, s->n_channels, light->L, out->H0);
        if (light->D != NULL) lam_luminaires_irradiance(s->luminaires, 1, light->D, out->H0);
    }
done:
    return status;
}

/* Room of a pass: the light of its vectors, and work for its operator and its limiter. */
typedef struct pass_room {
    float *light;
    void *work;
    size_t work_bytes;
} pass_room;

/* The vectors of a pass, at most OPERATOR_PASS. */
static lam_status answer_pass(const lam_scene *s, lam_quantity quantity, size_t count,
                              const lam_light *lights, float *out, size_t *limited, const pass_room *room,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = s->n_channels * s->n, each = full_light_room(s);
    full_light full[OPERATOR_PASS];
    lam_part parts[OPERATOR_PASS];
    for (size_t v = 0; v < count; v++) {
        TRY(full_light_make(s, &lights[v], false, room->light + v * each, &full[v], error));
        parts[v] = (lam_part){1, quantity, full[v].E, full[v].H0, out + v * vector};
        if (full[v].W != NULL)
            TRY(lam_operator_apply_emitters(s->op, 1, quantity, full[v].W, s->n, NULL, out + v * vector,
                                            room->work, room->work_bytes, error));
    }
    if (s->linear.n_emitters == 0)
        TRY(lam_operator_apply_parts(s->op, count, parts, room->work, room->work_bytes, error));
    for (size_t v = 0; limited != NULL && v < count; v++)
        TRY(lam_limiter_apply(&s->limiter, s->op, 1, quantity, full[v].W != NULL ? NULL : full[v].E,
                              full[v].W != NULL ? NULL : full[v].H0, full[v].W, out + v * vector, &limited[v],
                              room->work, room->work_bytes, error));
done:
    return status;
}

lam_status lam_scene_answer(const lam_scene *scene, lam_quantity quantity, size_t n_lights,
                            const lam_light *lights, float *out, size_t *limited, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t most = n_lights < OPERATOR_PASS ? n_lights : OPERATOR_PASS,
                 solving = lam_operator_work_bytes(scene->op, most),
                 limiting = lam_limiter_work_bytes(&scene->limiter);
    pass_room room = {.work_bytes = solving > limiting ? solving : limiting};
    room.light = memory_allocate(most, full_light_room(scene) * sizeof *room.light, "light", error);
    room.work = memory_allocate(1, room.work_bytes, "an answer", error);
    if (room.light == NULL || room.work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < n_lights; v++) TRY(lam_light_check(scene, &lights[v], error));
    for (size_t v = 0; v < n_lights; v += OPERATOR_PASS) {
        const size_t left = n_lights - v;
        TRY(answer_pass(scene, quantity, left < OPERATOR_PASS ? left : OPERATOR_PASS, lights + v,
                        out + v * scene->n_channels * scene->n, limited != NULL ? limited + v : NULL, &room,
                        error));
    }
done:
    free(room.light);
    free(room.work);
    return status;
}

lam_status lam_scene_reduce(const lam_scene *scene, size_t n_groups, const uint32_t *groups, size_t n_rhs,
                            const float *values, double *figures, lam_error *error) {
    lam_status status = LAM_OK;
    static const reduce_statistic order[LAM_FIGURES] = {
        [LAM_MEAN] = REDUCE_MEAN, [LAM_SUM] = REDUCE_SUM,           [LAM_MIN] = REDUCE_MIN,
        [LAM_MAX] = REDUCE_MAX,   [LAM_VARIANCE] = REDUCE_VARIANCE, [LAM_UNIFORMITY] = REDUCE_UNIFORMITY};
    TRY(lam_groups_check(scene, n_groups, groups, error));
    for (size_t row = 0; row < n_rhs * scene->n_channels; row++) {
        double all[REDUCE_COUNT];
        reduce_groups(n_groups, groups, &scene->groups, scene->area,
                      (reduce_values){.floats = values + row * scene->n, .whole = true}, all);
        for (int f = 0; f < LAM_FIGURES; f++) figures[row * LAM_FIGURES + f] = all[order[f]];
    }
done:
    return status;
}
