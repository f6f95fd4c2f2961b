/* kind "low_rank": B = E + P E with P of rank k (Aguerre 2016, eq. 2.8); V is [n][k]. */
#include "solver/linalg/panel_store.h"
#include "solver/operator/factors.h"
#include "store/groups.h"

#include <stdlib.h>

typedef struct low_rank {
    lam_operator base;
    factors f;
    panel V;
} low_rank;

static void low_rank_destroy(lam_operator *op) {
    low_rank *self = (low_rank *)op;
    if (!self->f.borrowed) panel_free(&self->V); /* V is where U is */
    factors_free(&self->f);
}

/* Takes f and V over, also on an error. */
static lam_status assemble(size_t n, const float *reflectance, factors *f, panel *V, lam_operator **op,
                           lam_error *error) {
    lam_status status = LAM_OK;
    low_rank *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_low_rank;
    self->f = *f;
    self->V = *V;
    *f = (factors){0};
    *V = (panel){0};
    TRY(operator_init(&self->base, &operator_low_rank, n, self->f.n_channels, reflectance, error));
    *op = &self->base;
    self = NULL;
done:
    if (!f->borrowed) panel_free(V);
    factors_free(f);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

/* Both forms; core is NULL when folded. */
lam_status operator_low_rank_create_factored(size_t n, size_t k, size_t n_channels, const float *reflectance,
                                             float *left, float *V, float *core, lam_operator **op,
                                             lam_error *error) {
    lam_status status = LAM_OK;
    factors f = {.core = NULL};
    panel V_panel = {0};
    TRY(factors_create(n, k, n_channels, left, core, &f, error));
    TRY(panel_create(n, k, V, STORE_OPERATOR "/V", &V_panel, error));
    free(V);
    V = NULL;
    TRY(assemble(n, reflectance, &f, &V_panel, op, error));
done:
    factors_free(&f);
    free(V);
    return status;
}

lam_status operator_low_rank_create_folded(size_t n, size_t k, const float *reflectance, float *Y, float *V,
                                           lam_operator **op, lam_error *error) {
    return operator_low_rank_create_factored(n, k, 1, reflectance, Y, V, NULL, op, error);
}

static lam_status low_rank_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    factors f = {.core = NULL};
    panel V = {0};
    TRY(factors_load(s, n, n_channels, &f, error));
    size_t k = f.left.k;
    TRY(panel_load(s, STORE_OPERATOR "/V", n, &k, &V, error));
    if (V.precision != f.left.precision)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has one array of %s and one of %s, must be the same",
             store_path(s), panel_precision_name(f.left.precision), panel_precision_name(V.precision));
    TRY(assemble(n, reflectance, &f, &V, op, error));
done:
    factors_free(&f);
    panel_free(&V);
    return status;
}

static lam_status low_rank_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const low_rank *self = (const low_rank *)op;
    TRY(factors_save(&self->f, s, error));
    TRY(panel_save(&self->V, s, STORE_OPERATOR "/V", error));
done:
    return status;
}

static lam_status low_rank_narrow(const lam_operator *op, panel_precision precision, lam_operator **out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const low_rank *self = (const low_rank *)op;
    factors f = {.core = NULL};
    panel V = {0};
    TRY(factors_convert(&self->f, precision, &f, error));
    TRY(panel_convert(&self->V, precision, STORE_OPERATOR "/V", &V, error));
    TRY(assemble(op->n, op->reflectance, &f, &V, out, error));
done:
    factors_free(&f);
    panel_free(&V);
    return status;
}

static lam_status low_rank_relight(const lam_operator *op, const float *reflectance, atomic_bool *cancelled,
                                   lam_operator **out, lam_error *error) {
    lam_status status = LAM_OK;
    const low_rank *self = (const low_rank *)op;
    factors f = {.core = NULL};
    panel V = self->V;
    const core_factors in = {.V_panel = &self->V, .cancelled = cancelled};
    TRY(factors_relight(op, &self->f, in, reflectance, &f, error));
    TRY(assemble(op->n, reflectance, &f, &V, out, error));
done:
    return status;
}

static size_t low_rank_work_bytes(const lam_operator *op, size_t n_rhs) {
    const low_rank *self = (const low_rank *)op;
    size_t m;
    if (!size_multiply(n_rhs, op->n_channels, &m)) return 0;
    const size_t V_bytes = panel_work_bytes(&self->V, m);
    return V_bytes > 0 ? factors_work_bytes(&self->f, n_rhs, V_bytes) : 0;
}

/* T = V^T E; work goes on behind it. */
static float *columns_of(const low_rank *self, size_t n_rhs, const float *E, void **work) {
    float *T = factors_take_columns(&self->f, n_rhs, work);
    panel_project(&self->V, n_rhs * self->base.n_channels, E, self->base.n, T, self->f.left.stride, *work);
    return T;
}

static void low_rank_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    const low_rank *self = (const low_rank *)op;
    const float *T = columns_of(self, n_rhs, E, &work);
    factors_expand(op, &self->f, n_rhs, T, 0, NULL, P, work);
}

static void low_rank_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                                    const uint32_t *selected, float *P, void *work) {
    const low_rank *self = (const low_rank *)op;
    const float *T = columns_of(self, n_rhs, E, &work);
    factors_expand(op, &self->f, n_rhs, T, n_selected, selected, P, work);
}

/* P^T g = V T, T = -Y^T g or core_c^T U^T rho'_c g */
static void low_rank_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    const low_rank *self = (const low_rank *)op;
    float *T = factors_take_columns(&self->f, n_rhs, &work);
    factors_project(op, &self->f, n_rhs, g, T, work);
    panel_expand(&self->V, n_rhs * op->n_channels, T, self->f.left.stride, w, op->n, work);
}

static void low_rank_set_threads(lam_operator *op, size_t n_threads) {
    low_rank *self = (low_rank *)op;
    factors_set_threads(&self->f, n_threads);
    self->V.n_threads = n_threads;
}

static void low_rank_describe(const lam_operator *op, operator_description *description) {
    const low_rank *self = (const low_rank *)op;
    factors_describe(&self->f, description);
    description->bytes += panel_bytes(&self->V);
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
    .relight = low_rank_relight,
    .destroy = low_rank_destroy,
    .describe = low_rank_describe,
};
