/* kind "two_mesh": a fine mesh of n elements receives, a coarse one of k patches sends (Fernández et al.
 * 2011, section 4). As low_rank, with a V of one entry a row, of which the index vector I is kept (eq. 7); T
 * = V^T E:
 *
 * folded (grey):  P = -Y T                     eq. 5
 * factored:       P_c = rho'_c U core_c T_c    U free of reflectance, shared by all channels */
#include "solver/operator/two_mesh.h"

#include "solver/operator/panel.h"
#include "solver/operator/segments.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct two_mesh {
    lam_operator base;
    panel left;       /* [n][k]: Y or U */
    segments right;   /* V */
    float *coherence; /* [k], or NULL */
    panel *core;      /* [C] of [k][k]; NULL when folded */
} two_mesh;

static void two_mesh_destroy(lam_operator *op) {
    two_mesh *self = (two_mesh *)op;
    panel_free(&self->left);
    segments_free(&self->right);
    free(self->coherence);
    for (size_t c = 0; self->core != NULL && c < op->n_channels; c++) panel_free(&self->core[c]);
    free(self->core);
}

void two_mesh_arrays_free(two_mesh_arrays *arrays) {
    free(arrays->left);
    free(arrays->begin);
    free(arrays->weight);
    free(arrays->coherence);
    free(arrays->core);
    *arrays = (two_mesh_arrays){0};
}

lam_status operator_two_mesh_create(size_t n, size_t k, size_t n_channels, const float *reflectance,
                                    two_mesh_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char name[48];
    const bool folded = arrays->core == NULL;
    two_mesh *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_two_mesh;
    TRY(operator_init(&self->base, &operator_two_mesh, n, n_channels, reflectance, error));
    TRY(panel_create(n, k, arrays->left, folded ? "/operator/Y" : "/operator/U", &self->left, error));
    free(arrays->left);
    arrays->left = NULL;
    TRY(segments_create(n, k, arrays->begin, arrays->weight, &self->right, error));
    arrays->begin = NULL;
    arrays->weight = NULL;
    for (size_t p = 0; arrays->coherence != NULL && p < k; p++)
        if (!(arrays->coherence[p] >= 0 && arrays->coherence[p] <= 1))
            FAIL(error, LAM_ERR_NUMERIC, "/operator/coherence[%zu] = %g, must be from 0 to 1", p,
                 (double)arrays->coherence[p]);
    self->coherence = arrays->coherence;
    arrays->coherence = NULL;
    if (!folded) {
        self->core = memory_allocate(n_channels, sizeof *self->core, "operator", error);
        if (self->core == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t c = 0; c < n_channels; c++) {
            snprintf(name, sizeof name, "/operator/core[%zu]", c);
            TRY(panel_create(k, k, arrays->core + c * k * k, name, &self->core[c], error));
        }
    }
    *op = &self->base;
    self = NULL;
done:
    two_mesh_arrays_free(arrays);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

static lam_status two_mesh_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char *form = NULL;
    void *left = NULL, *I = NULL, *weight = NULL, *coherence = NULL, *core = NULL;
    size_t dims[STORE_MAX_RANK] = {n, SIZE_MAX};
    TRY(store_get_text(s, "/operator", "form", &form, error));
    const bool folded = strcmp(form, "folded") == 0;
    if (!folded && strcmp(form, "factored") != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown form '%s', must be folded or factored",
             store_path(s), form);
    if (folded && n_channels != 1)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /operator is folded, which needs 1 channel, /mesh/reflectance has %zu", store_path(s),
             n_channels);
    TRY(store_read(s, folded ? "/operator/Y" : "/operator/U", STORE_F32, 2, dims, &left, error));
    const size_t k = dims[1];
    if (k == 0 || k > n)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has %zu patches, must be at least 1 and at most %zu",
             store_path(s), k, n);
    TRY(store_read(s, "/operator/I", STORE_U64, 1, (size_t[STORE_MAX_RANK]){k + 1}, &I, error));
    if (store_has(s, "/operator/weight"))
        TRY(store_read(s, "/operator/weight", STORE_F32, 1, (size_t[STORE_MAX_RANK]){n}, &weight, error));
    if (store_has(s, "/operator/coherence"))
        TRY(store_read(s, "/operator/coherence", STORE_F32, 1, (size_t[STORE_MAX_RANK]){k}, &coherence,
                       error));
    if (!folded)
        TRY(store_read(s, "/operator/core", STORE_F32, 3, (size_t[STORE_MAX_RANK]){n_channels, k, k}, &core,
                       error));
    two_mesh_arrays arrays = {
        .left = left, .begin = I, .weight = weight, .coherence = coherence, .core = core};
    left = I = weight = coherence = core = NULL;
    TRY(operator_two_mesh_create(n, k, n_channels, reflectance, &arrays, op, error));
done:
    free(form);
    free(left);
    free(I);
    free(weight);
    free(coherence);
    free(core);
    return status;
}

/* Panels one after the other without their padding, [count][n][k] or, of one, [n][k]. */
static lam_status save_panels(const panel *a, size_t count, int rank, store *s, const char *name,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t dims[3] = {count, a->n, a->k}, one = a->n * a->k;
    size_t all;
    float *rows = NULL;
    if (!size_multiply(one, count, &all))
        FAIL(error, LAM_ERR_MEMORY, "%s is larger than memory can have", name);
    rows = memory_allocate(all, sizeof *rows, name, error);
    if (rows == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < count; i++) panel_copy_rows(&a[i], rows + i * one);
    TRY(store_write(s, name, STORE_F32, rank, dims + 3 - rank, rows, error));
done:
    free(rows);
    return status;
}

static lam_status two_mesh_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const two_mesh *self = (const two_mesh *)op;
    const size_t k = self->left.k, n_ends = k + 1;
    TRY(store_set_integer(s, "/operator", "rank", (int64_t)k, error));
    TRY(save_panels(&self->left, 1, 2, s, self->core == NULL ? "/operator/Y" : "/operator/U", error));
    TRY(store_write(s, "/operator/I", STORE_U64, 1, &n_ends, self->right.begin, error));
    if (self->right.weight != NULL)
        TRY(store_write(s, "/operator/weight", STORE_F32, 1, &op->n, self->right.weight, error));
    if (self->coherence != NULL)
        TRY(store_write(s, "/operator/coherence", STORE_F32, 1, &k, self->coherence, error));
    if (self->core != NULL) TRY(save_panels(self->core, op->n_channels, 3, s, "/operator/core", error));
done:
    return status;
}

/* T and core T, [n_rhs][C][stride] each, and what the products need. */
static size_t two_mesh_work_bytes(const lam_operator *op, size_t n_rhs) {
    const two_mesh *self = (const two_mesh *)op;
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

static void two_mesh_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    const two_mesh *self = (const two_mesh *)op;
    const size_t n = op->n, C = op->n_channels, m = n_rhs * C, k = self->left.k, stride = self->left.stride;
    float *t = work_take(&work, m * stride * sizeof *t);
    float *core_t = work_take(&work, m * stride * sizeof *core_t);
    for (size_t v = 0; v < m; v++) segments_sum(&self->right, E + v * n, t + v * stride);
    if (self->core == NULL) { /* P = -Y T */
        for (size_t v = 0; v < m; v++)
            for (size_t p = 0; p < k; p++) t[v * stride + p] = -t[v * stride + p];
        panel_expand(&self->left, m, t, stride, P, n, work);
        return;
    }
    for (size_t c = 0; c < C; c++) /* P_c = rho'_c U core_c T_c */
        panel_expand(&self->core[c], n_rhs, t + c * stride, C * stride, core_t + c * stride, C * stride,
                     work);
    panel_expand(&self->left, m, core_t, stride, P, n, work);
    for (size_t v = 0; v < m; v++)
        for (size_t j = 0; j < n; j++) P[v * n + j] *= operator_reflectance_or_one(op, v % C, j);
}

static void two_mesh_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    const two_mesh *self = (const two_mesh *)op;
    const size_t n = op->n, C = op->n_channels, m = n_rhs * C, k = self->left.k, stride = self->left.stride;
    float *t = work_take(&work, m * stride * sizeof *t);
    float *core_t = work_take(&work, m * stride * sizeof *core_t);
    if (self->core == NULL) { /* P^T g = -V (Y^T g) */
        panel_project(&self->left, m, g, n, core_t, stride, work);
        for (size_t v = 0; v < m; v++)
            for (size_t p = 0; p < k; p++) core_t[v * stride + p] = -core_t[v * stride + p];
    } else { /* P_c^T g = V core_c^T (U^T rho'_c g) */
        for (size_t v = 0; v < m; v++)
            for (size_t j = 0; j < n; j++) g[v * n + j] *= operator_reflectance_or_one(op, v % C, j);
        panel_project(&self->left, m, g, n, t, stride, work);
        for (size_t c = 0; c < C; c++)
            panel_project(&self->core[c], n_rhs, t + c * stride, C * stride, core_t + c * stride, C * stride,
                          work);
    }
    for (size_t v = 0; v < m; v++) segments_spread(&self->right, core_t + v * stride, w + v * n);
}

static void two_mesh_describe(const lam_operator *op, operator_description *description) {
    const two_mesh *self = (const two_mesh *)op;
    description->precision = panel_precision_name(self->left.precision);
    description->form = self->core == NULL ? "folded" : "factored";
    description->rank = self->left.k;
    description->bytes = panel_bytes(&self->left) + segments_bytes(&self->right);
    for (size_t c = 0; self->core != NULL && c < op->n_channels; c++)
        description->bytes += panel_bytes(&self->core[c]);
}

const operator_kind operator_two_mesh = {
    .name = "two_mesh",
    .load = two_mesh_load,
    .save = two_mesh_save,
    .work_bytes = two_mesh_work_bytes,
    .apply = two_mesh_apply,
    .apply_adjoint = two_mesh_apply_adjoint,
    .destroy = two_mesh_destroy,
    .describe = two_mesh_describe,
};

bool operator_patches_of(const lam_operator *op, operator_patches *patches) {
    if (op->kind != &operator_two_mesh) return false;
    const two_mesh *self = (const two_mesh *)op;
    *patches = (operator_patches){.k = self->left.k,
                                  .begin = self->right.begin,
                                  .order = op->order,
                                  .weight = self->right.weight,
                                  .coherence = self->coherence};
    return true;
}
