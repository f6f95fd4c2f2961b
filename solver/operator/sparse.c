/* kind "sparse": rows of M~ - I in CSR, and one number per row for its dropped entries (Aguerre 2016, section
 * 4.4.2), which counts light of the row's part of the scene only. The cost of an answer is the number of
 * stored entries: of all rows, of the selected rows, or of the columns of the emitting elements. */
#include "solver/operator/sparse.h"

#include "solver/base/work_area.h"
#include "solver/linalg/sparse_product.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Another name than without parts, so that programs that know of none refuse the store. */
#define WEIGHT_IN_PART STORE_OPERATOR "/delta_weight_in_part"

typedef struct sparse {
    lam_operator base;
    sparse_arrays a;
    size_t n_parts;
    csr *transposed; /* [C], of a.M: for light of few elements, and for the adjoint */
} sparse;

void sparse_arrays_free(sparse_arrays *arrays, size_t n_channels) {
    for (size_t c = 0; arrays->M != NULL && c < n_channels; c++) csr_free(&arrays->M[c]);
    free(arrays->M);
    free(arrays->delta);
    free(arrays->weight);
    free(arrays->part);
    *arrays = (sparse_arrays){.M = NULL};
}

static void sparse_destroy(lam_operator *op) {
    sparse *self = (sparse *)op;
    for (size_t c = 0; self->transposed != NULL && c < op->n_channels; c++) csr_free(&self->transposed[c]);
    free(self->transposed);
    sparse_arrays_free(&self->a, op->n_channels);
}

static lam_status check_finite(const float *values, size_t n, const char *name, lam_error *error) {
    for (size_t i = 0; i < n; i++)
        if (!isfinite(values[i]))
            return status_fail(error, LAM_ERR_NUMERIC, "%s[%zu] = %g, must be finite", name, i,
                               (double)values[i]);
    return LAM_OK;
}

lam_status operator_sparse_create(size_t n, size_t n_channels, const float *reflectance,
                                  sparse_arrays *arrays, lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char name[48];
    sparse *self = memory_allocate(1, sizeof *self, "operator", error);
    if (self == NULL) TRY(LAM_ERR_MEMORY);
    self->base.kind = &operator_sparse;
    TRY(operator_init(&self->base, &operator_sparse, n, n_channels, reflectance, error));
    for (size_t c = 0; c < n_channels; c++) {
        snprintf(name, sizeof name, STORE_OPERATOR "/M/%zu", c);
        TRY(csr_check(&arrays->M[c], (size_t)arrays->M[c].indptr[n], name, error));
    }
    if (arrays->delta != NULL) {
        TRY(check_finite(arrays->delta, n * n_channels, STORE_OPERATOR "/delta", error));
        TRY(check_finite(arrays->weight, n, STORE_OPERATOR "/delta_weight", error));
    }
    for (size_t p = 0; arrays->part != NULL && p < n; p++) {
        if (arrays->part[p] >= n)
            FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/delta_part[%zu] = %u, must be below %zu", p,
                 arrays->part[p], n);
        if (arrays->part[p] >= self->n_parts) self->n_parts = (size_t)arrays->part[p] + 1;
    }
    self->a = *arrays;
    *arrays = (sparse_arrays){.M = NULL};
    self->transposed = memory_allocate(n_channels, sizeof *self->transposed, "operator", error);
    if (self->transposed == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < n_channels; c++) TRY(csr_transpose(&self->a.M[c], &self->transposed[c], error));
    *op = &self->base;
    self = NULL;
done:
    sparse_arrays_free(arrays, n_channels);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

static lam_status sparse_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                              lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    char name[48];
    void *delta = NULL, *weight = NULL, *part = NULL;
    const bool parts = store_has(s, STORE_OPERATOR "/delta_part");
    sparse_arrays arrays = {.M = memory_allocate(n_channels, sizeof *arrays.M, "operator", error)};
    if (arrays.M == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < n_channels; c++) {
        snprintf(name, sizeof name, STORE_OPERATOR "/M/%zu", c);
        TRY(csr_load(s, name, n, &arrays.M[c], error));
    }
    if (store_has(s, STORE_OPERATOR "/delta")) {
        TRY(store_read(s, STORE_OPERATOR "/delta", STORE_F32, 2, (size_t[STORE_MAX_RANK]){n_channels, n},
                       &delta, error));
        TRY(store_read(s, parts ? WEIGHT_IN_PART : STORE_OPERATOR "/delta_weight", STORE_F32, 1,
                       (size_t[STORE_MAX_RANK]){n}, &weight, error));
        if (parts)
            TRY(store_read(s, STORE_OPERATOR "/delta_part", STORE_U32, 1, (size_t[STORE_MAX_RANK]){n}, &part,
                           error));
    }
    arrays.delta = delta;
    arrays.weight = weight;
    arrays.part = part;
    delta = weight = part = NULL;
    TRY(operator_sparse_create(n, n_channels, reflectance, &arrays, op, error));
done:
    free(delta);
    free(weight);
    free(part);
    sparse_arrays_free(&arrays, n_channels);
    return status;
}

static lam_status sparse_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const sparse *self = (const sparse *)op;
    const size_t n = op->n, both[2] = {op->n_channels, n};
    char name[48];
    for (size_t c = 0; c < op->n_channels; c++) {
        snprintf(name, sizeof name, STORE_OPERATOR "/M/%zu", c);
        TRY(csr_save(&self->a.M[c], name, s, error));
    }
    if (self->a.delta == NULL) goto done;
    TRY(store_write(s, STORE_OPERATOR "/delta", STORE_F32, 2, both, self->a.delta, error));
    TRY(store_write(s, self->a.part != NULL ? WEIGHT_IN_PART : STORE_OPERATOR "/delta_weight", STORE_F32, 1,
                    &n, self->a.weight, error));
    if (self->a.part != NULL)
        TRY(store_write(s, STORE_OPERATOR "/delta_part", STORE_U32, 1, &n, self->a.part, error));
done:
    return status;
}

static size_t sparse_work_bytes(const lam_operator *op, size_t n_rhs) {
    const size_t sums = ((const sparse *)op)->n_parts * sizeof(double);
    size_t bytes = sparse_product_work(op->n, n_rhs), total = 2 * WORK_AREA_ALIGN;
    return bytes > 0 && work_area_add(&total, bytes) && work_area_add(&total, sums) ? total : 0;
}

/* a . b, in double and in one order. */
static float dot(size_t n, const float *a, const float *b) {
    double sum = 0;
    for (size_t p = 0; p < n; p++) sum += (double)a[p] * (double)b[p];
    return (float)sum;
}

/* sums [n_parts] = a . b over each part. */
static void dot_parts(const sparse *self, const float *a, const float *b, double *sums) {
    memset(sums, 0, self->n_parts * sizeof *sums);
    for (size_t p = 0; p < self->base.n; p++) sums[self->a.part[p]] += (double)a[p] * (double)b[p];
}

/* P += delta (weight . E), E being one vector of a channel c, of all rows or some. */
static void add_dropped(const sparse *self, size_t c, const float *E, size_t n_rows, const uint32_t *selected,
                        double *sums, float *P) {
    const size_t n = self->base.n;
    const float *delta = self->a.delta + c * n;
    const uint32_t *part = self->a.part;
    const float all = part == NULL ? dot(n, self->a.weight, E) : 0;
    if (part != NULL) dot_parts(self, self->a.weight, E, sums);
    for (size_t r = 0; r < n_rows; r++) {
        const size_t p = selected != NULL ? operator_position(&self->base, selected[r]) : r;
        P[r] += delta[p] * (part != NULL ? (float)sums[part[p]] : all);
    }
}

/* P = M E + delta (weight . E), of all rows or (selected not NULL) some. */
static void sparse_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_rows,
                                  const uint32_t *selected, float *P, void *work) {
    const sparse *self = (const sparse *)op;
    const size_t n = op->n, C = op->n_channels;
    work = work_area_begin(work);
    double *sums = work_area_take(&work, self->n_parts * sizeof *sums);
    for (size_t c = 0; c < C; c++) {
        const sparse_pair M = {&self->a.M[c], &self->transposed[c], op->n_threads};
        sparse_product(&M, n_rhs, E + c * n, C * n, n_rows, selected, op->position, P + c * n_rows,
                       C * n_rows, work);
        for (size_t v = 0; self->a.delta != NULL && v < n_rhs; v++)
            add_dropped(self, c, E + (v * C + c) * n, n_rows, selected, sums, P + (v * C + c) * n_rows);
    }
}

static void sparse_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    sparse_apply_selected(op, n_rhs, E, op->n, NULL, P, work);
}

/* w = M^T g + weight (delta . g) */
static void sparse_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    const sparse *self = (const sparse *)op;
    const size_t n = op->n, C = op->n_channels;
    const uint32_t *part = self->a.part;
    work = work_area_begin(work);
    double *sums = work_area_take(&work, self->n_parts * sizeof *sums);
    for (size_t c = 0; c < C; c++) {
        const sparse_pair transposed = {&self->transposed[c], &self->a.M[c], op->n_threads};
        sparse_product(&transposed, n_rhs, g + c * n, C * n, 0, NULL, NULL, w + c * n, C * n, work);
        if (self->a.delta == NULL) continue;
        for (size_t v = 0; v < n_rhs; v++) {
            const float *delta = self->a.delta + c * n, *given = g + (v * C + c) * n;
            const float all = part == NULL ? dot(n, delta, given) : 0;
            float *row = w + (v * C + c) * n;
            if (part != NULL) dot_parts(self, delta, given, sums);
            for (size_t p = 0; p < n; p++)
                row[p] += self->a.weight[p] * (part != NULL ? (float)sums[part[p]] : all);
        }
    }
}

static void sparse_describe(const lam_operator *op, operator_description *description) {
    const sparse *self = (const sparse *)op;
    const double whole = (double)op->n * (double)op->n * (double)op->n_channels;
    double entries = 0;
    for (size_t c = 0; c < op->n_channels; c++) {
        const size_t stored = (size_t)self->a.M[c].indptr[op->n];
        entries += (double)stored;
        description->bytes += (op->n + 1) * sizeof(uint64_t) + stored * (sizeof(uint32_t) + sizeof(float));
    }
    if (self->a.delta != NULL) description->bytes += (op->n_channels + 1) * op->n * sizeof(float);
    if (self->a.part != NULL) description->bytes += op->n * sizeof *self->a.part;
    description->density = entries / whole;
}

/* By columns too. */
static uint64_t sparse_memory(store *s, uint64_t stored) {
    (void)s;
    return 2 * stored;
}

const operator_kind operator_sparse = {
    .name = "sparse",
    .load = sparse_load,
    .save = sparse_save,
    .work_bytes = sparse_work_bytes,
    .apply = sparse_apply,
    .apply_adjoint = sparse_apply_adjoint,
    .apply_selected = sparse_apply_selected,
    .destroy = sparse_destroy,
    .describe = sparse_describe,
    .memory = sparse_memory,
};
