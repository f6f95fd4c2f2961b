#include "solver/operator/factors.h"

#include "solver/base/work_area.h"
#include "solver/linalg/panel_store.h"
#include "store/groups.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *name_of_left(const factors *f) {
    return f->core == NULL ? STORE_OPERATOR "/Y" : STORE_OPERATOR "/U";
}

void factors_free(factors *f) {
    if (!f->borrowed) panel_free(&f->left);
    for (size_t c = 0; f->core != NULL && c < f->n_channels; c++) panel_free(&f->core[c]);
    free(f->core);
    *f = (factors){0};
}

/* f->core gets one panel for each channel of core [C][k][k]; it stays NULL where core has no data. */
static lam_status add_cores(size_t k, const store_view *core, factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    char name[48];
    if (core->data == NULL) return LAM_OK;
    f->core = memory_allocate(f->n_channels, sizeof *f->core, "operator", error);
    if (f->core == NULL) return LAM_ERR_MEMORY;
    for (size_t c = 0; c < f->n_channels; c++) {
        snprintf(name, sizeof name, STORE_OPERATOR "/core[%zu]", c);
        TRY(panel_from_view(k, k, PANEL_F32, core, c * k * k * sizeof(float), NULL, name, &f->core[c],
                            error));
    }
done:
    return status;
}

/* *core = [C][k][k] again; NULL when folded. */
static lam_status copy_cores(const factors *f, float **core, lam_error *error) {
    *core = NULL;
    if (f->core == NULL) return LAM_OK;
    /* The padded panels were allocated, so the square of k cannot overflow. */
    const size_t k = f->left.k;
    float *rows = memory_allocate(f->n_channels, k * k * sizeof *rows, STORE_OPERATOR "/core", error);
    if (rows == NULL) return LAM_ERR_MEMORY;
    for (size_t c = 0; c < f->n_channels; c++) panel_copy_rows(&f->core[c], rows + c * k * k);
    *core = rows;
    return LAM_OK;
}

lam_status factors_create(size_t n, size_t k, size_t n_channels, float *left, float *core, factors *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    factors f = {.n_channels = n_channels};
    TRY(panel_create(n, k, left, core == NULL ? STORE_OPERATOR "/Y" : STORE_OPERATOR "/U", &f.left, error));
    /* Gone as soon as the panel stands, so that it is not there twice for longer than that. */
    free(left);
    left = NULL;
    TRY(add_cores(k, &(store_view){.data = core}, &f, error));
    *out = f;
    f = (factors){0};
done:
    free(left);
    free(core);
    factors_free(&f);
    return status;
}

lam_status factors_load(store *s, size_t n, size_t n_channels, factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    char *form = NULL;
    store_view core = {.data = NULL};
    factors f = {.n_channels = n_channels};
    size_t k = SIZE_MAX;
    TRY(store_get_text(s, STORE_OPERATOR, "form", &form, error));
    const bool folded = strcmp(form, "folded") == 0;
    if (!folded && strcmp(form, "factored") != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has the unknown form '%s', must be folded or factored",
             store_path(s), form);
    if (folded && n_channels != 1)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /operator is folded, which needs 1 channel, /mesh/reflectance has %zu", store_path(s),
             n_channels);
    TRY(panel_load(s, folded ? STORE_OPERATOR "/Y" : STORE_OPERATOR "/U", n, &k, &f.left, error));
    TRY(panel_check_precision(s, f.left.precision, error));
    if (!folded)
        TRY(store_read_view(s, STORE_OPERATOR "/core", STORE_F32, 3,
                            (size_t[STORE_MAX_RANK]){n_channels, k, k}, &core, error));
    TRY(add_cores(k, &core, &f, error));
    *out = f;
    f = (factors){0};
done:
    free(form);
    store_view_free(&core);
    factors_free(&f);
    return status;
}

lam_status factors_save(const factors *f, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t dims[3] = {f->n_channels, f->left.k, f->left.k};
    float *core = NULL;
    TRY(store_set_integer(s, STORE_OPERATOR, "rank", (int64_t)f->left.k, error));
    TRY(panel_save(&f->left, s, name_of_left(f), error));
    TRY(copy_cores(f, &core, error));
    if (core != NULL) TRY(store_write(s, STORE_OPERATOR "/core", STORE_F32, 3, dims, core, error));
done:
    free(core);
    return status;
}

lam_status factors_convert(const factors *f, panel_precision precision, factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    factors made = {.n_channels = f->n_channels};
    float *core = NULL;
    TRY(panel_convert(&f->left, precision, name_of_left(f), &made.left, error));
    TRY(copy_cores(f, &core, error));
    TRY(add_cores(f->left.k, &(store_view){.data = core}, &made, error));
    *out = made;
    made = (factors){0};
done:
    free(core);
    factors_free(&made);
    return status;
}

lam_status factors_relight(const lam_operator *op, const factors *f, core_factors in,
                           const float *reflectance, factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    factors made = {.left = f->left, .borrowed = true, .n_channels = f->n_channels};
    float *core = NULL;
    const size_t k = f->left.k;
    double rcond;
    if (f->core == NULL)
        FAIL(error, LAM_ERR_UNSUPPORTED, "an operator of form folded has its reflectances in its factors");
    core = memory_allocate(f->n_channels, k * k * sizeof *core, "core", error);
    if (core == NULL) TRY(LAM_ERR_MEMORY);
    in.n = op->n;
    in.k = k;
    in.U_panel = &f->left;
    in.order = op->order;
    for (size_t c = 0; c < f->n_channels; c++) {
        in.rho = reflectance + c * op->n;
        TRY(core_make(&in, core + c * k * k, &rcond, error));
    }
    TRY(add_cores(k, &(store_view){.data = core}, &made, error));
    *out = made;
    made = (factors){.borrowed = true};
done:
    free(core);
    factors_free(&made);
    return status;
}

void factors_set_threads(factors *f, size_t n_threads) {
    f->left.n_threads = n_threads;
    for (size_t c = 0; f->core != NULL && c < f->n_channels; c++) f->core[c].n_threads = n_threads;
}

void factors_describe(const factors *f, operator_description *description) {
    description->precision = panel_precision_name(f->left.precision);
    description->form = f->core == NULL ? "folded" : "factored";
    description->rank = f->left.k;
    description->bytes = panel_bytes(&f->left);
    for (size_t c = 0; f->core != NULL && c < f->n_channels; c++)
        description->bytes += panel_bytes(&f->core[c]);
}

size_t factors_work_bytes(const factors *f, size_t n_rhs, size_t V_bytes) {
    size_t m, t_bytes, total = 0;
    if (!size_multiply(n_rhs, f->n_channels, &m) || !size_multiply(m, f->left.stride, &t_bytes) ||
        !size_multiply(t_bytes, sizeof(float), &t_bytes))
        return 0;
    const size_t of_left = panel_work_bytes(&f->left, m);
    const size_t of_core = f->core != NULL ? panel_work_bytes(f->core, n_rhs) : of_left;
    size_t product = of_left > of_core ? of_left : of_core;
    product = product > V_bytes ? product : V_bytes;
    if (of_left == 0 || of_core == 0 || !work_area_add(&total, t_bytes) || !work_area_add(&total, t_bytes) ||
        !work_area_add(&total, product))
        return 0;
    return total;
}

float *factors_take_columns(const factors *f, size_t n_rhs, void **work) {
    return work_area_take(work, n_rhs * f->n_channels * f->left.stride * sizeof(float));
}

/* Numbers of a vector that lie a stride apart. */
static void negate(size_t m, size_t k, size_t stride, const float *t, float *out) {
    for (size_t v = 0; v < m; v++)
        for (size_t p = 0; p < k; p++) out[v * stride + p] = -t[v * stride + p];
}

void factors_expand(const lam_operator *op, const factors *f, size_t n_rhs, const float *T, size_t n_selected,
                    const uint32_t *selected, float *P, void *work) {
    const size_t C = f->n_channels, m = n_rhs * C, stride = f->left.stride;
    const size_t rows = selected != NULL ? n_selected : op->n;
    float *t = factors_take_columns(f, n_rhs, &work);
    if (f->core == NULL)
        negate(m, f->left.k, stride, T, t);
    else
        for (size_t c = 0; c < C; c++)
            panel_expand(&f->core[c], n_rhs, T + c * stride, C * stride, t + c * stride, C * stride, work);
    if (selected == NULL)
        panel_expand(&f->left, m, t, stride, P, rows, work);
    else
        panel_expand_rows(&f->left, m, t, stride, n_selected, selected, op->position, P, rows, work);
    for (size_t v = 0; v < m && f->core != NULL; v++) /* rho' */
        for (size_t r = 0; r < rows; r++)
            P[v * rows + r] *= operator_reflectance_or_one(
                op, v % C, selected != NULL ? operator_position(op, selected[r]) : r);
}

void factors_project(const lam_operator *op, const factors *f, size_t n_rhs, float *g, float *T, void *work) {
    const size_t n = op->n, C = f->n_channels, m = n_rhs * C, stride = f->left.stride;
    if (f->core == NULL) { /* -Y^T g */
        panel_project(&f->left, m, g, n, T, stride, work);
        negate(m, f->left.k, stride, T, T);
        return;
    }
    float *t = factors_take_columns(f, n_rhs, &work);
    for (size_t v = 0; v < m; v++) /* core_c^T (U^T rho'_c g) */
        for (size_t p = 0; p < n; p++) g[v * n + p] *= operator_reflectance_or_one(op, v % C, p);
    panel_project(&f->left, m, g, n, t, stride, work);
    for (size_t c = 0; c < C; c++)
        panel_project(&f->core[c], n_rhs, t + c * stride, C * stride, T + c * stride, C * stride, work);
}
