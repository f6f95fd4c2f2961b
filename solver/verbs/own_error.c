#include "solver/verbs/own_error.h"

#include "solver/operator/emitters.h"
#include "solver/verbs/own_light.h"

#include <math.h>
#include <stdlib.h>

/* Takes the larger of the figures of a name of one vector. */
static void raise_name(name_error *kept, const name_error *own) {
    headline of_name = {.known = true, .parts = kept->parts};
    headline_raise(&of_name, &own->parts);
    kept->parts = of_name.parts;
    kept->mean = fmax(kept->mean, own->mean);
    kept->elements = fmax(kept->elements, own->elements);
}

/* The same for a vector. A name that no light reaches has an error and no light that this could be a share
 * of: it says nothing of the vector unless all names are so. */
static void raise_vector(answer_error *vector, const name_error *own, bool *any_lit) {
    headline of_vector = {.known = true, .parts = vector->parts};
    const bool name_is_lit = headline_has_light(&own->parts);
    if (*any_lit && !name_is_lit) return;
    if (name_is_lit && !*any_lit) {
        of_vector.parts = (stated_parts){.mesh = -1};
        vector->indirect = vector->relative = 0;
    }
    *any_lit = *any_lit || name_is_lit;
    headline_raise(&of_vector, &own->parts);
    vector->parts = of_vector.parts;
    vector->indirect = fmax(vector->indirect, own->mean);
    vector->relative = fmax(vector->relative, own->relative);
}

/* The error of one vector, or of the names that are reduced: the larger figures stay. */
static lam_status add_own_error(const stated_errors *stated, const error_scene *scene, const error_answer *of,
                                solution *out, name_error *names, lam_error *error) {
    const emission_size both = emission_size_sum(&of->size, &of->sky);
    const double number = emission_size_number(&both);
    answer_error one = {.relative = 0};
    bool good = true, any_lit = false;
    if (out->n_reductions == 0) good = answer_error_of(&stated->by_group, scene, of, &one);
    for (size_t r = 0; good && r < out->n_reductions; r++) {
        name_error name;
        good = name_errors_of(&stated->by_group, scene, of, out->reductions[r].request.n_names,
                              out->reductions[r].request.names, &name);
        if (!good) break;
        raise_name(&names[r], &name);
        raise_vector(&one, &name, &any_lit);
    }
    if (!good) return status_fail(error, LAM_ERR_MEMORY, "not enough memory for the error of the answer");
    if (one.indirect >= out->indirect) out->emitters = number;
    out->indirect = fmax(out->indirect, one.indirect);
    out->relative = fmax(out->relative, one.relative);
    headline_raise(&out->head, &one.parts);
    return LAM_OK;
}

/* Replaces the error of the store by that of the answer's own light, of a batch the largest over its vectors,
 * unless nothing is stated. */
static lam_status take_emission(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                                size_t n_selected, const uint32_t *selected, solution *out,
                                name_error **names, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = scene->n, row = n * scene->n_channels;
    const error_by_group *by = &stated->by_group;
    own_light light = {.n_tiles = 0};
    name_error *made = NULL;
    if (by->n_bins == 0 || out->relative < 0) return LAM_OK;
    TRY(own_light_make(lit, scene, &light, error));
    if (light.n_tiles > 0 && by->figures.n_tiles != light.n_tiles) goto done;
    made = memory_allocate(out->n_reductions, sizeof *made, "errors", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    out->relative = out->indirect = 0;
    out->head.parts = (stated_parts){.mesh = -1};
    for (size_t r = 0; r < out->n_reductions; r++) made[r].name = out->reductions[r].group;
    for (size_t v = 0; v < out->n_vectors; v++) {
        error_answer of = {.quantity = out->quantity,
                           .count = selected != NULL ? n_selected : n,
                           .selected = selected,
                           .values = out->values + v * row,
                           .whole = true};
        TRY(own_light_take(&light, v, error));
        own_light_put(&light, by, &of);
        TRY(add_own_error(stated, scene, &of, out, made, error));
    }
    out->error_light = "own";
    if (out->n_reductions > 0) out->name_errors = made;
    *names = made;
    made = NULL;
done:
    own_light_free(&light);
    free(made);
    return status;
}

/* Means [C] of the values of a vector over a name. */
static void mean_of_name(const error_scene *scene, const reduce_name *name, const float *values,
                         double *mean) {
    double area = 0;
    for (size_t c = 0; c < scene->n_channels; c++) mean[c] = 0;
    for (size_t g = 0; g < name->n_groups; g++)
        for (uint32_t at = scene->start[name->groups[g]]; at < scene->start[name->groups[g] + 1]; at++) {
            const size_t i = scene->members[at];
            area += scene->area[i];
            for (size_t c = 0; c < scene->n_channels; c++)
                mean[c] += scene->area[i] * (double)values[c * scene->n + i];
        }
    for (size_t c = 0; area > 0 && c < scene->n_channels; c++) mean[c] /= area;
}

/* The same of mixtures of emitters whose covariance is stated. */
static lam_status take_mixture(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                               solution *out, name_error **names, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = scene->n, C = scene->n_channels, s = lam_operator_emitters(lit->op);
    const emitters_error *e = &stated->emitters;
    const emission *given = &lit->light;
    emitters_mix mix = {.W = NULL};
    if (e->figures.s == 0 || given->W == NULL || out->relative < 0 ||
        (out->n_reductions > 0 && !emitters_error_knows_groups(e)))
        return LAM_OK;
    name_error *made = memory_allocate(out->n_reductions, sizeof *made, "errors", error);
    double *mean = memory_allocate(C, sizeof *mean, "errors", error);
    float *light = memory_allocate(2 * C, n * sizeof *light, "errors", error);
    if (made == NULL || mean == NULL || light == NULL) TRY(LAM_ERR_MEMORY);
    out->relative = out->indirect = 0;
    out->head.parts = (stated_parts){.mesh = -1};
    for (size_t r = 0; r < out->n_reductions; r++) made[r].name = out->reductions[r].group;
    for (size_t v = 0; v < out->n_vectors; v++) {
        const float *weights = given->W + (given->steady ? 0 : v * C * s), *values = out->values + v * C * n;
        const error_answer of = {
            .quantity = out->quantity, .E = light, .H0 = light + C * n, .count = n, .values = values};
        if (!emitters_mix_create(e, C, weights, &mix)) TRY(LAM_ERR_MEMORY);
        answer_error one = {.emitters = mix.emitters};
        bool any_lit = false;
        if (out->n_reductions == 0) {
            TRY(operator_emitters_light(lit->op, 1, weights, light, light + C * n, error));
            one = emitters_error_of(e, scene, &of, &mix);
        }
        for (size_t r = 0; r < out->n_reductions; r++) {
            const reduce_name *name = &out->reductions[r].request.names[0];
            mean_of_name(scene, name, values, mean);
            const name_error own = emitters_error_of_name(e, C, out->quantity, name, &mix, mean);
            raise_name(&made[r], &own);
            raise_vector(&one, &own, &any_lit);
        }
        emitters_mix_free(&mix);
        if (one.indirect >= out->indirect) out->emitters = one.emitters;
        out->indirect = fmax(out->indirect, one.indirect);
        out->relative = fmax(out->relative, one.relative);
        headline_raise(&out->head, &one.parts);
    }
    out->error_light = "own";
    if (out->n_reductions > 0) out->name_errors = made;
    *names = made;
    made = NULL;
done:
    emitters_mix_free(&mix);
    free(made);
    free(mean);
    free(light);
    return status;
}

lam_status own_error_take(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                          size_t n_selected, const uint32_t *selected, solution *out, name_error **names,
                          lam_error *error) {
    if (stated->emitters.figures.s > 0) return take_mixture(stated, scene, lit, out, names, error);
    return take_emission(stated, scene, lit, n_selected, selected, out, names, error);
}
