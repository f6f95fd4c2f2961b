/* kind "two_mesh": a fine mesh of n elements receives, a coarse one of k patches sends (Fernández et al.
 * 2011, section 4). As low_rank, with a V of one entry a row, of which the index vector I is kept (eq. 7); T
 * = V^T E:
 *
 * folded (grey):  P = -Y T                     eq. 5
 * factored:       P_c = rho'_c U core_c T_c    U free of reflectance, shared by all channels */
#include "solver/operator/two_mesh.h"

#include "solver/operator/panel_store.h"
#include "solver/operator/segments.h"

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
    core_panels_free(self->core, op->n_channels);
}

void two_mesh_arrays_free(two_mesh_arrays *arrays) {
    free(arrays->left);
    free(arrays->begin);
    free(arrays->weight);
    free(arrays->coherence);
    free(arrays->core);
    *arrays = (two_mesh_arrays){0};
}

/* Takes left over and what arrays has beside it, also on an error. */
static lam_status assemble(size_t n, size_t n_channels, const float *reflectance, panel *left,
                           two_mesh_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k = left->k;
    two_mesh *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_two_mesh;
    self->left = *left;
    *left = (panel){0};
    TRY(operator_init(&self->base, &operator_two_mesh, n, n_channels, reflectance, error));
    TRY(segments_create(n, k, arrays->begin, arrays->weight, &self->right, error));
    arrays->begin = NULL;
    arrays->weight = NULL;
    for (size_t p = 0; arrays->coherence != NULL && p < k; p++)
        if (!(arrays->coherence[p] >= 0 && arrays->coherence[p] <= 1))
            FAIL(error, LAM_ERR_NUMERIC, "/operator/coherence[%zu] = %g, must be from 0 to 1", p,
                 (double)arrays->coherence[p]);
    self->coherence = arrays->coherence;
    arrays->coherence = NULL;
    if (arrays->core != NULL) TRY(core_panels_create(n_channels, k, arrays->core, &self->core, error));
    *op = &self->base;
    self = NULL;
done:
    panel_free(left);
    two_mesh_arrays_free(arrays);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

lam_status operator_two_mesh_create(size_t n, size_t k, size_t n_channels, const float *reflectance,
                                    two_mesh_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    panel left = {0};
    TRY(panel_create(n, k, arrays->left, arrays->core == NULL ? "/operator/Y" : "/operator/U", &left, error));
    free(arrays->left);
    arrays->left = NULL;
    TRY(assemble(n, n_channels, reflectance, &left, arrays, op, error));
done:
    two_mesh_arrays_free(arrays);
    return status;
}

/* --- precisions and the store -------------------------------------------------------------------------- */

static lam_status two_mesh_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char *form = NULL;
    void *I = NULL, *weight = NULL, *coherence = NULL, *core = NULL;
    panel left = {0};
    size_t k = SIZE_MAX;
    TRY(store_get_text(s, "/operator", "form", &form, error));
    const bool folded = strcmp(form, "folded") == 0;
    if (!folded && strcmp(form, "factored") != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown form '%s', must be folded or factored",
             store_path(s), form);
    if (folded && n_channels != 1)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /operator is folded, which needs 1 channel, /mesh/reflectance has %zu", store_path(s),
             n_channels);
    TRY(panel_load(s, folded ? "/operator/Y" : "/operator/U", n, &k, &left, error));
    TRY(panel_check_precision(s, left.precision, error));
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
    two_mesh_arrays arrays = {.begin = I, .weight = weight, .coherence = coherence, .core = core};
    I = weight = coherence = core = NULL;
    TRY(assemble(n, n_channels, reflectance, &left, &arrays, op, error));
done:
    free(form);
    panel_free(&left);
    free(I);
    free(weight);
    free(coherence);
    free(core);
    return status;
}

static lam_status two_mesh_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const two_mesh *self = (const two_mesh *)op;
    const size_t k = self->left.k, n_ends = k + 1;
    TRY(store_set_integer(s, "/operator", "rank", (int64_t)k, error));
    TRY(panel_save(&self->left, s, self->core == NULL ? "/operator/Y" : "/operator/U", error));
    TRY(store_write(s, "/operator/I", STORE_U64, 1, &n_ends, self->right.begin, error));
    if (self->right.weight != NULL)
        TRY(store_write(s, "/operator/weight", STORE_F32, 1, &op->n, self->right.weight, error));
    if (self->coherence != NULL)
        TRY(store_write(s, "/operator/coherence", STORE_F32, 1, &k, self->coherence, error));
    if (self->core != NULL) TRY(core_panels_save(self->core, op->n_channels, s, error));
done:
    return status;
}

/* A copy of count values; none: NULL. */
static lam_status copy_of(const void *values, size_t count, size_t size, void **copy, lam_error *error) {
    *copy = NULL;
    if (values == NULL) return LAM_OK;
    *copy = memory_allocate(count, size, "operator", error);
    if (*copy == NULL) return LAM_ERR_MEMORY;
    memcpy(*copy, values, count * size);
    return LAM_OK;
}

/* The n x k array alone: I and weights are little beside it. */
static lam_status two_mesh_narrow(const lam_operator *op, panel_precision precision, lam_operator **out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const two_mesh *self = (const two_mesh *)op;
    const segments *right = &self->right;
    const size_t k = self->left.k;
    panel left = {0};
    void *begin = NULL, *weight = NULL, *coherence = NULL;
    float *core = NULL;
    TRY(panel_convert(&self->left, precision, self->core == NULL ? "/operator/Y" : "/operator/U", &left,
                      error));
    TRY(copy_of(right->begin, k + 1, sizeof *right->begin, &begin, error));
    TRY(copy_of(right->weight, op->n, sizeof *right->weight, &weight, error));
    TRY(copy_of(self->coherence, k, sizeof *self->coherence, &coherence, error));
    if (self->core != NULL) TRY(core_panels_copy(self->core, op->n_channels, &core, error));
    two_mesh_arrays arrays = {.begin = begin, .weight = weight, .coherence = coherence, .core = core};
    begin = weight = coherence = core = NULL;
    TRY(assemble(op->n, op->n_channels, op->reflectance, &left, &arrays, out, error));
done:
    panel_free(&left);
    free(begin);
    free(weight);
    free(coherence);
    free(core);
    return status;
}

/* --- products ------------------------------------------------------------------------------------------ */

/* T and core T, [n_rhs][C][stride] each, and what the products need. */
static size_t two_mesh_work_bytes(const lam_operator *op, size_t n_rhs) {
    const two_mesh *self = (const two_mesh *)op;
    size_t m, t_bytes, total = 0;
    if (!size_multiply(n_rhs, op->n_channels, &m) || !size_multiply(m, self->left.stride, &t_bytes) ||
        !size_multiply(t_bytes, sizeof(float), &t_bytes))
        return 0;
    const size_t of_left = panel_work_bytes(&self->left, m);
    const size_t of_core = self->core != NULL ? panel_work_bytes(self->core, n_rhs) : of_left;
    if (of_left == 0 || of_core == 0 || !work_add(&total, t_bytes) || !work_add(&total, t_bytes) ||
        !work_add(&total, of_core > of_left ? of_core : of_left))
        return 0;
    return total;
}

/* -T (folded) or core_c T_c: [n_rhs][C][stride]; work goes on behind it. */
static float *light_columns(const two_mesh *self, size_t n_rhs, const float *E, void **work) {
    const size_t C = self->base.n_channels, m = n_rhs * C, k = self->left.k, stride = self->left.stride;
    float *t = work_take(work, m * stride * sizeof *t);
    float *core_t = work_take(work, m * stride * sizeof *core_t);
    for (size_t v = 0; v < m; v++) segments_sum(&self->right, E + v * self->base.n, t + v * stride);
    if (self->core == NULL) {
        for (size_t v = 0; v < m; v++)
            for (size_t p = 0; p < k; p++) core_t[v * stride + p] = -t[v * stride + p];
    } else {
        for (size_t c = 0; c < C; c++)
            panel_expand(&self->core[c], n_rhs, t + c * stride, C * stride, core_t + c * stride, C * stride,
                         *work);
    }
    return core_t;
}

/* P = -Y T, or P_c = rho'_c U core_c T_c */
static void two_mesh_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    const two_mesh *self = (const two_mesh *)op;
    const size_t n = op->n, C = op->n_channels, m = n_rhs * C;
    const float *t = light_columns(self, n_rhs, E, &work);
    panel_expand(&self->left, m, t, self->left.stride, P, n, work);
    for (size_t v = 0; v < m && self->core != NULL; v++)
        for (size_t j = 0; j < n; j++) P[v * n + j] *= operator_reflectance_or_one(op, v % C, j);
}

static void two_mesh_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                                    const uint32_t *selected, float *P, void *work) {
    const two_mesh *self = (const two_mesh *)op;
    const size_t C = op->n_channels, m = n_rhs * C;
    const float *t = light_columns(self, n_rhs, E, &work);
    panel_expand_rows(&self->left, m, t, self->left.stride, n_selected, selected, op->position, P, n_selected,
                      work);
    for (size_t v = 0; v < m && self->core != NULL; v++)
        for (size_t r = 0; r < n_selected; r++)
            P[v * n_selected + r] *=
                operator_reflectance_or_one(op, v % C, operator_position(op, selected[r]));
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

static void two_mesh_set_threads(lam_operator *op, size_t n_threads) {
    two_mesh *self = (two_mesh *)op;
    self->left.n_threads = n_threads;
    for (size_t c = 0; self->core != NULL && c < op->n_channels; c++) self->core[c].n_threads = n_threads;
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
    .apply_selected = two_mesh_apply_selected,
    .set_threads = two_mesh_set_threads,
    .narrow = two_mesh_narrow,
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
