#include "server/scene/adjoint_rows.h"

#include "server/scene/direct_light.h"

#include <stdlib.h>
#include <string.h>

linear_scene scene_linear(const scene *s) {
    return (linear_scene){.n = s->n,
                          .n_channels = s->n_channels,
                          .op = s->op,
                          .n_emitters = s->n_emitters,
                          .groups = &s->groups,
                          .area = s->area,
                          .reflectance = s->reflectance,
                          .sky = s->sky,
                          .luminaires = s->luminaires};
}

void adjoint_rows_release(const scene *s, size_t count, adjoint_row **rows) {
    row_cache_release(s->rows, count, rows);
}

bool adjoint_rows_find(const scene *s, const radiosity_request *request, adjoint_row **rows) {
    const reduce_request *reduce = &request->reduce;
    if (row_cache_find(s->rows, reduce->n_names, reduce->names, request->quantity, rows)) return true;
    adjoint_rows_release(s, reduce->n_names, rows);
    return false;
}

size_t adjoint_rows_room(const scene *s, size_t n_rows) {
    const linear_scene of = scene_linear(s);
    const size_t count = n_rows < BATCH_PASS ? n_rows : BATCH_PASS;
    return count * adjoint_row_bytes(&of) + adjoint_pass_bytes(&of, count);
}

size_t adjoint_rows_bytes(const scene *s, const radiosity_request *request) {
    return adjoint_rows_room(s, request->reduce.n_names);
}

size_t adjoint_rows_capacity(const scene *s) {
    const linear_scene of = scene_linear(s);
    const size_t count = row_cache_limit(s->rows) / adjoint_row_bytes(&of);
    return count < ADJOINT_ROWS_OF_REQUEST ? count : ADJOINT_ROWS_OF_REQUEST;
}

/* The weights of a store of emitters, made when first needed; NULL where they are not worth their memory or
 * the ledger has no room for them. False when memory is short. */
static bool get_weights(const scene *s, const emitter_weights **weights) {
    const linear_scene of = scene_linear(s);
    const size_t bytes = emitter_weights_bytes(&of);
    *weights = bytes > 0 ? row_cache_weights(s->rows) : NULL;
    if (bytes == 0 || *weights != NULL || !memory_ledger_take(s->ledger, bytes)) return true;
    emitter_weights *made = emitter_weights_create(&of);
    if (made == NULL) {
        memory_ledger_give_back(s->ledger, bytes);
        return false;
    }
    *weights = row_cache_set_weights(s->rows, made);
    return true;
}

/* Fills the rows of `count` cotangents g, with room for their results behind them, by one pass over the
 * operator. */
static bool fill_rows(const scene *s, lam_quantity quantity, size_t count, float *g,
                      batch_workspace *workspace, adjoint_row *const *rows, problem *why) {
    const linear_scene of = scene_linear(s);
    const size_t work_bytes = lam_operator_work_bytes(s->op, count);
    lam_error error;
    const emitter_weights *weights;
    void *work = work_bytes > 0 ? batch_workspace_get(workspace, work_bytes) : NULL;
    if (work == NULL || !get_weights(s, &weights))
        return problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for %zu adjoint rows", count);
    return adjoint_rows_fill(&of, weights, quantity, count, g, work, work_bytes, rows, &error) == LAM_OK ||
           problem_set(why, PROBLEM_INTERNAL, "%s", error.message);
}

/* Computes the rows of some names, rows[which[k]] that of names[which[k]], by one pass over the operator and
 * adds them to the cache. */
static bool make_rows(const scene *s, const reduce_name *names, lam_quantity quantity, size_t count,
                      const size_t *which, batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const linear_scene of = scene_linear(s);
    const size_t vector = s->n_channels * s->n;
    adjoint_row *made[BATCH_PASS] = {NULL};
    float *const g = memory_allocate(1, adjoint_pass_bytes(&of, count), "rows", NULL);
    bool good = g != NULL;
    for (size_t k = 0; good && k < count; k++)
        good = (made[k] = adjoint_row_create(&of, names[which[k]].groups, names[which[k]].n_groups,
                                             quantity)) != NULL;
    if (!good)
        problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the adjoint rows of %zu groups", count);
    for (size_t k = 0; good && k < count; k++) adjoint_row_cotangent(&of, made[k], g + k * vector);
    good = good && fill_rows(s, quantity, count, g, workspace, made, why);
    for (size_t k = 0; good && k < count; k++) {
        rows[which[k]] = row_cache_publish(s->rows, made[k], &names[which[k]]);
        made[k] = NULL;
    }
    for (size_t k = 0; k < count; k++) adjoint_row_free(made[k]);
    free(g);
    return good;
}

bool adjoint_rows_of_elements(const scene *s, lam_quantity quantity, size_t count, const uint32_t *elements,
                              batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const linear_scene of = scene_linear(s);
    const size_t n = s->n, C = s->n_channels;
    float *const g = memory_allocate(1, adjoint_pass_bytes(&of, count), "rows", NULL);
    bool good = g != NULL;
    for (size_t k = 0; k < count; k++) rows[k] = NULL;
    for (size_t k = 0; good && k < count; k++)
        good = (rows[k] = adjoint_row_create(&of, NULL, 0, quantity)) != NULL;
    if (!good)
        problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for the adjoint rows of %zu elements", count);
    if (good) memset(g, 0, count * C * n * sizeof *g);
    for (size_t k = 0; good && k < count; k++) {
        rows[k]->area = s->area[elements[k]];
        for (size_t c = 0; c < C; c++) g[(k * C + c) * n + elements[k]] = 1;
    }
    good = good && fill_rows(s, quantity, count, g, workspace, rows, why);
    for (size_t k = 0; !good && k < count; k++) {
        adjoint_row_free(rows[k]);
        rows[k] = NULL;
    }
    free(g);
    return good;
}

bool adjoint_rows_get(const scene *s, const radiosity_request *request, size_t first, size_t count,
                      batch_workspace *workspace, adjoint_row **rows, problem *why) {
    const reduce_name *const names = request->reduce.names + first;
    size_t which[BATCH_PASS], n_missing = 0;
    (void)row_cache_find(s->rows, count, names, request->quantity, rows);
    for (size_t k = 0; k < count; k++)
        if (rows[k] == NULL) which[n_missing++] = k;
    if (n_missing == 0 || make_rows(s, names, request->quantity, n_missing, which, workspace, rows, why))
        return true;
    adjoint_rows_release(s, count, rows);
    return false;
}

size_t adjoint_row_work(const scene *s, const radiosity_request *request) {
    /* The size of the light of k luminaires takes k^2 of them. */
    const size_t k = scene_luminaires(s);
    return s->n_channels * (request->n_rhs + request->n_spots + request->sky.n * scene_tiles(s) +
                            request->luminaires.n * (k + 1) * k + request->emitters.n * s->n_emitters);
}

/* Vector v of a request. weights [n_rhs][C][s], unless NULL, stand for all of it. */
static source_light light_of(const scene *s, const radiosity_request *request, const float *weights,
                             size_t v) {
    const size_t C = s->n_channels, spot = radiosity_request_spots(request, v);
    if (weights != NULL) return (source_light){.W = weights + v * C * s->n_emitters};
    return (source_light){
        .E = request->E != NULL && (s->n_emitters == 0 || request->n_dense > 0) ? request->E + v * C * s->n
                                                                                : NULL,
        .spots = request->spots + spot,
        .colours = request->colours + spot * C,
        .n_spots = radiosity_request_spots(request, v + 1) - spot,
        .L = request->sky.values != NULL && v < request->sky.n ? request->sky.values + v * C * scene_tiles(s)
                                                               : NULL,
        .D = request->luminaires.values != NULL && v < request->luminaires.n
                 ? request->luminaires.values + v * C * scene_luminaires(s)
                 : NULL,
        .W = request->emitters.values != NULL && v < request->emitters.n
                 ? request->emitters.values + v * C * s->n_emitters
                 : NULL};
}

bool adjoint_row_answers(const scene *s, const adjoint_row *row, const radiosity_request *request) {
    const linear_scene of = scene_linear(s);
    bool suffices = true;
    for (size_t v = 0; suffices && v < request->n_rhs; v++) {
        const source_light light = light_of(s, request, NULL, v);
        suffices = adjoint_row_suffices(&of, row, &light);
    }
    return suffices;
}

void adjoint_row_means(const scene *s, const adjoint_row *row, const radiosity_request *request,
                       const float *weights, double *means) {
    const linear_scene of = scene_linear(s);
    for (size_t v = 0; v < request->n_rhs; v++) {
        const source_light light = light_of(s, request, weights, v);
        adjoint_row_evaluate(&of, row, &light, means + v * s->n_channels);
    }
}
