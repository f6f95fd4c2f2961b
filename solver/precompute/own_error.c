#include "solver/precompute/own_error.h"

#include "solver/light/emission.h"
#include "solver/operator/emitters.h"
#include "solver/operator/stated/answer_error.h"
#include "solver/precompute/stages.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The light and its answer; all [C][n] but work, [2][n], and the last three. */
typedef struct own_answer {
    float *E, *H0, *B, *work;
    void *operator_work;
    bool *read, *emits; /* [n], receivers and sources; NULL: all is read, all may emit */
    /* Of the luminaires: dimmers and factors [C][k], lumens [k] at dimmer 1. */
    float *dimmers;
    double *factors, *lumens;
} own_answer;

static void own_answer_free(own_answer *a) {
    free(a->E);
    free(a->H0);
    free(a->B);
    free(a->work);
    free(a->operator_work);
    free(a->read);
    free(a->emits);
    free(a->dimmers);
    free(a->factors);
    free(a->lumens);
}

static lam_status own_answer_begin(const precompute_scene *scene, size_t operator_bytes, own_answer *a,
                                   lam_error *error) {
    static const char what[] = "the error of luminaires";
    const size_t n = scene->m.n, C = scene->m.n_channels, k = scene->luminaires.placed.n;
    const bool any = scene->importance.n > 0;
    a->E = memory_allocate(C, n * sizeof *a->E, what, error);
    a->H0 = memory_allocate(C, n * sizeof *a->H0, what, error);
    a->B = memory_allocate(C, n * sizeof *a->B, what, error);
    a->work = memory_allocate(2, n * sizeof *a->work, what, error);
    a->operator_work = memory_allocate(operator_bytes, 1, what, error);
    a->dimmers = memory_allocate(C, k * sizeof *a->dimmers, what, error);
    a->factors = memory_allocate(C, k * sizeof *a->factors, what, error);
    a->lumens = memory_allocate(k, sizeof *a->lumens, what, error);
    if (a->E == NULL || a->H0 == NULL || a->B == NULL || a->work == NULL || a->operator_work == NULL ||
        a->dimmers == NULL || a->factors == NULL || a->lumens == NULL)
        return LAM_ERR_MEMORY;
    const float *const weights[] = {any ? scene->importance.read : NULL,
                                    any ? scene->importance.emits : NULL};
    bool **const members[] = {&a->read, &a->emits};
    for (int w = 0; w < 2; w++) {
        if (weights[w] == NULL) continue;
        *members[w] = memory_allocate(n, sizeof **members[w], what, error);
        if (*members[w] == NULL) return LAM_ERR_MEMORY;
        for (size_t i = 0; i < n; i++) (*members[w])[i] = weights[w][i] > 0;
    }
    return LAM_OK;
}

/* E, and H0 = sum over luminaires of dimmer, colour and column. */
static void take_light(const precompute_scene *scene, own_answer *a) {
    const mesh *m = &scene->m;
    const luminaire_columns *columns = &scene->luminaires;
    const placed_luminaires *p = &columns->placed;
    const size_t n = m->n, C = m->n_channels;
    memcpy(a->E, m->emission, C * n * sizeof *a->E);
    for (size_t k = 0; k < p->n; k++) {
        const placed_luminaire *l = &p->luminaires[k];
        a->lumens[k] = columns->scale[k] * p->files[l->file].lumens;
        for (size_t c = 0; c < C; c++) {
            a->dimmers[c * p->n + k] = (float)l->dim;
            a->factors[c * p->n + k] = C == 1 ? 1 : l->colour[c];
            const double weight = (double)a->dimmers[c * p->n + k] * a->factors[c * p->n + k];
            for (size_t i = 0; i < n; i++)
                a->H0[c * n + i] += (float)(weight * (double)columns->H[k * n + i]);
        }
    }
}

/* B of few emitters, unless these cannot give the emission of the scene. */
static lam_status answer_few(const precompute_scene *scene, const lam_operator *op, size_t bytes,
                             own_answer *a, bool *can, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t s = lam_operator_emitters(op);
    float *W = memory_allocate(scene->m.n_channels, s * sizeof *W, "the error of luminaires", error);
    if (W == NULL) return LAM_ERR_MEMORY;
    *can = lam_operator_weights(op, 1, a->E, 0, NULL, W, NULL) == LAM_OK;
    if (!*can) goto done;
    operator_emitters_dim(op, 1, a->dimmers, W);
    TRY(lam_operator_apply_emitters(op, 1, LAM_RADIOSITY, W, 0, NULL, a->B, a->operator_work, bytes, error));
done:
    free(W);
    return status;
}

static lam_status find_error(const precompute_scene *scene, const error_scene *about, const own_answer *a,
                             stated_figures *figures, answer_error *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = about->n;
    const luminaire_columns *columns = &scene->luminaires;
    error_by_group by = {.n_bins = 0};
    error_answer of = {.quantity = LAM_RADIOSITY,
                       .E = a->E,
                       .H0 = a->H0,
                       .count = n,
                       .values = a->B,
                       .luminaires = {.k = columns->placed.n,
                                      .dimmers = a->dimmers,
                                      .factors = a->factors,
                                      .elements_off = columns->elements_off,
                                      .means_off = columns->means_off,
                                      .lumens = a->lumens}};
    TRY(error_by_group_make(about, scene->m.overlap, figures, &by, error));
    for (size_t c = 0; c < about->n_channels; c++)
        error_answer_add_channel(&of, about, c, a->E + c * n, a->H0 + c * n, a->H0 + c * n, a->work);
    if (!answer_error_of(&by, about, &of, out)) TRY(LAM_ERR_MEMORY);
done:
    figures->by_group = by.figures; /* which the laws borrowed */
    by.figures = (group_errors){.n_rows = 0};
    error_by_group_free(&by);
    return status;
}

/* True where luminaires are no sources of the store, or lamps of the scene are none. */
static bool has_other_lamps(const precompute_scene *scene) {
    const mesh *m = &scene->m;
    const importance *of = &scene->importance;
    if (of->n == 0 || of->emits == NULL) return false;
    for (size_t k = 0; k < m->n * m->n_channels; k++)
        if (m->emission[k] > 0 && !(of->emits[k % m->n] > 0)) return true;
    return !of->luminaires;
}

lam_status own_error_find(const precompute_scene *scene, const lam_operator *op, stated_figures *figures,
                          own_figures *out, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    const size_t bytes = lam_operator_work_bytes(op, 1);
    own_answer a = {.E = NULL};
    emission_scene groups = {.m = NULL};
    answer_error found;
    bool any = false, can = true;
    *out = (own_figures){.known = false};
    if (scene->luminaires.placed.n == 0 || figures->by_group.n_rows == 0 || has_other_lamps(scene))
        return LAM_OK;
    TRY(emission_scene_create(m, &groups, error));
    TRY(own_answer_begin(scene, bytes, &a, error));
    take_light(scene, &a);
    if (lam_operator_emitters(op) > 0)
        TRY(answer_few(scene, op, bytes, &a, &can, error));
    else
        TRY(lam_operator_apply_lit(op, 1, LAM_RADIOSITY, a.E, a.H0, a.B, a.operator_work, bytes, error));
    if (!can) goto done;
    for (size_t k = 0; k < m->n * m->n_channels; k++) any = any || a.B[k] > a.E[k];
    if (!any) goto done;
    const error_scene about = {.n = m->n,
                               .n_channels = m->n_channels,
                               .n_groups = groups.groups.n_groups,
                               .area = m->area,
                               .reflectance = m->reflectance,
                               .start = groups.groups.start,
                               .members = groups.groups.elements,
                               .read = a.read,
                               .emits = a.emits,
                               .buried = groups.groups.buried};
    TRY(find_error(scene, &about, &a, figures, &found, error));
    *out = (own_figures){.known = isfinite(found.parts.rest),
                         .relative = found.relative,
                         .indirect = found.indirect,
                         .rest = found.parts.rest,
                         .mesh = found.parts.mesh};
done:
    emission_scene_free(&groups);
    own_answer_free(&a);
    return status;
}

lam_status stage_own_error(const precompute_scene *scene, made_operator *made, lam_error *error) {
    stated_figures figures = {.report = made->errors,
                              .mesh = made->errors_of_mesh,
                              .repair = made->repair,
                              .by_group = made->by_group};
    const lam_status status = own_error_find(scene, made->op, &figures, &made->own, error);
    made->by_group = figures.by_group;
    return status;
}
