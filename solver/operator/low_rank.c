/* kind "low_rank": B = E + P E with P of rank k.
 * folded (grey):  P = -Y V^T                      (Aguerre 2016, eq. 2.8)
 * factored:       P_c = rho'_c U core_c V^T       U, V free of reflectance, shared by all channels */
#include "solver/operator/operator.h"
#include "solver/operator/panel_store.h"

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
    core_panels_free(self->core, op->n_channels);
}

/* Takes left, right and core [C][k][k] (NULL: folded), also on an error. */
static lam_status assemble(size_t n, size_t k, size_t n_channels, const float *reflectance, panel *left,
                           panel *right, float *core, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    low_rank *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) {
        panel_free(left);
        panel_free(right);
        TRY(LAM_ERR_MEMORY);
    }
    self->base.kind = &operator_low_rank;
    self->left = *left;
    self->right = *right;
    *left = *right = (panel){0};
    TRY(operator_init(&self->base, &operator_low_rank, n, n_channels, reflectance, error));
    if (core != NULL) TRY(core_panels_create(n_channels, k, core, &self->core, error));
    *op = &self->base;
    self = NULL;
done:
    free(core);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

/* Both forms; core is NULL when folded. Each array goes as soon as its panel stands, so that only one is
 * there twice. */
static lam_status create(size_t n, size_t k, size_t n_channels, const float *reflectance, float *left,
                         float *V, float *core, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    panel left_panel = {0}, V_panel = {0};
    TRY(panel_create(n, k, left, core == NULL ? "/operator/Y" : "/operator/U", &left_panel, error));
    free(left);
    left = NULL;
    TRY(panel_create(n, k, V, "/operator/V", &V_panel, error));
    float *core_taken = core;
    core = NULL;
    TRY(assemble(n, k, n_channels, reflectance, &left_panel, &V_panel, core_taken, op, error));
done:
    panel_free(&left_panel);
    panel_free(&V_panel);
    free(left);
    free(V);
    free(core);
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

/* --- precisions and the store -------------------------------------------------------------------------- */

static lam_status low_rank_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char *form = NULL;
    void *core = NULL;
    panel left = {0}, right = {0};
    size_t k = SIZE_MAX;
    TRY(store_get_text(s, "/operator", "form", &form, error));
    bool folded = strcmp(form, "folded") == 0;
    if (!folded && strcmp(form, "factored") != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown form '%s', must be folded or factored",
             store_path(s), form);
    if (folded && n_channels != 1)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /operator is folded, which needs 1 channel, /mesh/reflectance has %zu", store_path(s),
             n_channels);
    TRY(panel_load(s, folded ? "/operator/Y" : "/operator/U", n, &k, &left, error));
    TRY(panel_load(s, "/operator/V", n, &k, &right, error));
    if (left.precision != right.precision)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has one array of %s and one of %s, must be the same",
             store_path(s), panel_precision_name(left.precision), panel_precision_name(right.precision));
    TRY(panel_check_precision(s, left.precision, error));
    if (!folded) {
        size_t core_dims[STORE_MAX_RANK] = {n_channels, k, k};
        TRY(store_read(s, "/operator/core", STORE_F32, 3, core_dims, &core, error));
    }
    float *core_taken = core;
    core = NULL;
    TRY(assemble(n, k, n_channels, reflectance, &left, &right, core_taken, op, error));
done:
    free(form);
    free(core);
    panel_free(&left);
    panel_free(&right);
    return status;
}

static lam_status low_rank_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const low_rank *self = (const low_rank *)op;
    TRY(store_set_integer(s, "/operator", "rank", (int64_t)self->left.k, error));
    TRY(panel_save(&self->left, s, self->core == NULL ? "/operator/Y" : "/operator/U", error));
    TRY(panel_save(&self->right, s, "/operator/V", error));
    if (self->core != NULL) TRY(core_panels_save(self->core, op->n_channels, s, error));
done:
    return status;
}

static lam_status low_rank_narrow(const lam_operator *op, panel_precision precision, lam_operator **out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const low_rank *self = (const low_rank *)op;
    const size_t k = self->left.k;
    panel left = {0}, right = {0};
    float *core = NULL;
    TRY(panel_convert(&self->left, precision, self->core == NULL ? "/operator/Y" : "/operator/U", &left,
                      error));
    TRY(panel_convert(&self->right, precision, "/operator/V", &right, error));
    if (self->core != NULL) TRY(core_panels_copy(self->core, op->n_channels, &core, error));
    float *core_taken = core;
    core = NULL;
    TRY(assemble(op->n, k, op->n_channels, op->reflectance, &left, &right, core_taken, out, error));
done:
    free(core);
    panel_free(&left);
    panel_free(&right);
    return status;
}

/* --- products ------------------------------------------------------------------------------------------- */

/* t = V^T E and core t, [n_rhs][C][stride] each, and what the products need. */
static size_t low_rank_work_bytes(const lam_operator *op, size_t n_rhs) {
    const low_rank *self = (const low_rank *)op;
    size_t m, t_bytes, product, total = 0;
    if (!size_multiply(n_rhs, op->n_channels, &m) || !size_multiply(m, self->left.stride, &t_bytes) ||
        !size_multiply(t_bytes, sizeof(float), &t_bytes))
        return 0;
    const panel *panels[] = {&self->left, &self->right, self->core};
    product = 0;
    for (size_t i = 0; i < 3 && panels[i] != NULL; i++) {
        const size_t bytes = panel_work_bytes(panels[i], m);
        if (bytes == 0) return 0;
        product = bytes > product ? bytes : product;
    }
    if (!work_add(&total, t_bytes) || !work_add(&total, t_bytes) || !work_add(&total, product)) return 0;
    return total;
}

/* -V^T E (folded) or core_c V^T E_c: [n_rhs][C][stride]; work goes on behind it. */
static float *light_columns(const low_rank *self, size_t n_rhs, const float *E, void **work) {
    size_t C = self->base.n_channels, m = n_rhs * C, stride = self->left.stride;
    float *t = work_take(work, m * stride * sizeof *t);
    float *core_t = work_take(work, m * stride * sizeof *core_t);
    panel_project(&self->right, m, E, self->base.n, t, stride, *work);
    if (self->core == NULL) {
        for (size_t j = 0; j < m * stride; j++) core_t[j] = -t[j];
    } else {
        for (size_t c = 0; c < C; c++)
            panel_expand(&self->core[c], n_rhs, t + c * stride, C * stride, core_t + c * stride, C * stride,
                         *work);
    }
    return core_t;
}

/* P = -Y (V^T E), or P_c = rho'_c U core_c (V^T E_c) */
static void low_rank_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    const low_rank *self = (const low_rank *)op;
    size_t n = op->n, C = op->n_channels, m = n_rhs * C;
    const float *t = light_columns(self, n_rhs, E, &work);
    panel_expand(&self->left, m, t, self->left.stride, P, n, work);
    for (size_t v = 0; v < m && self->core != NULL; v++)
        for (size_t p = 0; p < n; p++) P[v * n + p] *= operator_reflectance_or_one(op, v % C, p);
}

static void low_rank_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                                    const uint32_t *selected, float *P, void *work) {
    const low_rank *self = (const low_rank *)op;
    size_t C = op->n_channels, m = n_rhs * C;
    const float *t = light_columns(self, n_rhs, E, &work);
    panel_expand_rows(&self->left, m, t, self->left.stride, n_selected, selected, op->position, P, n_selected,
                      work);
    for (size_t v = 0; v < m && self->core != NULL; v++)
        for (size_t r = 0; r < n_selected; r++)
            P[v * n_selected + r] *=
                operator_reflectance_or_one(op, v % C, operator_position(op, selected[r]));
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

static void low_rank_set_threads(lam_operator *op, size_t n_threads) {
    low_rank *self = (low_rank *)op;
    self->left.n_threads = self->right.n_threads = n_threads;
    for (size_t c = 0; self->core != NULL && c < op->n_channels; c++) self->core[c].n_threads = n_threads;
}

static void low_rank_describe(const lam_operator *op, operator_description *description) {
    const low_rank *self = (const low_rank *)op;
    description->precision = panel_precision_name(self->left.precision);
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
    .apply_selected = low_rank_apply_selected,
    .set_threads = low_rank_set_threads,
    .narrow = low_rank_narrow,
    .destroy = low_rank_destroy,
    .describe = low_rank_describe,
};
