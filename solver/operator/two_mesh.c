/* kind "two_mesh": a fine mesh of n elements receives, a coarse one of k patches sends (Fernández et al.
 * 2011, section 4). As low_rank, with a V of one entry a row, of which the index vector I is kept (eq. 7). */
#include "solver/operator/two_mesh.h"

#include "solver/linalg/segments.h"
#include "solver/operator/factors.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct two_mesh {
    lam_operator base;
    factors f;
    segments V;
    float *coherence; /* [k], or NULL */
} two_mesh;

static void two_mesh_destroy(lam_operator *op) {
    two_mesh *self = (two_mesh *)op;
    if (!self->f.borrowed) { /* V is where U is */
        segments_free(&self->V);
        free(self->coherence);
    }
    factors_free(&self->f);
}

void two_mesh_arrays_free(two_mesh_arrays *arrays) {
    free(arrays->left);
    free(arrays->begin);
    free(arrays->weight);
    free(arrays->coherence);
    free(arrays->core);
    *arrays = (two_mesh_arrays){0};
}

/* Takes f over and what else arrays has, also on an error. */
static lam_status assemble(size_t n, const float *reflectance, factors *f, two_mesh_arrays *arrays,
                           lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k = f->left.k;
    two_mesh *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_two_mesh;
    self->f = *f;
    *f = (factors){0};
    TRY(operator_init(&self->base, &operator_two_mesh, n, self->f.n_channels, reflectance, error));
    TRY(segments_create(n, k, arrays->begin, arrays->weight, &self->V, error));
    arrays->begin = NULL;
    arrays->weight = NULL;
    for (size_t p = 0; arrays->coherence != NULL && p < k; p++)
        if (!(arrays->coherence[p] >= 0 && arrays->coherence[p] <= 1))
            FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/coherence[%zu] = %g, must be from 0 to 1", p,
                 (double)arrays->coherence[p]);
    self->coherence = arrays->coherence;
    arrays->coherence = NULL;
    *op = &self->base;
    self = NULL;
done:
    factors_free(f);
    two_mesh_arrays_free(arrays);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

lam_status operator_two_mesh_create(size_t n, size_t k, size_t n_channels, const float *reflectance,
                                    two_mesh_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    factors f = {.core = NULL};
    float *left = arrays->left, *core = arrays->core;
    arrays->left = arrays->core = NULL;
    TRY(factors_create(n, k, n_channels, left, core, &f, error));
    TRY(assemble(n, reflectance, &f, arrays, op, error));
done:
    two_mesh_arrays_free(arrays);
    return status;
}

static lam_status two_mesh_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                                lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    factors f = {.core = NULL};
    void *I = NULL, *weight = NULL, *coherence = NULL;
    TRY(factors_load(s, n, n_channels, &f, error));
    const size_t k = f.left.k;
    if (k == 0 || k > n)
        FAIL(error, LAM_ERR_FORMAT, "%s: /operator has %zu patches, must be at least 1 and at most %zu",
             store_path(s), k, n);
    TRY(store_read(s, STORE_OPERATOR "/I", STORE_U64, 1, (size_t[STORE_MAX_RANK]){k + 1}, &I, error));
    if (store_has(s, STORE_OPERATOR "/weight"))
        TRY(store_read(s, STORE_OPERATOR "/weight", STORE_F32, 1, (size_t[STORE_MAX_RANK]){n}, &weight,
                       error));
    if (store_has(s, STORE_OPERATOR "/coherence"))
        TRY(store_read(s, STORE_OPERATOR "/coherence", STORE_F32, 1, (size_t[STORE_MAX_RANK]){k}, &coherence,
                       error));
    two_mesh_arrays arrays = {.begin = I, .weight = weight, .coherence = coherence};
    I = weight = coherence = NULL;
    TRY(assemble(n, reflectance, &f, &arrays, op, error));
done:
    factors_free(&f);
    free(I);
    free(weight);
    free(coherence);
    return status;
}

static lam_status two_mesh_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const two_mesh *self = (const two_mesh *)op;
    const size_t k = self->f.left.k, n_ends = k + 1;
    TRY(factors_save(&self->f, s, error));
    TRY(store_write(s, STORE_OPERATOR "/I", STORE_U64, 1, &n_ends, self->V.begin, error));
    if (self->V.weight != NULL)
        TRY(store_write(s, STORE_OPERATOR "/weight", STORE_F32, 1, &op->n, self->V.weight, error));
    if (self->coherence != NULL)
        TRY(store_write(s, STORE_OPERATOR "/coherence", STORE_F32, 1, &k, self->coherence, error));
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
    const segments *V = &self->V;
    const size_t k = self->f.left.k;
    factors f = {.core = NULL};
    void *begin = NULL, *weight = NULL, *coherence = NULL;
    TRY(factors_convert(&self->f, precision, &f, error));
    TRY(copy_of(V->begin, k + 1, sizeof *V->begin, &begin, error));
    TRY(copy_of(V->weight, op->n, sizeof *V->weight, &weight, error));
    TRY(copy_of(self->coherence, k, sizeof *self->coherence, &coherence, error));
    two_mesh_arrays arrays = {.begin = begin, .weight = weight, .coherence = coherence};
    begin = weight = coherence = NULL;
    TRY(assemble(op->n, op->reflectance, &f, &arrays, out, error));
done:
    factors_free(&f);
    free(begin);
    free(weight);
    free(coherence);
    return status;
}

static lam_status two_mesh_relight(const lam_operator *op, const float *reflectance, atomic_bool *cancelled,
                                   lam_operator **out, lam_error *error) {
    lam_status status = LAM_OK;
    const two_mesh *self = (const two_mesh *)op;
    const core_factors in = {.begin = self->V.begin, .weight = self->V.weight, .cancelled = cancelled};
    two_mesh *made = memory_allocate(1, sizeof *made, "operator", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->base.kind = &operator_two_mesh;
    made->f.borrowed = true;
    TRY(factors_relight(op, &self->f, in, reflectance, &made->f, error));
    TRY(operator_init(&made->base, &operator_two_mesh, op->n, op->n_channels, reflectance, error));
    made->V = self->V;
    made->coherence = self->coherence;
    *out = &made->base;
    made = NULL;
done:
    if (made != NULL) lam_operator_close(&made->base);
    return status;
}

static size_t two_mesh_work_bytes(const lam_operator *op, size_t n_rhs) {
    const two_mesh *self = (const two_mesh *)op;
    return factors_work_bytes(&self->f, n_rhs, 0);
}

/* T = V^T E; work goes on behind it. */
static float *columns_of(const two_mesh *self, size_t n_rhs, const float *E, void **work) {
    float *T = factors_take_columns(&self->f, n_rhs, work);
    for (size_t v = 0; v < n_rhs * self->base.n_channels; v++)
        segments_sum(&self->V, E + v * self->base.n, T + v * self->f.left.stride);
    return T;
}

static void two_mesh_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    const two_mesh *self = (const two_mesh *)op;
    const float *T = columns_of(self, n_rhs, E, &work);
    factors_expand(op, &self->f, n_rhs, T, 0, NULL, P, work);
}

static void two_mesh_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                                    const uint32_t *selected, float *P, void *work) {
    const two_mesh *self = (const two_mesh *)op;
    const float *T = columns_of(self, n_rhs, E, &work);
    factors_expand(op, &self->f, n_rhs, T, n_selected, selected, P, work);
}

/* P^T g = V T, T = -Y^T g or core_c^T U^T rho'_c g */
static void two_mesh_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    const two_mesh *self = (const two_mesh *)op;
    float *T = factors_take_columns(&self->f, n_rhs, &work);
    factors_project(op, &self->f, n_rhs, g, T, work);
    for (size_t v = 0; v < n_rhs * op->n_channels; v++)
        segments_spread(&self->V, T + v * self->f.left.stride, w + v * op->n);
}

static void two_mesh_set_threads(lam_operator *op, size_t n_threads) {
    two_mesh *self = (two_mesh *)op;
    factors_set_threads(&self->f, n_threads);
}

static void two_mesh_describe(const lam_operator *op, operator_description *description) {
    const two_mesh *self = (const two_mesh *)op;
    factors_describe(&self->f, description);
    description->bytes += segments_bytes(&self->V);
}

/* Every weight is A_j / A_p to single precision (absent ones: areas are equal), or power would be lost. */
static bool two_mesh_check(const lam_operator *op, const double *area, char *detail, size_t size) {
    static const double allowed = 1e-6;
    const segments *V = &((const two_mesh *)op)->V;
    for (size_t p = 0; p < ((const two_mesh *)op)->f.left.k; p++) {
        const double count = (double)(V->begin[p + 1] - V->begin[p]);
        double whole = 0;
        for (uint64_t j = V->begin[p]; j < V->begin[p + 1]; j++)
            whole += area[op->order != NULL ? op->order[j] : j];
        for (uint64_t j = V->begin[p]; j < V->begin[p + 1]; j++) {
            const size_t i = op->order != NULL ? op->order[j] : (size_t)j;
            const double weight = V->weight != NULL ? (double)V->weight[j] : 1 / count;
            if (fabs(weight * whole / area[i] - 1) <= allowed) continue;
            snprintf(detail, size, "element %zu weighs %.7g in patch %zu, its area is %.7g of it", i, weight,
                     p, area[i] / whole);
            return false;
        }
    }
    return true;
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
    .relight = two_mesh_relight,
    .destroy = two_mesh_destroy,
    .describe = two_mesh_describe,
    .check = two_mesh_check,
};

bool operator_patches_of(const lam_operator *op, operator_patches *patches) {
    if (op->kind != &operator_two_mesh) return false;
    const two_mesh *self = (const two_mesh *)op;
    *patches = (operator_patches){.k = self->f.left.k,
                                  .begin = self->V.begin,
                                  .order = op->order,
                                  .weight = self->V.weight,
                                  .coherence = self->coherence};
    return true;
}
