/* kind "exact": the whole n x n matrix of every channel. O(n^2) memory and time; small scenes, and a judge of
 * the other kinds. */
#include "solver/linalg/panel.h"
#include "solver/operator/operator.h"
#include "store/groups.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct exact {
    lam_operator base;
    panel *P; /* [C] of [n][n]: M - I, rows of rho = 0 as if rho were 1 there */
} exact;

static void exact_destroy(lam_operator *op) {
    exact *self = (exact *)op;
    for (size_t c = 0; self->P != NULL && c < op->n_channels; c++) panel_free(&self->P[c]);
    free(self->P);
}

lam_status operator_exact_create(size_t n, size_t n_channels, const float *reflectance, float *P,
                                 lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    exact *self = memory_allocate(1, sizeof *self, "operator", error);
    char name[48];
    if (self == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    self->base.kind = &operator_exact;
    TRY(operator_init(&self->base, &operator_exact, n, n_channels, reflectance, error));
    self->P = memory_allocate(n_channels, sizeof *self->P, "operator", error);
    if (self->P == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    for (size_t c = 0; c < n_channels; c++) {
        float *P_c = P + c * n * n;
        /* The file holds 1 + P_ii, which keeps P_ii to 6e-8 absolute (half a unit of 1): no more than B_i
         * itself is rounded by, though relative to a small P_ii it is much. Rounding here already makes
         * saving and loading change nothing: M - 1 is exact. */
        for (size_t i = 0; i < n; i++) {
            float M_ii = 1.0f + P_c[i * n + i];
            P_c[i * n + i] = M_ii - 1.0f;
        }
        snprintf(name, sizeof name, STORE_OPERATOR "/M[%zu]", c);
        TRY(panel_create(n, n, P_c, name, &self->P[c], error));
    }
    *op = &self->base;
    self = NULL;
done:
    free(P);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

static lam_status exact_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                             lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    size_t dims[STORE_MAX_RANK] = {n_channels, n, n};
    TRY(store_read(s, STORE_OPERATOR "/M", STORE_F32, 3, dims, &data, error));
    float *P = data;
    for (size_t c = 0; c < n_channels; c++)
        for (size_t i = 0; i < n; i++) P[(c * n + i) * n + i] -= 1.0f;
    data = NULL;
    TRY(operator_exact_create(n, n_channels, reflectance, P, op, error));
done:
    free(data);
    return status;
}

static lam_status exact_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const exact *self = (const exact *)op;
    size_t n = op->n, count;
    size_t dims[3] = {op->n_channels, n, n};
    float *M = NULL;
    if (!size_multiply(n, n, &count) || !size_multiply(count, op->n_channels, &count))
        FAIL(error, LAM_ERR_MEMORY, STORE_OPERATOR "/M is larger than memory can have");
    M = memory_allocate(count, sizeof *M, STORE_OPERATOR "/M", error);
    if (M == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    for (size_t c = 0; c < op->n_channels; c++) {
        panel_copy_rows(&self->P[c], M + c * n * n);
        for (size_t i = 0; i < n; i++) M[(c * n + i) * n + i] += 1.0f;
    }
    TRY(store_write(s, STORE_OPERATOR "/M", STORE_F32, 3, dims, M, error));
done:
    free(M);
    return status;
}

static size_t exact_work_bytes(const lam_operator *op, size_t n_rhs) {
    const exact *self = (const exact *)op;
    return panel_work_bytes(&self->P[0], n_rhs);
}

/* P_c E_c */
static void exact_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    const exact *self = (const exact *)op;
    size_t n = op->n, stride = op->n_channels * n;
    for (size_t c = 0; c < op->n_channels; c++)
        panel_expand(&self->P[c], n_rhs, E + c * n, stride, P + c * n, stride, work);
}

/* P_c^T g_c */
static void exact_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    const exact *self = (const exact *)op;
    size_t n = op->n, stride = op->n_channels * n;
    for (size_t c = 0; c < op->n_channels; c++)
        panel_project(&self->P[c], n_rhs, g + c * n, stride, w + c * n, stride, work);
}

/* P_c E_c, some rows of it */
static void exact_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                                 const uint32_t *selected, float *P, void *work) {
    const exact *self = (const exact *)op;
    size_t n = op->n, C = op->n_channels;
    for (size_t c = 0; c < C; c++)
        panel_expand_rows(&self->P[c], n_rhs, E + c * n, C * n, n_selected, selected, op->position,
                          P + c * n_selected, C * n_selected, work);
}

static void exact_set_threads(lam_operator *op, size_t n_threads) {
    exact *self = (exact *)op;
    for (size_t c = 0; c < op->n_channels; c++) self->P[c].n_threads = n_threads;
}

static void exact_describe(const lam_operator *op, operator_description *description) {
    const exact *self = (const exact *)op;
    description->density = 1.0;
    for (size_t c = 0; c < op->n_channels; c++) description->bytes += panel_bytes(&self->P[c]);
}

const operator_kind operator_exact = {
    .name = "exact",
    .load = exact_load,
    .save = exact_save,
    .work_bytes = exact_work_bytes,
    .apply = exact_apply,
    .apply_adjoint = exact_apply_adjoint,
    .apply_selected = exact_apply_selected,
    .set_threads = exact_set_threads,
    .destroy = exact_destroy,
    .describe = exact_describe,
    .whole = true,
};
