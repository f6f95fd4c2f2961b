/* kind "sparse": rows of M~ - I in CSR, and for what was left out of them one number a row (Aguerre 2016,
 * section 4.4.2). An answer costs what is stored; a row alone what is stored of it. */
#include "solver/operator/sparse.h"

#include "solver/operator/csr_floats.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct sparse {
    lam_operator base;
    sparse_arrays a;
} sparse;

/* Rows shorter than this in all are done by one thread. */
enum { THREADS_WORTH = 200000 };

void sparse_arrays_free(sparse_arrays *arrays, size_t n_channels) {
    for (size_t c = 0; arrays->M != NULL && c < n_channels; c++) csr_free(&arrays->M[c]);
    free(arrays->M);
    free(arrays->delta);
    free(arrays->weight);
    *arrays = (sparse_arrays){.M = NULL};
}

static void sparse_destroy(lam_operator *op) {
    sparse_arrays_free(&((sparse *)op)->a, op->n_channels);
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
        snprintf(name, sizeof name, "/operator/M/%zu", c);
        TRY(csr_check(&arrays->M[c], (size_t)arrays->M[c].indptr[n], name, error));
    }
    if (arrays->delta != NULL) {
        TRY(check_finite(arrays->delta, n * n_channels, "/operator/delta", error));
        TRY(check_finite(arrays->weight, n, "/operator/delta_weight", error));
    }
    self->a = *arrays;
    *arrays = (sparse_arrays){.M = NULL};
    *op = &self->base;
    self = NULL;
done:
    sparse_arrays_free(arrays, n_channels);
    if (self != NULL) lam_operator_close(&self->base);
    return status;
}

/* --- the store -------------------------------------------------------------------------------------------
 */

static lam_status load_rows(store *s, size_t n, size_t c, csr *M, lam_error *error) {
    lam_status status = LAM_OK;
    char name[3][48];
    void *indptr = NULL, *indices = NULL, *data = NULL;
    static const char *const parts[3] = {"indptr", "indices", "data"};
    for (int k = 0; k < 3; k++) snprintf(name[k], sizeof name[k], "/operator/M/%zu/%s", c, parts[k]);
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX}, ends[STORE_MAX_RANK] = {n + 1};
    TRY(store_read(s, name[0], STORE_U64, 1, ends, &indptr, error));
    TRY(store_read(s, name[1], STORE_U32, 1, dims, &indices, error));
    TRY(store_read(s, name[2], STORE_F32, 1, dims, &data, error));
    const uint64_t *last = indptr;
    if (last[n] != dims[0])
        FAIL(error, LAM_ERR_FORMAT, "%s: %s ends at %zu, must be %zu", store_path(s), name[0],
             (size_t)last[n], dims[0]);
    *M = (csr){.n = n, .indptr = indptr, .indices = indices, .data = data};
    indptr = indices = data = NULL;
done:
    free(indptr);
    free(indices);
    free(data);
    return status;
}

static lam_status sparse_load(store *s, size_t n, size_t n_channels, const float *reflectance,
                              lam_operator **op, lam_error *error) {
    lam_status status = LAM_OK;
    void *delta = NULL, *weight = NULL;
    sparse_arrays arrays = {.M = memory_allocate(n_channels, sizeof *arrays.M, "operator", error)};
    if (arrays.M == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < n_channels; c++) TRY(load_rows(s, n, c, &arrays.M[c], error));
    if (store_has(s, "/operator/delta")) {
        TRY(store_read(s, "/operator/delta", STORE_F32, 2, (size_t[STORE_MAX_RANK]){n_channels, n}, &delta,
                       error));
        TRY(store_read(s, "/operator/delta_weight", STORE_F32, 1, (size_t[STORE_MAX_RANK]){n}, &weight,
                       error));
    }
    arrays.delta = delta;
    arrays.weight = weight;
    delta = weight = NULL;
    TRY(operator_sparse_create(n, n_channels, reflectance, &arrays, op, error));
done:
    free(delta);
    free(weight);
    sparse_arrays_free(&arrays, n_channels);
    return status;
}

static lam_status sparse_save(const lam_operator *op, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const sparse *self = (const sparse *)op;
    const size_t n = op->n, ends = n + 1, both[2] = {op->n_channels, n};
    char name[48];
    for (size_t c = 0; c < op->n_channels; c++) {
        const csr *M = &self->a.M[c];
        const size_t entries = (size_t)M->indptr[n];
        snprintf(name, sizeof name, "/operator/M/%zu/indptr", c);
        TRY(store_write(s, name, STORE_U64, 1, &ends, M->indptr, error));
        snprintf(name, sizeof name, "/operator/M/%zu/indices", c);
        TRY(store_write(s, name, STORE_U32, 1, &entries, M->indices, error));
        snprintf(name, sizeof name, "/operator/M/%zu/data", c);
        TRY(store_write(s, name, STORE_F32, 1, &entries, M->data, error));
    }
    if (self->a.delta == NULL) goto done;
    TRY(store_write(s, "/operator/delta", STORE_F32, 2, both, self->a.delta, error));
    TRY(store_write(s, "/operator/delta_weight", STORE_F32, 1, &n, self->a.weight, error));
done:
    return status;
}

/* --- the products ----------------------------------------------------------------------------------------
 */

static size_t sparse_work_bytes(const lam_operator *op, size_t n_rhs) {
    size_t bytes, total = PANEL_ALIGN;
    if (!size_multiply(op->n, csr_floats_width(n_rhs) * sizeof(float), &bytes) || !work_add(&total, bytes))
        return 0;
    return total;
}

typedef struct row_job {
    const csr *M;
    csr_float_row *multiply;
    const float *X; /* side by side */
    size_t n_rhs;
    const float *delta; /* of the channel, or NULL */
    const float *lost;  /* [n_rhs], weight . E */
    float *P;           /* P[v stride + r] */
    size_t stride;
} row_job;

static void do_row(const row_job *j, size_t row, size_t r) {
    const uint64_t first = j->M->indptr[row], entries = j->M->indptr[row + 1] - first;
    const uint32_t *indices = j->M->indices + first;
    const float *data = j->M->data + first;
    float sums[OPERATOR_PASS];
    j->multiply(indices, data, entries, j->X, sums);
    for (size_t v = 0; v < j->n_rhs; v++)
        j->P[v * j->stride + r] = j->delta == NULL ? sums[v] : sums[v] + j->delta[row] * j->lost[v];
}

/* weight . E, in double and in one order. */
static float lost_of(const sparse *self, const float *E) {
    double sum = 0;
    if (self->a.weight == NULL) return 0;
    for (size_t p = 0; p < self->base.n; p++) sum += (double)self->a.weight[p] * (double)E[p];
    return (float)sum;
}

/* What the rows of one channel are multiplied with: E as it is, or side by side in work. */
static const float *side_by_side(const lam_operator *op, size_t n_rhs, const float *E, size_t width,
                                 void *work) {
    const size_t stride = op->n_channels * op->n;
    float *X = work;
    if (width == 1) return E;
    for (size_t p = 0; p < op->n; p++)
        for (size_t v = 0; v < width; v++) X[p * width + v] = v < n_rhs ? E[v * stride + p] : 0;
    return X;
}

/* A row that few others share what is put side by side with is faster without: a vector at a time, whose bits
 * are the same. */
static bool rows_are_few(const csr *M, size_t n_rows) {
    return (double)n_rows * (double)M->indptr[M->n] < (double)M->n * (double)M->n;
}

/* selected NULL: all rows. */
static void multiply_together(const lam_operator *op, size_t n_rhs, const float *E, size_t n_rows,
                              const uint32_t *selected, float *P, void *work) {
    const sparse *self = (const sparse *)op;
    const size_t n = op->n, C = op->n_channels;
    for (size_t c = 0; c < C; c++) {
        float lost[OPERATOR_PASS];
        for (size_t v = 0; v < n_rhs; v++) lost[v] = lost_of(self, E + (v * C + c) * n);
        const size_t width = csr_floats_width(n_rhs);
        const row_job job = {.M = &self->a.M[c],
                             .multiply = csr_floats_row(width),
                             .X = side_by_side(op, n_rhs, E + c * n, width, work),
                             .n_rhs = n_rhs,
                             .delta = self->a.delta != NULL ? self->a.delta + c * n : NULL,
                             .lost = lost,
                             .P = P + c * n_rows,
                             .stride = C * n_rows};
        const bool many = op->n_threads > 1 && job.M->indptr[n] / n * n_rows * n_rhs > THREADS_WORTH;
#pragma omp parallel for schedule(dynamic, 256) num_threads((int)op->n_threads) if (many)
        for (size_t r = 0; r < n_rows; r++)
            do_row(&job, selected != NULL ? operator_position(op, selected[r]) : r, r);
    }
}

static void multiply(const lam_operator *op, size_t n_rhs, const float *E, size_t n_rows,
                     const uint32_t *selected, float *P, void *work) {
    const size_t C = op->n_channels;
    bool few = selected != NULL;
    for (size_t c = 0; c < C; c++) few = few && rows_are_few(&((const sparse *)op)->a.M[c], n_rows);
    if (!few) {
        multiply_together(op, n_rhs, E, n_rows, selected, P, work);
        return;
    }
    for (size_t v = 0; v < n_rhs; v++)
        multiply_together(op, 1, E + v * C * op->n, n_rows, selected, P + v * C * n_rows, work);
}

static void sparse_apply(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work) {
    multiply(op, n_rhs, E, op->n, NULL, P, work);
}

static void sparse_apply_selected(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                                  const uint32_t *selected, float *P, void *work) {
    multiply(op, n_rhs, E, n_selected, selected, P, work);
}

/* w = M^T g + weight (delta . g) */
static void adjoint_of_one(const sparse *self, size_t c, const float *g, float *w) {
    const size_t n = self->base.n;
    const csr *M = &self->a.M[c];
    for (size_t p = 0; p < n; p++) w[p] = 0;
    for (size_t row = 0; row < n; row++) {
        const float g_row = g[row];
        if (g_row == 0) continue;
        for (uint64_t e = M->indptr[row]; e < M->indptr[row + 1]; e++) w[M->indices[e]] += M->data[e] * g_row;
    }
    if (self->a.delta == NULL) return;
    const float *delta = self->a.delta + c * n;
    double lost = 0;
    for (size_t p = 0; p < n; p++) lost += (double)delta[p] * (double)g[p];
    for (size_t p = 0; p < n; p++) w[p] += self->a.weight[p] * (float)lost;
}

static void sparse_apply_adjoint(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work) {
    const size_t n = op->n;
    (void)work;
#pragma omp parallel for schedule(dynamic, 1) num_threads((int)op->n_threads) if (op->n_threads > 1)
    for (size_t v = 0; v < n_rhs * op->n_channels; v++)
        adjoint_of_one((const sparse *)op, v % op->n_channels, g + v * n, w + v * n);
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
    description->density = entries / whole;
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
};
