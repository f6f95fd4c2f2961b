/* kind "low_rank": B = E + P E with P of rank k.
 * folded (grey):  P = -Y V^T                      (Aguerre 2016, eq. 2.8)
 * factored:       P_c = rho'_c U core_c V^T       U, V free of reflectance, shared by all channels */
#include "solver/operator/operator.h"
#include "solver/operator/panel.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct low_rank {
    lam_operator base;
    panel left;  /* [n][k]: Y or U */
    panel right; /* [n][k]: V */
    panel *core; /* [C] of [k][k]; NULL when folded */
} low_rank;

static void low_rank_destroy(lam_operator *op) {
    low_rank *self = (low_rank *)op;
    panel_free(&self->left);
    panel_free(&self->right);
    for (size_t c = 0; self->core != NULL && c < op->n_channels; c++) panel_free(&self->core[c]);
    free(self->core);
}

/* Both forms; core is NULL when folded. Each array goes as soon as its panel stands, so that only one is
 * there twice. */
static lam_status create(size_t n, size_t k, size_t n_channels, const float *reflectance, float *left,
                         float *V, float *core, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char name[48];
    low_rank *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    self->base.kind = &operator_low_rank;
    TRY(operator_init(&self->base, &operator_low_rank, n, n_channels, reflectance, error));
    TRY(panel_create(n, k, left, core == NULL ? "/operator/Y" : "/operator/U", &self->left, error));
    free(left);
    left = NULL;
    TRY(panel_create(n, k, V, "/operator/V", &self->right, error));
    if (core != NULL) {
        self->core = memory_allocate(n_channels, sizeof *self->core, "operator", error);
        if (self->core == NULL) {
            status = LAM_ERR_MEMORY;
            goto done;
        }
        for (size_t c = 0; c < n_channels; c++) {
            snprintf(name, sizeof name, "/operator/core[%zu]", c);
            TRY(panel_create(k, k, core + c * k * k, name, &self->core[c], error));
        }
    }
    *op = &self->base;
    self = NULL;
done:
    free(left);
    free(V);
    free(core);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

lam_status operator_low_rank_create_folded(size_t n, size_t k, const float *reflectance, float *Y, float *V,
                                           lam_operator **op, lam_error *error) {
    return create(n, k, 1, reflectance, Y, V, NULL, op, error);
}

lam_status operator_low_rank_create_factored(size_t n, size_t k, size_t n_channels, const float *reflectance,
                                             float *U, float *V, float *core, lam_operator **op,
                                             lam_error *error) {
    return create(n, k, n_channels, reflectance, U, V, core, op, error);
}

static lam_status low_rank_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char *form = NULL;
    void *left = NULL, *V = NULL, *core = NULL;
    size_t dims[STORE_MAX_RANK] = {n, SIZE_MAX};
    TRY(store_get_text(s, "/operator", "form", &form, error));
    bool folded = strcmp(form, "folded") == 0;
    if (!folded && strcmp(form, "factored") != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown form '%s', must be folded or factored",
             store_path(s), form);
    if (folded && n_channels != 1)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /operator is folded, which needs 1 channel, /mesh/reflectance has %zu", store_path(s),
             n_channels);
    TRY(store_read(s, folded ? "/operator/Y" : "/operator/U", STORE_F32, 2, dims, &left, error));
    size_t k = dims[1];
    TRY(store_read(s, "/operator/V", STORE_F32, 2, dims, &V, error));
    if (!folded) {
        size_t core_dims[STORE_MAX_RANK] = {n_channels, k, k};
        TRY(store_read(s, "/operator/core", STORE_F32, 3, core_dims, &core, error));
    }
    float *left_taken = left, *V_taken = V, *core_taken = core;
    left = V = core = NULL;
    TRY(create(n, k, n_channels, reflectance, left_taken, V_taken, core_taken, op, error));
done:
    free(form);
    free(left);
    free(V);
    free(core);
    return status;
}

/* Writes a panel without its padding. */
static lam_status save_panel(const panel *a, store *s, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[2] = {a->n, a->k};
    float *rows = NULL;
    /* The padded panel was allocated, so the products below cannot overflow. */
    if (a->stride != a->k) {
        rows = memory_allocate(a->n * a->k, sizeof *rows, name, error);
        if (rows == NULL) {
            status = LAM_ERR_MEMORY;
            goto done;
        }
        panel_copy_rows(a, rows);
    }
    TRY(store_write(s, name, STORE_F32, 2, dims, rows != NULL ? rows : a->data, error));
done:
    free(rows);
    return status;
}

static lam_status low_rank_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const low_rank *self = (const low_rank *)op;
    size_t k = self->left.k, count;
    float *core = NULL;
    TRY(store_set_integer(s, "/operator", "rank", (int64_t)k, error));
    TRY(save_panel(&self->left, s, self->core == NULL ? "/operator/Y" : "/operator/U", error));
    TRY(save_panel(&self->right, s, "/operator/V", error));
    if (self->core != NULL) {
        size_t dims[3] = {op->n_channels, k, k};
        if (!size_multiply(k * k, op->n_channels, &count))
            FAIL(error, LAM_ERR_MEMORY, "/operator/core is larger than memory can have");
        core = memory_allocate(count, sizeof *core, "/operator/core", error);
        if (core == NULL) {
            status = LAM_ERR_MEMORY;
            goto done;
        }
        for (size_t c = 0; c < op->n_channels; c++) panel_copy_rows(&self->core[c], core + c * k * k);
        TRY(store_write(s, "/operator/core", STORE_F32, 3, dims, core, error));
    }
done:
    free(core);
    return status;
}

/* t = V^T E and core t, [n_rhs][C][stride] each, and what the products need. */
static size_t low_rank_work_bytes(const lam_operator *op, size_t n_rhs) {
    const low_rank *self = (const low_rank *)op;
    size_t m, t_bytes, product = 0, total = 0;
    if (!size_multiply(n_rhs, op->n_channels, &m) || !size_multiply(m, self->left.stride, &t_bytes) ||
        !size_multiply(t_bytes, sizeof(float), &t_bytes))
        return 0;
    product = panel_work_bytes(&self->left, m);
    if (product == 0 || !work_add(&total, t_bytes) || !work_add(&total, t_bytes) ||
        !work_add(&total, product))
        return 0;
    return total;
}

static void low_rank_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    const low_rank *self = (const low_rank *)op;
    size_t n = op->n, C = op->n_channels, m = n_rhs * C, stride = self->left.stride;
    float *t = work_take(&work, m * stride * sizeof *t);
    float *core_t = work_take(&work, m * stride * sizeof *core_t);
    panel_project(&self->right, m, E, n, t, stride, work);
    if (self->core == NULL) { /* P = -Y (V^T E) */
        for (size_t j = 0; j < m * stride; j++) core_t[j] = -t[j];
        panel_expand(&self->left, m, core_t, stride, P, n, work);
    } else { /* P_c = rho'_c U core_c (V^T E_c) */
        for (size_t c = 0; c < C; c++)
            panel_expand(&self->core[c], n_rhs, t + c * stride, C * stride, core_t + c * stride, C * stride,
                         work);
        panel_expand(&self->left, m, core_t, stride, P, n, work);
        for (size_t v = 0; v < m; v++)
            for (size_t p = 0; p < n; p++) P[v * n + p] *= operator_reflectance_or_one(op, v % C, p);
    }
}

static void low_rank_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    const low_rank *self = (const low_rank *)op;
    size_t n = op->n, C = op->n_channels, m = n_rhs * C, stride = self->left.stride;
    float *t = work_take(&work, m * stride * sizeof *t);
    float *core_t = work_take(&work, m * stride * sizeof *core_t);
    if (self->core == NULL) { /* P^T g = -V (Y^T g) */
        panel_project(&self->left, m, g, n, t, stride, work);
        for (size_t j = 0; j < m * stride; j++) core_t[j] = -t[j];
    } else { /* P_c^T g = V core_c^T (U^T rho'_c g) */
        for (size_t v = 0; v < m; v++)
            for (size_t p = 0; p < n; p++) g[v * n + p] *= operator_reflectance_or_one(op, v % C, p);
        panel_project(&self->left, m, g, n, t, stride, work);
        for (size_t c = 0; c < C; c++)
            panel_project(&self->core[c], n_rhs, t + c * stride, C * stride, core_t + c * stride, C * stride,
                          work);
    }
    panel_expand(&self->right, m, core_t, stride, w, n, work);
}

static void low_rank_describe(const lam_operator *op, operator_description *description) {
    const low_rank *self = (const low_rank *)op;
    description->form = self->core == NULL ? "folded" : "factored";
    description->rank = self->left.k;
    description->bytes = panel_bytes(&self->left) + panel_bytes(&self->right);
    for (size_t c = 0; self->core != NULL && c < op->n_channels; c++)
        description->bytes += panel_bytes(&self->core[c]);
}

const operator_kind operator_low_rank = {
    .name = "low_rank",
    .load = low_rank_load,
    .save = low_rank_save,
    .work_bytes = low_rank_work_bytes,
    .apply = low_rank_apply,
    .apply_adjoint = low_rank_apply_adjoint,
    .destroy = low_rank_destroy,
    .describe = low_rank_describe,
};
